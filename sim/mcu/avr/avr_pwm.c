/* Servo and ESC pulses, taken at the timers: the compare register is latched at overflow, as the real timer does. */
#include <stddef.h>

#include "avr_mcu.h"

_Static_assert(SHOAL_PIN_BOW == 5 && SHOAL_PIN_STERN == 2 && SHOAL_PIN_MOTOR == 6,
               "pulses are wired to OC3A, OC3B and OC4A");

enum {
  OVERFLOW_LATENESS = 32
}; /* an overflow is told at the end of the instruction or interrupt entry that it fell into */
static const avr_cycle_count_t SILENCE = SHOAL_CPU_HZ / 20; /* 50 ms */

static void close_pulse(mcu_pwm *p, avr_cycle_count_t now) {
  if (!p->width || now < p->rise + p->width) return;
  p->complete = p->width;
  p->end = p->rise + p->width;
  p->width = 0;
}

/* The compare output changed. simavr repeats the rise in mid-period whenever a compare register is written, so only one
 * at an overflow counts. */
static void output_changed(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  mcu_pwm *p = param;
  avr_t *avr = p->timer->io.avr;
  avr_cycle_count_t overflow = p->timer->tov_base;
  if (!(value & 1) || overflow == p->rise || avr->cycle > overflow + OVERFLOW_LATENESS) return;
  close_pulse(p, avr->cycle);
  p->rise = overflow;
  p->width = 0;
  bool is_output = avr->data[p->ddr] & p->ddr_mask;
  if (!is_output || p->timer->wgm_op_mode_kind != avr_timer_wgm_fast_pwm) return;
  const avr_timer_comp_t *comp = &p->timer->comp[p->channel];
  unsigned ocr = avr->data[comp->r_ocr] | (unsigned)avr->data[comp->r_ocrh] << 8;
  if (ocr < p->timer->tov_top) p->width = (avr_cycle_count_t)(ocr + 1) * p->timer->cs_div_value;
}

/* A pin that is taken from its timer during a pulse falls to its port's level: the pulse ends early. */
static void control_written(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  avr_wrapped_write *stock = address == AVR_TCCR3A ? &m->tccr3a : &m->tccr4a;
  stock->call(avr, address, value, stock->param);
  for (int i = 0; i < MCU_ACTUATORS; ++i) {
    mcu_pwm *p = &m->pwm[i];
    bool connected = avr_regbit_get(avr, p->timer->comp[p->channel].com);
    if (!connected && p->width && avr->cycle < p->rise + p->width) p->width = avr->cycle - p->rise;
  }
}

static void attach(mcu *m, int actuator, char timer, int channel, uint16_t ddr, uint8_t ddr_mask) {
  mcu_pwm *p = &m->pwm[actuator];
  p->timer = avr_module(m->avr, "timer", offsetof(avr_timer_t, name), timer, false);
  p->channel = channel;
  p->ddr = ddr;
  p->ddr_mask = ddr_mask;
  avr_irq_register_notify(p->timer->io.irq + TIMER_IRQ_OUT_COMP + channel, output_changed, p);
}

/* simavr lacks the phase-correct modes with a fixed top and overflows a timer in one of them at every count; the
 * Arduino core starts all timers in the first. They need no edges here, only a period of the right order. */
static void fill_in_phase_correct_modes(avr_t *avr) {
  for (char name = '0'; name <= '5'; ++name) {
    avr_timer_t *timer = avr_module(avr, "timer", offsetof(avr_timer_t, name), name, false);
    for (unsigned mode = 1; timer && mode <= 3; ++mode)
      if (timer->wgm_op[mode].kind == avr_timer_wgm_none)
        timer->wgm_op[mode] = (avr_timer_wgm_t){.kind = avr_timer_wgm_fc_pwm, .size = 7 + mode};
  }
}

void avr_pwm_attach(mcu *m) {
  fill_in_phase_correct_modes(m->avr);
  avr_wrap_write(m, AVR_TCCR3A, &m->tccr3a, control_written);
  avr_wrap_write(m, AVR_TCCR4A, &m->tccr4a, control_written);
  attach(m, MCU_BOW, '3', AVR_TIMER_COMPA, AVR_DDRE, 1 << 3);
  attach(m, MCU_STERN, '3', AVR_TIMER_COMPB, AVR_DDRE, 1 << 4);
  attach(m, MCU_MOTOR, '4', AVR_TIMER_COMPA, AVR_DDRH, 1 << 3);
}

/* A reset ends the pulse that was under way. */
void avr_pwm_restart(mcu *m) {
  for (int i = 0; i < MCU_ACTUATORS; ++i) {
    close_pulse(&m->pwm[i], m->avr->cycle);
    m->pwm[i].width = 0;
    m->pwm[i].rise = m->avr->cycle;
  }
}

double mcu_pulse_us(const mcu *m, int actuator) {
  mcu_pwm p = m->pwm[actuator];
  close_pulse(&p, m->target);
  if (!p.complete || m->target > p.end + SILENCE) return 0;
  return (double)p.complete / (SHOAL_CPU_HZ / 1000000);
}
