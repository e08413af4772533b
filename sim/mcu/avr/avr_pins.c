/* The wiring of single pins: IMU select and leak sensor on port A, bus lines on port D, battery on the ADC. */
#include <math.h>

#include "avr_mcu.h"

_Static_assert(SHOAL_PIN_LEAK == 23, "the leak sensor is wired to PA1");
enum { LEAK = 0x02 };

static void port_a_written(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  avr_wrapped_write *stock = address == AVR_PORTA ? &m->port_a : &m->ddr_a;
  stock->call(avr, address, value, stock->param);
  avr_spi_pins_changed(m);
}

static void port_d_written(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  avr_wrapped_write *stock = address == AVR_PORTD ? &m->port_d : &m->ddr_d;
  stock->call(avr, address, value, stock->param);
  avr_twi_pins_changed(m);
}

/* Water pulls the leak pin low; dry, it follows the pull-up, without which it floats and reads low too. */
static uint8_t read_port_a(avr_t *avr, avr_io_addr_t address, void *param) {
  mcu *m = param;
  uint8_t value = m->pin_a.call(avr, address, m->pin_a.param);
  if (avr->data[AVR_DDRA] & LEAK) return value;
  bool high = (avr->data[AVR_PORTA] & LEAK) && !m->readings.leak;
  return (uint8_t)((value & ~LEAK) | (high ? LEAK : 0));
}

static uint32_t millivolts(double volts) { return (uint32_t)lround(1000 * fmax(0, fmin(5, volts))); }

/* A conversion starts: set the voltage of the channel that it will read. */
static void conversion_starts(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  mcu *m = param;
  union {
    uint32_t value;
    avr_adc_mux_t mux;
  } input = {.value = value};
  if (input.mux.kind != ADC_MUX_SINGLE) return;
  avr_irq_t *pins = avr_io_getirq(m->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
  if (input.mux.src == SHOAL_ANALOG_BATTERY_VOLTAGE)
    avr_raise_irq(pins + input.mux.src, millivolts(m->readings.battery_v / SHOAL_BATTERY_VOLTS_PER_VOLT));
  if (input.mux.src == SHOAL_ANALOG_BATTERY_CURRENT)
    avr_raise_irq(pins + input.mux.src, millivolts(m->readings.battery_a / SHOAL_BATTERY_AMPS_PER_VOLT));
}

void avr_pins_attach(mcu *m) {
  avr_wrap_write(m, AVR_PORTA, &m->port_a, port_a_written);
  avr_wrap_write(m, AVR_DDRA, &m->ddr_a, port_a_written);
  avr_wrap_write(m, AVR_PORTD, &m->port_d, port_d_written);
  avr_wrap_write(m, AVR_DDRD, &m->ddr_d, port_d_written);
  m->pin_a.call = m->avr->io[AVR_DATA_TO_IO(AVR_PINA)].r.c;
  m->pin_a.param = m->avr->io[AVR_DATA_TO_IO(AVR_PINA)].r.param;
  avr_on_read(m, AVR_PINA, read_port_a);
  avr_irq_register_notify(avr_io_getirq(m->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), conversion_starts, m);
}
