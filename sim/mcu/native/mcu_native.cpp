// The `native` make of the microcontroller: the firmware's own sources, ticked by simulated time.
#include <cstdio>
#include <new>

#include "../../../firmware/src/vehicle.h"
#include "board_native.h"

using shoal::ResetCause;
using shoal_sim::NativeBoard;

namespace {

constexpr uint64_t kTickNs = 10000000;

}  // namespace

struct mcu {
  explicit mcu(const mcu_config& config) : board(config) {}

  // Goes into reset: the firmware's memory is lost.
  void enter_reset(ResetCause why) {
    cause = why;
    if (vehicle) vehicle->~Vehicle();
    vehicle = nullptr;
    board.reset(cause);
    next_event_ns = board.now_ns() + MCU_START_UP_US * 1000ull;
  }

  // The program starts.
  void start() {
    board.run_until(next_event_ns);
    board.reset(cause);
    vehicle = new (memory) shoal::Vehicle(board);
    vehicle->begin();
    next_event_ns += kTickNs;
  }

  // A tick that is late begins as soon as the one before has ended.
  void tick() {
    board.run_until(next_event_ns);
    next_event_ns += kTickNs;
    if (board.watchdog_bites()) {
      ++board.counters.resets;
      enter_reset(board.rebooting() ? ResetCause::software : ResetCause::watchdog);
    } else if (!board.rebooting()) {
      vehicle->tick();
    }
  }

  NativeBoard board;
  uint64_t next_event_ns = 0;  // a tick, or the end of a reset
  uint64_t time_ns = 0;
  ResetCause cause = ResetCause::power_on;
  shoal::Vehicle* vehicle = nullptr;  // none in reset
  alignas(shoal::Vehicle) unsigned char memory[sizeof(shoal::Vehicle)] = {};
};

mcu* mcu_create(const mcu_config* config, char* error, size_t error_size) {
  mcu* m = new (std::nothrow) mcu(*config);
  if (!m) {
    std::snprintf(error, error_size, "no memory for a microcontroller");
    return nullptr;
  }
  m->board.power_on();
  m->enter_reset(ResetCause::power_on);
  return m;
}

void mcu_destroy(mcu* m) { delete m; }

int mcu_run_until(mcu* m, uint64_t time_us) {
  m->time_ns = time_us * 1000;
  while (m->next_event_ns < m->time_ns) {
    if (m->vehicle) {
      m->tick();
    } else {
      m->start();
    }
  }
  m->board.run_until(m->time_ns);
  return 0;
}

const char* mcu_failure(const mcu*) { return ""; }
mcu_readings* mcu_get_readings(mcu* m) { return &m->board.readings; }
mcu_faults* mcu_get_faults(mcu* m) { return &m->board.faults; }
const mcu_counters* mcu_get_counters(const mcu* m) { return &m->board.counters; }

double mcu_pulse_us(const mcu* m, int actuator) { return m->board.pulses[actuator].last_us(m->time_ns); }

size_t mcu_uart_write(mcu* m, int port, const uint8_t* bytes, size_t count, uint64_t not_before_us) {
  const uint64_t start = not_before_us * 1000;
  return m->board.ports[port].host_write(bytes, count, start > m->time_ns ? start : m->time_ns);
}

size_t mcu_uart_read(mcu* m, int port, uint8_t* bytes, size_t capacity) {
  return m->board.ports[port].host_read(bytes, capacity, m->time_ns);
}

void mcu_eeprom_read(const mcu* m, uint8_t bytes[MCU_EEPROM_BYTES]) {
  for (int i = 0; i < MCU_EEPROM_BYTES; ++i) bytes[i] = m->board.eeprom[i];
}

void mcu_power_cycle(mcu* m) {
  m->board.cut_power();
  ++m->board.counters.resets;
  m->board.power_on();
  m->enter_reset(ResetCause::power_on);
}
