/* A small ATmega2560 program that does to the hardware what the companion's line asks for: every test speaks to it.
 * Request: a letter, a count, that many bytes. Answer: the letter, a count, that many bytes. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/delay.h>

static volatile uint8_t ring[256];
static volatile uint8_t ring_head, ring_tail;
static volatile uint8_t overrun_seen, frame_errors;
static uint8_t reset_flags __attribute__((section(".noinit")));
static uint8_t survivor __attribute__((section(".noinit")));

void keep_reset_flags(void) __attribute__((naked, used, section(".init3")));
void keep_reset_flags(void) {
  reset_flags = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

ISR(USART1_RX_vect) {
  uint8_t status = UCSR1A;
  ring[ring_head++] = UDR1;
  if (status & _BV(DOR1)) overrun_seen = 1;
  if (status & _BV(FE1)) frame_errors++;
}

ISR(TIMER1_COMPA_vect) {}

static uint8_t receive(void) {
  set_sleep_mode(SLEEP_MODE_IDLE);
  for (;;) {
    cli();
    if (ring_tail != ring_head) break;
    sleep_enable();
    sei();
    sleep_cpu();
  }
  sei();
  return ring[ring_tail++];
}

static void send(uint8_t byte) {
  while (!(UCSR1A & _BV(UDRE1))) {
  }
  UDR1 = byte;
}

static void answer(uint8_t letter, const uint8_t *bytes, uint8_t count) {
  send(letter);
  send(count);
  for (uint8_t i = 0; i < count; ++i) send(bytes[i]);
}

/* The bytes through SPI at 250 kbit/s with the IMU selected, replaced by what came back. */
static void spi(uint8_t *bytes, uint8_t count) {
  PORTA &= ~_BV(PA0);
  for (uint8_t i = 0; i < count; ++i) {
    SPDR = bytes[i];
    while (!(SPSR & _BV(SPIF))) {
    }
    bytes[i] = SPDR;
  }
  PORTA |= _BV(PA0);
}

/* Waits for the bus at most 2 ms; the status, or 0xFF. */
static uint8_t twi(uint8_t control) {
  TWCR = _BV(TWINT) | _BV(TWEN) | control;
  for (uint8_t i = 0; i < 200; ++i) {
    if (TWCR & _BV(TWINT)) return TWSR & 0xF8;
    _delay_us(10);
  }
  TWCR = 0;
  return 0xFF;
}

/* First byte: address and direction; then bytes to write, or room for bytes to read. Answers the last status first. */
static void i2c(uint8_t *bytes, uint8_t count) {
  uint8_t status = twi(_BV(TWSTA));
  if (status == 0x08) {
    TWDR = bytes[0];
    status = twi(0);
  }
  for (uint8_t i = 1; i < count && (status == 0x18 || status == 0x28); ++i) {
    TWDR = bytes[i];
    status = twi(0);
  }
  for (uint8_t i = 1; i < count && (status == 0x40 || status == 0x50); ++i) {
    status = twi(i + 1 < count ? _BV(TWEA) : 0);
    bytes[i] = TWDR;
  }
  if (status != 0xFF) TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
  bytes[0] = status;
}

/* Nine clocks on SCL by hand; answers whether SDA is high before and after. */
static void clock_bus_free(uint8_t *bytes) {
  TWCR = 0;
  bytes[0] = !!(PIND & _BV(PD1));
  for (uint8_t i = 0; i < 9; ++i) {
    DDRD |= _BV(PD0);
    _delay_us(5);
    DDRD &= ~_BV(PD0);
    _delay_us(5);
  }
  bytes[1] = !!(PIND & _BV(PD1));
}

static void start_pwm(void) {
  DDRE |= _BV(PE3) | _BV(PE4);
  DDRH |= _BV(PH3);
  ICR3 = ICR4 = 39999;
  TCCR3A = _BV(COM3A1) | _BV(COM3B1) | _BV(WGM31);
  TCCR4A = _BV(COM4A1) | _BV(WGM41);
  TCCR3B = _BV(WGM33) | _BV(WGM32) | _BV(CS31);
  TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS41);
}

static uint16_t analog(uint8_t channel) {
  ADMUX = _BV(REFS0) | channel;
  ADCSRA = _BV(ADEN) | _BV(ADSC) | 7;
  while (ADCSRA & _BV(ADSC)) {
  }
  return ADC;
}

static void pause_ms(uint8_t ms) {
  while (ms--) _delay_ms(1);
}

int main(void) {
  DDRA = PORTA = _BV(PA0);
  PORTA |= _BV(PA1);
  DDRB = _BV(PB0) | _BV(PB1) | _BV(PB2);
  SPCR = _BV(SPE) | _BV(MSTR) | _BV(SPR1);
  TWBR = 32;
  UCSR1A = _BV(U2X1);
  UBRR1 = 16;
  UCSR1B = _BV(RXEN1) | _BV(TXEN1) | _BV(RXCIE1);
  sei();
  for (;;) {
    static uint8_t bytes[64];
    uint8_t letter = receive(), count = receive() & 63;
    for (uint8_t i = 0; i < count; ++i) bytes[i] = receive();
    uint16_t word = bytes[0] | bytes[1] << 8;
    switch (letter) {
      case 's':
        spi(bytes, count);
        break;
      case 'i':
        i2c(bytes, count);
        break;
      case 'c':
        clock_bus_free(bytes), count = 2;
        break;
      case 'P':
        start_pwm();
        break;
      case 'p':
        *(bytes[2] == 0 ? &OCR3A : bytes[2] == 1 ? &OCR3B : &OCR4A) = word;
        break;
      case 'q': /* disconnect timer 3 a while after its period has begun, in tenths of a millisecond */
        while (TCNT3 > 100) {
        }
        while (TCNT3 < 200 * bytes[0]) {
        }
        TCCR3A = _BV(WGM31);
        break;
      case 'A':
        word = analog(bytes[0]), bytes[0] = word & 255, bytes[1] = word >> 8, count = 2;
        break;
      case 'l':
        bytes[0] = !!(PINA & _BV(PA1)), count = 1;
        break;
      case 'e': /* address, value; answers how many milliseconds the write took, in tenths */
        eeprom_write_byte((uint8_t *)word, bytes[2]);
        bytes[0] = 0, count = 1;
        while (!eeprom_is_ready()) _delay_us(100), bytes[0]++;
        break;
      case 'E':
        bytes[0] = eeprom_read_byte((uint8_t *)word), count = 1;
        break;
      case 'o': /* interrupts off for some milliseconds */
        answer('o', bytes, 0);
        cli();
        pause_ms(bytes[0]);
        sei();
        continue;
      case 'O':
        bytes[0] = overrun_seen, bytes[1] = frame_errors, count = 2, overrun_seen = frame_errors = 0;
        break;
      case 'b': /* busy for some milliseconds */
        pause_ms(bytes[0]);
        break;
      case 'm':
        bytes[1] = reset_flags, bytes[2] = survivor, survivor = bytes[0], count = 3;
        break;
      case 'W': /* hang until the watchdog bites */
        wdt_enable(WDTO_120MS);
        for (;;) {
        }
      case 'X': /* run off into erased memory */
        ((void (*)(void))0x1F000)();
        break;
      case 'Z': /* sleep for ever */
        cli();
        sleep_enable();
        sleep_cpu();
        break;
      case 'D':
        set_sleep_mode(SLEEP_MODE_PWR_DOWN);
        sleep_enable();
        sleep_cpu();
        break;
      default:
        break;
    }
    answer(letter, bytes, count);
  }
}
