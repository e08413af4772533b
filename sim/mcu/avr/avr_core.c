/* One vehicle's ATmega2560 in simavr: making, running to an absolute cycle, resets, failures. */
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_mcu.h"

enum { RUN_CYCLE_LIMIT = 100000, INTERRUPT_ENTRY_CYCLES = 5, SUPPLY_MV = 5000 };
enum { CYCLES_PER_US = SHOAL_CPU_HZ / 1000000 };

static void discard_log(avr_t *avr, const int level, const char *format, va_list arguments) {
  (void)avr, (void)level, (void)format, (void)arguments;
}

static void silence_log(void) { avr_global_logger_set(discard_log); }

void *avr_module(avr_t *avr, const char *kind, size_t name_offset, char name, bool replace) {
  for (avr_io_t *io = avr->io_port; io; io = io->next) {
    if (strcmp(io->kind, kind) != 0) continue;
    if (name && *((const char *)io + name_offset) != name) continue;
    if (replace) io->reset = NULL;
    return io;
  }
  return NULL;
}

void avr_on_write(mcu *m, uint16_t address, avr_io_write_t call) {
  m->avr->io[AVR_DATA_TO_IO(address)].w.c = call;
  m->avr->io[AVR_DATA_TO_IO(address)].w.param = m;
}

void avr_on_read(mcu *m, uint16_t address, avr_io_read_t call) {
  m->avr->io[AVR_DATA_TO_IO(address)].r.c = call;
  m->avr->io[AVR_DATA_TO_IO(address)].r.param = m;
}

void avr_wrap_write(mcu *m, uint16_t address, avr_wrapped_write *stock, avr_io_write_t call) {
  stock->call = m->avr->io[AVR_DATA_TO_IO(address)].w.c;
  stock->param = m->avr->io[AVR_DATA_TO_IO(address)].w.param;
  avr_on_write(m, address, call);
}

void avr_call_at(mcu *m, avr_cycle_count_t cycle, avr_cycle_timer_t call, void *param) {
  avr_cycle_count_t now = m->avr->cycle;
  avr_cycle_timer_register(m->avr, cycle > now ? cycle - now : 0, call, param);
}

/* Whether simavr's queue still holds an entry of this vector whose flag was cleared since. */
static bool in_queue(const avr_t *avr, const avr_int_vector_t *vector) {
  const avr_int_pending_t *queue = &avr->interrupts.pending;
  for (unsigned i = queue->read; i != queue->write; i = (i + 1) % avr_int_pending_fifo_size)
    if (queue->buffer[i] == vector) return true;
  return false;
}

void avr_set_flag(mcu *m, avr_int_vector_t *vector, bool raised) {
  avr_t *avr = m->avr;
  if (!raised) {
    vector->pending = 0;
    if (vector->raised.reg) avr_regbit_clear(avr, vector->raised);
  } else if (!vector->pending && avr_regbit_get(avr, vector->enable) && in_queue(avr, vector)) {
    if (vector->raised.reg) avr_regbit_set(avr, vector->raised);
    vector->pending = 1;
    if (avr->sreg[S_I] && avr->interrupt_state == 0) avr->interrupt_state = 1;
    if (avr->state == cpu_Sleeping) avr->state = cpu_Running;
  } else {
    avr_raise_interrupt(avr, vector);
  }
}

void avr_run_chips(mcu *m) {
  m->imu.frozen = m->faults.imu_frozen != 0;
  icm20948_run_until(&m->imu, &m->readings, avr_now_ns(m));
  ms5837_run_until(&m->depth, &m->readings, avr_now_ns(m));
}

/* Does nothing but end a stretch of instructions, or a sleep, at the end of the run. */
static avr_cycle_count_t end_of_run(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr, (void)when, (void)param;
  return 0;
}

/* One stretch of instructions or sleep. Unlike simavr's own, a sleep ends exactly at the next event, so that the
 * slicing of runs leaves no trace. */
static void run_stretch(avr_t *avr) {
  mcu *m = avr->custom.data;
  avr_flashaddr_t pc = avr->pc;
  if (avr->state == cpu_Running) pc = avr_run_one(avr);
  if (avr->state == cpu_Sleeping && !(avr->data[AVR_SMCR] & SMCR_SE)) avr->state = cpu_Running;
  avr_cycle_count_t wait = avr_cycle_timer_process(avr);
  avr->pc = pc;
  if (avr->state == cpu_Sleeping) {
    if (!avr->sreg[S_I] || (avr->data[AVR_SMCR] & SMCR_SM)) {
      avr->state = cpu_Done;
      return;
    }
    avr->cycle += wait;
    m->counters.cycles_asleep += wait;
  }
  if ((avr->state == cpu_Running || avr->state == cpu_Sleeping) && avr->interrupt_state) avr_service_interrupts(avr);
}

/* simavr enters interrupts in no time; the ATmega2560 needs five cycles (datasheet, "Interrupt Response Time"). */
static void interrupt_entered(avr_irq_t *irq, uint32_t vector, void *param) {
  (void)irq;
  avr_t *avr = ((mcu *)param)->avr;
  if (!vector) return;
  avr->cycle += INTERRUPT_ENTRY_CYCLES;
  avr->run_cycle_count =
      avr->run_cycle_count > INTERRUPT_ENTRY_CYCLES ? avr->run_cycle_count - INTERRUPT_ENTRY_CYCLES : 1;
}

/* Every reset wiped simavr's timers and registers: put ours back. */
static void restart_parts(mcu *m) {
  m->avr->run_cycle_limit = RUN_CYCLE_LIMIT;
  /* simavr polls a low pin of an external interrupt every cycle, enabled or not; the stern servo's is one. */
  for (uint8_t i = 0; i < EXTINT_COUNT; ++i) avr_extint_set_strict_lvl_trig(m->avr, i, 0);
  avr_spi_restart(m);
  avr_twi_restart(m);
  avr_uart_restart(m);
  avr_pwm_restart(m);
  avr_eeprom_restart(m);
  avr_call_at(m, m->target, end_of_run, m);
  m->start = m->avr->cycle + MCU_START_UP_US * CYCLES_PER_US;
}

/* Time passes in reset, without instructions. At its end the watchdog, which simavr started with the reset, starts
 * anew, and what happened meanwhile is told to a program that was not there. */
static void wait_in_reset(mcu *m) {
  avr_t *avr = m->avr;
  bool starts = m->start <= m->target;
  avr->cycle = starts ? m->start : m->target;
  if (!starts) return;
  avr_ioctl(avr, AVR_IOCTL_WATCHDOG_RESET, NULL);
  avr_cycle_timer_process(avr);
}

static void on_reset(avr_io_t *part) {
  mcu *m = part->avr->custom.data;
  m->counters.resets++;
  restart_parts(m);
}

/* Power comes on: memory holds noise, the reset flags say power-on. */
static void power_on(mcu *m) {
  avr_t *avr = m->avr;
  uint64_t random = m->seed + 0x51A3u * ++m->power_ups;
  for (uint32_t i = 0; i <= avr->ramend; ++i)
    if (i < 32 || i > avr->ioend) avr->data[i] = (uint8_t)line_random(&random);
  avr->run = run_stretch;
  avr_reset(avr);
  avr_regbit_set(avr, avr->reset_flags.porf);
  m->failure[0] = 0;
  icm20948_power_on(&m->imu, avr_now_ns(m));
  ms5837_power_on(&m->depth, avr_now_ns(m));
}

static void attach_parts(mcu *m, const mcu_config *config) {
  avr_spi_attach(m);
  avr_twi_attach(m);
  avr_uart_attach(m, config);
  avr_pwm_attach(m);
  avr_eeprom_attach(m);
  avr_pins_attach(m);
  avr_irq_register_notify(m->avr->interrupts.irq + AVR_INT_IRQ_RUNNING, interrupt_entered, m);
  /* Last in the list of modules, so that every other module was reset before. */
  m->part = (avr_io_t){.avr = m->avr, .kind = "vehicle", .reset = on_reset};
  avr_io_t **end = &m->avr->io_port;
  while (*end) end = &(*end)->next;
  *end = &m->part;
}

mcu *mcu_create(const mcu_config *config, char *error, size_t error_size) {
  static pthread_once_t once = PTHREAD_ONCE_INIT;
  pthread_once(&once, silence_log);
  mcu *m = calloc(1, sizeof *m);
  avr_t *avr = avr_make_mcu_by_name("atmega2560");
  if (!m || !avr) {
    snprintf(error, error_size, "no memory for a microcontroller");
    free(m);
    free(avr);
    return NULL;
  }
  m->avr = avr;
  m->seed = config->seed;
  m->bus_random = config->seed ^ 0xB05u;
  avr_init(avr);
  avr->custom.data = m;
  avr->log = LOG_NONE;
  avr->frequency = SHOAL_CPU_HZ;
  avr->vcc = avr->avcc = avr->aref = SUPPLY_MV;
  attach_parts(m, config);
  if (!avr_load_image(m, config->image, error, error_size)) {
    mcu_destroy(m);
    return NULL;
  }
  if (config->eeprom) memcpy(m->eeprom.store->eeprom, config->eeprom, MCU_EEPROM_BYTES);
  power_on(m);
  m->counters.resets = 0;
  return m;
}

void mcu_destroy(mcu *m) {
  if (!m) return;
  avr_terminate(m->avr);
  free(m->avr);
  avr_free_symbols(m);
  free(m);
}

static int fail(mcu *m) {
  char place[100];
  avr_describe(m, m->avr->pc, place, sizeof place);
  bool slept = m->avr->state == cpu_Done;
  const char *cause = !slept              ? "ran out of program or into an invalid opcode"
                      : m->avr->sreg[S_I] ? "slept deeper than idle, which stops the timers"
                                          : "slept with interrupts off";
  snprintf(m->failure, sizeof m->failure, "firmware %s at %s, cycle %llu", cause, place,
           (unsigned long long)m->avr->cycle);
  return -1;
}

int mcu_run_until(mcu *m, uint64_t time_us) {
  if (m->failure[0]) return -1;
  avr_t *avr = m->avr;
  m->target = time_us * CYCLES_PER_US;
  if (avr->cycle < m->target) avr_call_at(m, m->target, end_of_run, m);
  while (avr->cycle < m->target) {
    if (avr->cycle < m->start)
      wait_in_reset(m);
    else
      avr->run(avr);
    if (avr->state == cpu_Done || avr->state == cpu_Crashed) return fail(m);
  }
  avr_run_chips(m);
  m->counters.cycles = avr->cycle;
  return 0;
}

const char *mcu_failure(const mcu *m) { return m->failure; }
mcu_readings *mcu_get_readings(mcu *m) { return &m->readings; }
mcu_faults *mcu_get_faults(mcu *m) { return &m->faults; }
const mcu_counters *mcu_get_counters(const mcu *m) { return &m->counters; }

void mcu_power_cycle(mcu *m) {
  avr_eeprom_cut(m);
  power_on(m);
}
