// ATmega2560: USART rings, SPI, I2C, hardware PWM, ADC, EEPROM, watchdog, reset cause, painted stack and the 100 Hz
// tick.
#include "board_mega.h"

#if defined(__AVR_ATmega2560__)

#include <Arduino.h>
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "pins.h"

extern uint8_t _end;  // from the linker: first byte behind all static data

namespace {

// Survives a reset: the flags of MCUSR, and a mark left by a restart on command.
uint8_t reset_flags __attribute__((section(".noinit")));
uint16_t restart_mark __attribute__((section(".noinit")));
constexpr uint16_t kRestartMark = 0x5A3C;
constexpr uint8_t kPaint = 0xC5;
constexpr int16_t kPaintSearched = 128;  // bytes a call

}  // namespace

// Before any other code: keep the reset cause, stop a watchdog that is still running, paint all free RAM.
extern "C" void shoal_first_of_all() __attribute__((naked, used, section(".init3")));
extern "C" void shoal_first_of_all() {
  reset_flags = MCUSR;
  MCUSR = 0;
  wdt_disable();
  for (uint8_t* byte = &_end; byte < reinterpret_cast<uint8_t*>(SP); ++byte) *byte = kPaint;
}

namespace shoal {
namespace {

// A ring with one writer and one reader, one of them an interrupt. `size` is a power of two of at most 256.
template <uint16_t size>
class Ring {
 public:
  uint16_t used() const { return static_cast<uint16_t>(head_ - tail_); }
  uint16_t room() const { return size - used(); }
  void push(uint8_t byte) { bytes_[head_++ % size] = byte; }
  uint8_t pop() { return bytes_[tail_++ % size]; }

  // For the side that runs outside the interrupt: copies first and moves its own end of the ring at the very last.
  void push(const uint8_t* bytes, uint16_t count) {
    const uint16_t at = head_ % size, first = count < size - at ? count : size - at;
    memcpy(bytes_ + at, bytes, first);
    memcpy(bytes_, bytes + first, count - first);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { head_ += count; }
  }
  void pop(uint8_t* bytes, uint16_t count) {
    const uint16_t at = tail_ % size, first = count < size - at ? count : size - at;
    memcpy(bytes, bytes_ + at, first);
    memcpy(bytes + first, bytes_, count - first);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { tail_ += count; }
  }

 private:
  uint8_t bytes_[size];
  uint16_t head_ = 0;
  uint16_t tail_ = 0;
};

template <uint16_t receive_size, uint16_t transmit_size>
struct Line {
  Ring<receive_size> received;
  Ring<transmit_size> to_send;
  uint16_t overruns;

  void on_received(uint8_t status, uint8_t byte) {
    if (status & _BV(DOR0)) ++overruns;
    if (received.room() == 0) {
      ++overruns;
    } else {
      received.push(byte);
    }
  }
};

Line<128, 128> console_line;
Line<256, 256> companion_line;
volatile uint8_t ticks_due;

constexpr uint16_t baud_register(uint32_t baud) {
  return static_cast<uint16_t>((SHOAL_CPU_HZ + 4 * baud) / (8 * baud) - 1);
}

template <typename Lines>
uint8_t take(Lines& line, uint8_t* bytes, uint8_t capacity) {
  uint16_t used = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { used = line.received.used(); }
  const uint8_t count = used < capacity ? static_cast<uint8_t>(used) : capacity;
  line.received.pop(bytes, count);
  return count;
}

template <typename Lines>
bool give(Lines& line, volatile uint8_t& control, const uint8_t* bytes, uint16_t count) {
  uint16_t room = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { room = line.to_send.room(); }
  if (count > room) return false;
  line.to_send.push(bytes, count);
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { control |= _BV(UDRIE0); }
  return true;
}

// Status codes of a master (data sheet, tables 24-3 and 24-4).
enum TwiStatus : uint8_t {
  kStarted = 0x08,
  kWriteAcknowledged = 0x18,
  kSent = 0x28,
  kReadAcknowledged = 0x40,
  kReceived = 0x50,
  kReceivedLast = 0x58
};
constexpr uint16_t kTwiPolls = 400;  // of some 10 cycles: five times as long as a byte at 200 kHz takes

// One action on the bus; false when it does not end in time or not as it should.
bool i2c_do(uint8_t action, TwiStatus expected) {
  TWCR = _BV(TWINT) | _BV(TWEN) | action;
  for (uint16_t polls = kTwiPolls; !(TWCR & _BV(TWINT)); --polls) {
    if (polls == 0) return false;
  }
  return (TWSR & 0xF8) == expected;
}

bool i2c_address(uint8_t address, TwiStatus direction) {
  if (!i2c_do(_BV(TWSTA), kStarted)) return false;
  TWDR = static_cast<uint8_t>(address << 1 | (direction == kReadAcknowledged ? 1 : 0));
  return i2c_do(0, direction);
}

// Ends a transfer; a bus on which not even a stop comes through is let go of. Returns whether all went well.
bool i2c_stop(bool good) {
  TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
  for (uint16_t polls = kTwiPolls; TWCR & _BV(TWSTO); --polls) {
    if (polls > 0) continue;
    TWCR = 0;
    return false;
  }
  return good;
}

// One output of a 16-bit timer that runs fast PWM from 0 to ICR at 2 MHz.
struct PwmOutput {
  volatile uint8_t* control;
  volatile uint16_t* compare;
  volatile uint16_t* counter;
  uint8_t connect;
};

PwmOutput output_of(Actuator actuator) {
  switch (actuator) {
    case Actuator::bow:
      return {&TCCR3A, &OCR3A, &TCNT3, _BV(COM3A1)};
    case Actuator::stern:
      return {&TCCR3A, &OCR3B, &TCNT3, _BV(COM3B1)};
    default:
      return {&TCCR4A, &OCR4A, &TCNT4, _BV(COM4A1)};
  }
}

class MegaBoard final : public Board {
 public:
  void begin();

  uint32_t micros() override { return ::micros(); }
  void imu_transfer(uint8_t* bytes, uint8_t count) override;
  bool i2c_write(uint8_t address, const uint8_t* bytes, uint8_t count) override;
  bool i2c_read(uint8_t address, uint8_t* bytes, uint8_t count) override;
  void write_pulse_us(Actuator actuator, uint16_t width_us) override;
  uint16_t read_analog(Analog input) override;
  bool leak_detected() override { return !(PINA & _BV(PA1)); }
  void write_led(bool on) override;
  uint8_t read_bytes(Port port, uint8_t* bytes, uint8_t capacity) override;
  bool write_bytes(Port port, const uint8_t* bytes, uint16_t count) override;
  uint16_t receive_overruns(Port port) override;
  uint8_t eeprom_read(uint16_t address) override;
  bool eeprom_ready() override { return !(EECR & _BV(EEPE)); }
  bool eeprom_write(uint16_t address, uint8_t value) override;
  ResetCause reset_cause() override;
  void feed_watchdog() override { wdt_reset(); }
  void reboot() override;
  uint16_t free_ram() override;

 private:
  uint16_t analog_[2] = {};
  uint8_t converting_ = 0;
  bool restarted_ = false;
  uint8_t* paint_at_ = nullptr;  // how far the present search for used bytes has come
  uint8_t* lowest_used_ = nullptr;
};

MegaBoard board;

void MegaBoard::begin() {
  restarted_ = restart_mark == kRestartMark;
  restart_mark = 0;
  lowest_used_ = reinterpret_cast<uint8_t*>(SP);
  paint_at_ = &_end;

  // Outputs: PWM pins, IMU select (high), SPI's SCK, MOSI and SS, LED. Input with pull-up: leak.
  PORTA |= _BV(PA0) | _BV(PA1);
  DDRA |= _BV(PA0);
  DDRB |= _BV(PB0) | _BV(PB1) | _BV(PB2) | _BV(PB7);
  DDRE |= _BV(PE3) | _BV(PE4);
  DDRH |= _BV(PH3);

  // Timers 3 and 4: fast PWM to ICR (mode 14), prescaler 8, 50 Hz.
  ICR3 = ICR4 = 39999;
  TCCR3A = _BV(WGM31);
  TCCR4A = _BV(WGM41);
  TCCR3B = _BV(WGM33) | _BV(WGM32) | _BV(CS31);
  TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS41);

  // Timer 1: clear on compare match, prescaler 8, 100 Hz.
  TCCR1A = 0;
  TCCR1B = _BV(WGM12) | _BV(CS11);
  OCR1A = 19999;
  TCNT1 = 0;
  TIMSK1 = _BV(OCIE1A);

  // SPI: master, mode 3, 16 MHz / 64 = 250 kHz.
  SPCR = _BV(SPE) | _BV(MSTR) | _BV(CPOL) | _BV(CPHA) | _BV(SPR1);
  SPSR = 0;

  // I2C: 16 MHz / (16 + 2 * 32) = 200 kHz, weak pull-ups beside those of the sensor's board.
  PORTD |= _BV(PD0) | _BV(PD1);
  TWSR = 0;
  TWBR = 32;

  // Both USARTs: double speed, 8N1, interrupts on reception.
  UBRR0 = baud_register(SHOAL_CONSOLE_BAUD);
  UBRR1 = baud_register(SHOAL_COMPANION_BAUD);
  UCSR0A = UCSR1A = _BV(U2X0);
  UCSR0C = UCSR1C = _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B = UCSR1B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);

  // ADC: AVCC as reference, 125 kHz; the first conversions are waited for, later ones run between the ticks.
  ADCSRA = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
  ADCSRB = 0;
  static const uint8_t kInputs[2] = {SHOAL_ANALOG_BATTERY_VOLTAGE, SHOAL_ANALOG_BATTERY_CURRENT};
  for (uint8_t i = 0; i < 2; ++i) {
    ADMUX = _BV(REFS0) | kInputs[i];
    ADCSRA |= _BV(ADSC);
    while (ADCSRA & _BV(ADSC)) {
    }
    analog_[i] = ADC;
  }
  converting_ = 1;

  set_sleep_mode(SLEEP_MODE_IDLE);
  wdt_enable(WDTO_120MS);
}

void MegaBoard::imu_transfer(uint8_t* bytes, uint8_t count) {
  PORTA &= ~_BV(PA0);
  for (uint8_t i = 0; i < count; ++i) {
    SPDR = bytes[i];
    while (!(SPSR & _BV(SPIF))) {
    }
    bytes[i] = SPDR;
  }
  PORTA |= _BV(PA0);
}

bool MegaBoard::i2c_write(uint8_t address, const uint8_t* bytes, uint8_t count) {
  bool good = i2c_address(address, kWriteAcknowledged);
  for (uint8_t i = 0; good && i < count; ++i) {
    TWDR = bytes[i];
    good = i2c_do(0, kSent);
  }
  return i2c_stop(good);
}

bool MegaBoard::i2c_read(uint8_t address, uint8_t* bytes, uint8_t count) {
  bool good = i2c_address(address, kReadAcknowledged);
  for (uint8_t i = 0; good && i < count; ++i) {
    const bool last = i + 1 == count;
    good = i2c_do(last ? 0 : _BV(TWEA), last ? kReceivedLast : kReceived);
    bytes[i] = TWDR;
  }
  return i2c_stop(good);
}

void MegaBoard::write_pulse_us(Actuator actuator, uint16_t width_us) {
  const PwmOutput output = output_of(actuator);
  uint16_t now = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { now = *output.counter; }
  const bool pulse_over = now > 2 * 2500U;
  if (width_us == 0) {
    if (pulse_over) *output.control &= static_cast<uint8_t>(~output.connect);
    return;
  }
  const uint16_t width = width_us > 2500 ? 2500 : width_us;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *output.compare = 2 * width - 1; }
  *output.control |= output.connect;
}

// The last result of the input; the inputs are converted in turn, one a call.
uint16_t MegaBoard::read_analog(Analog input) {
  if (!(ADCSRA & _BV(ADSC))) {
    analog_[converting_] = ADC;
    converting_ ^= 1;
    ADMUX = _BV(REFS0) | (converting_ == 0 ? SHOAL_ANALOG_BATTERY_VOLTAGE : SHOAL_ANALOG_BATTERY_CURRENT);
    ADCSRA |= _BV(ADSC);
  }
  return analog_[static_cast<uint8_t>(input)];
}

void MegaBoard::write_led(bool on) {
  if (on) {
    PORTB |= _BV(PB7);
  } else {
    PORTB &= ~_BV(PB7);
  }
}

uint8_t MegaBoard::read_bytes(Port port, uint8_t* bytes, uint8_t capacity) {
  return port == Port::console ? take(console_line, bytes, capacity) : take(companion_line, bytes, capacity);
}

bool MegaBoard::write_bytes(Port port, const uint8_t* bytes, uint16_t count) {
  return port == Port::console ? give(console_line, UCSR0B, bytes, count) : give(companion_line, UCSR1B, bytes, count);
}

uint16_t MegaBoard::receive_overruns(Port port) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { return port == Port::console ? console_line.overruns : companion_line.overruns; }
  return 0;
}

uint8_t MegaBoard::eeprom_read(uint16_t address) {
  while (EECR & _BV(EEPE)) {
  }
  EEAR = address;
  EECR |= _BV(EERE);
  return EEDR;
}

bool MegaBoard::eeprom_write(uint16_t address, uint8_t value) {
  if (!eeprom_ready()) return false;
  EEAR = address;
  EEDR = value;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    EECR |= _BV(EEMPE);
    EECR |= _BV(EEPE);
  }
  return true;
}

ResetCause MegaBoard::reset_cause() {
  if (restarted_) return ResetCause::software;
  if (reset_flags & _BV(PORF)) return ResetCause::power_on;
  if (reset_flags & _BV(BORF)) return ResetCause::brown_out;
  if (reset_flags & _BV(WDRF)) return ResetCause::watchdog;
  return ResetCause::external;
}

void MegaBoard::reboot() {
  cli();
  restart_mark = kRestartMark;
  wdt_enable(WDTO_15MS);
  for (;;) {
  }
}

// Each call searches a part of the painted RAM from below, so that no call takes long; a whole search takes some 50
// calls.
uint16_t MegaBoard::free_ram() {
  const uint8_t* const stop = lowest_used_ - paint_at_ > kPaintSearched ? paint_at_ + kPaintSearched : lowest_used_;
  while (paint_at_ < stop && *paint_at_ == kPaint) ++paint_at_;
  if (paint_at_ < stop) lowest_used_ = paint_at_;
  if (paint_at_ == lowest_used_) paint_at_ = &_end;
  return static_cast<uint16_t>(lowest_used_ - &_end);
}

}  // namespace

void mega_begin() { board.begin(); }

Board& mega_board() { return board; }

void mega_wait_for_tick() {
  for (;;) {
    cli();
    if (ticks_due > 0) break;
    sleep_enable();
    sei();
    sleep_cpu();
    sleep_disable();
  }
  --ticks_due;
  sei();
}

}  // namespace shoal

ISR(TIMER1_COMPA_vect) { ++shoal::ticks_due; }

ISR(USART0_RX_vect) {
  const uint8_t status = UCSR0A;
  shoal::console_line.on_received(status, UDR0);
}

ISR(USART1_RX_vect) {
  const uint8_t status = UCSR1A;
  shoal::companion_line.on_received(status, UDR1);
}

ISR(USART0_UDRE_vect) {
  UDR0 = shoal::console_line.to_send.pop();
  if (shoal::console_line.to_send.used() == 0) UCSR0B &= static_cast<uint8_t>(~_BV(UDRIE0));
}

ISR(USART1_UDRE_vect) {
  UDR1 = shoal::companion_line.to_send.pop();
  if (shoal::companion_line.to_send.used() == 0) UCSR1B &= static_cast<uint8_t>(~_BV(UDRIE1));
}

#endif
