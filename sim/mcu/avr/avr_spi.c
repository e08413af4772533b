/* SPI in master mode with its true clock, and the IMU behind chip select. */
#include "avr_mcu.h"

_Static_assert(SHOAL_PIN_IMU_SELECT == 22, "the IMU is wired to PA0");
enum { IMU_SELECT = 0x01, SS = 0x01 };

/* Cycles of a bit (ATmega2560 datasheet, SPI, relationship between SCK and the oscillator frequency). */
static unsigned cycles_per_bit(const mcu *m) {
  static const unsigned DIVIDER[4] = {4, 16, 64, 128};
  unsigned divider = DIVIDER[m->avr->data[AVR_SPCR] & SPCR_SPR];
  return m->avr->data[AVR_SPSR] & SPSR_SPI2X ? divider / 2 : divider;
}

/* The IMU takes modes 0 and 3, most significant bit first (ICM-20948 datasheet, section 6.5). */
static bool imu_understands(uint8_t spcr) {
  uint8_t mode = spcr & SPCR_MODE;
  return !(spcr & SPCR_DORD) && (mode == 0 || mode == SPCR_MODE);
}

static avr_cycle_count_t byte_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  mcu *m = param;
  uint8_t sent = avr->data[AVR_SPDR], received = 0xFF;
  if (m->spi.imu_selected && !m->faults.imu_silent && imu_understands(avr->data[AVR_SPCR]))
    received = icm20948_exchange(&m->imu, sent, avr_now_ns(m));
  m->spi.received = received;
  m->spi.busy = m->spi.status_read = false;
  avr_set_flag(m, m->spi.vector, true);
  return 0;
}

/* Access to SPDR after SPSR was read with SPIF set clears SPIF. */
static void clear_after_status(mcu *m) {
  if (!m->spi.status_read) return;
  m->spi.status_read = false;
  m->avr->data[AVR_SPSR] &= (uint8_t)~SPSR_WCOL;
  avr_set_flag(m, m->spi.vector, false);
}

static void write_data(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  clear_after_status(m);
  if (m->spi.busy) {
    avr->data[AVR_SPSR] |= SPSR_WCOL;
    return;
  }
  avr->data[address] = value;
  uint8_t control = avr->data[AVR_SPCR];
  /* With SS an input the pin floats: the port may leave master mode at any time, so it does at once. */
  if (!(avr->data[AVR_DDRB] & SS)) avr->data[AVR_SPCR] = control &= (uint8_t)~SPCR_MSTR;
  if (!(control & SPCR_SPE) || !(control & SPCR_MSTR)) return;
  unsigned bit = cycles_per_bit(m);
  uint32_t hz = (uint32_t)(SHOAL_CPU_HZ / bit);
  if (hz > m->counters.spi_hz) m->counters.spi_hz = hz;
  m->spi.busy = true;
  avr_call_at(m, avr->cycle + 8 * bit, byte_done, m);
}

static uint8_t read_data(avr_t *avr, avr_io_addr_t address, void *param) {
  (void)avr, (void)address;
  mcu *m = param;
  clear_after_status(m);
  return m->spi.received;
}

static uint8_t read_status(avr_t *avr, avr_io_addr_t address, void *param) {
  mcu *m = param;
  if (avr->data[address] & SPSR_SPIF) m->spi.status_read = true;
  return avr->data[address];
}

static void write_status(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)param;
  avr->data[address] = (uint8_t)((avr->data[address] & ~SPSR_SPI2X) | (value & SPSR_SPI2X));
}

static void write_control(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  avr->data[address] = value;
  if ((value & SPCR_SPIE) && (avr->data[AVR_SPSR] & SPSR_SPIF)) avr_set_flag(m, m->spi.vector, true);
}

void avr_spi_pins_changed(mcu *m) {
  const uint8_t *data = m->avr->data;
  bool selected = (data[AVR_DDRA] & IMU_SELECT) && !(data[AVR_PORTA] & IMU_SELECT);
  if (selected == m->spi.imu_selected) return;
  m->spi.imu_selected = selected;
  avr_run_chips(m);
  icm20948_select(&m->imu, selected);
}

void avr_spi_attach(mcu *m) {
  avr_spi_t *stock = avr_module(m->avr, "spi", 0, 0, true);
  m->spi.vector = &stock->spi;
  avr_on_write(m, AVR_SPDR, write_data);
  avr_on_read(m, AVR_SPDR, read_data);
  avr_on_write(m, AVR_SPSR, write_status);
  avr_on_read(m, AVR_SPSR, read_status);
  avr_on_write(m, AVR_SPCR, write_control);
}

void avr_spi_restart(mcu *m) {
  m->spi.busy = m->spi.status_read = false;
  m->spi.received = 0xFF;
  avr_spi_pins_changed(m);
}
