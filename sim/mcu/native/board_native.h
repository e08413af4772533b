// The board's interface over the simulated chips, without a processor: what `avr` gets from registers, this gets from
// calls, each of which takes the time that the bus would.
#pragma once

#include <stdint.h>

#include "../../../firmware/src/board.h"
#include "../../../firmware/src/pins.h"
#include "../chips/icm20948.h"
#include "../chips/ms5837.h"
#include "../eeprom_cell.h"
#include "../line.h"
#include "../mcu.h"

namespace shoal_sim {

// A servo or ESC output: a pulse begins every 20 ms, and a new width counts from the next one on.
class Pulses {
 public:
  void restart(uint64_t now_ns);
  void set_width_us(uint16_t width_us, uint64_t now_ns);
  // Width of the last complete pulse, microseconds; 0 when none ended within the last 50 ms.
  double last_us(uint64_t now_ns) const;

 private:
  void run_until(uint64_t now_ns);

  uint64_t next_rise_ns_ = 0;
  uint64_t open_since_ns_ = 0;
  uint64_t open_width_ns_ = 0;
  uint64_t ended_ns_ = 0;
  uint64_t ended_width_ns_ = 0;
  uint64_t width_ns_ = 0;
};

// A serial port as the firmware's interrupts would run it: a receive ring, a transmit ring, and both ends of the line.
class SerialPort {
 public:
  SerialPort(uint64_t seed, unsigned number, uint32_t host_baud, uint32_t own_baud, unsigned receive_ring,
             unsigned transmit_ring);
  void restart(uint64_t now_ns);
  int16_t read_byte(uint64_t now_ns, double noise, bool cut, mcu_counters* counters);
  bool write_bytes(const uint8_t* bytes, uint16_t count, uint64_t now_ns, double noise, bool cut,
                   mcu_counters* counters);
  uint16_t overruns() const { return overruns_; }

  size_t host_write(const uint8_t* bytes, size_t count, uint64_t start_ns);
  size_t host_read(uint8_t* bytes, size_t capacity, uint64_t now_ns);
  // Moves what has arrived into the receive ring; call before time passes it by.
  void run_until(uint64_t now_ns, double noise, bool cut, mcu_counters* counters);

 private:
  line to_mcu_;
  line to_host_;
  double host_bit_ns_;
  double own_bit_ns_;
  uint8_t ring_[256] = {};
  unsigned ring_size_, transmit_size_;
  unsigned head_ = 0, used_ = 0;
  uint16_t overruns_ = 0;
};

class NativeBoard final : public shoal::Board {
 public:
  explicit NativeBoard(const mcu_config& config);

  // What the world reads and sets.
  mcu_readings readings = {};
  mcu_faults faults = {};
  mcu_counters counters = {};
  uint8_t eeprom[MCU_EEPROM_BYTES];
  Pulses pulses[MCU_ACTUATORS];
  SerialPort ports[2];

  // Chips and lines up to this instant, which becomes the present unless it is past already.
  void run_until(uint64_t now_ns);
  uint64_t now_ns() const { return now_ns_; }
  // Power reaches the chips, or leaves them.
  void power_on();
  void cut_power();
  // The processor goes into reset, or starts from it; chips keep their state.
  void reset(shoal::ResetCause cause);
  bool watchdog_bites() const { return now_ns_ >= bites_ns_; }
  bool rebooting() const { return rebooting_; }

  uint32_t micros() override;
  void imu_transfer(uint8_t* bytes, uint8_t count) override;
  bool i2c_write(uint8_t address, const uint8_t* bytes, uint8_t count) override;
  bool i2c_read(uint8_t address, uint8_t* bytes, uint8_t count) override;
  void write_pulse_us(shoal::Actuator actuator, uint16_t width_us) override;
  uint16_t read_analog(shoal::Analog input) override;
  bool leak_detected() override { return readings.leak != 0; }
  void write_led(bool) override {}
  uint8_t read_bytes(shoal::Port port, uint8_t* bytes, uint8_t capacity) override;
  bool write_bytes(shoal::Port port, const uint8_t* bytes, uint16_t count) override;
  uint16_t receive_overruns(shoal::Port port) override { return port_of(port).overruns(); }
  uint8_t eeprom_read(uint16_t address) override;
  bool eeprom_ready() override { return change_.what == 0; }
  bool eeprom_write(uint16_t address, uint8_t value) override;
  shoal::ResetCause reset_cause() override { return cause_; }
  void feed_watchdog() override;
  void reboot() override;
  uint16_t free_ram() override { return UINT16_MAX; }  // the host's memory says nothing about the ATmega2560's

 private:
  SerialPort& port_of(shoal::Port port) { return ports[static_cast<unsigned>(port)]; }
  double noise(shoal::Port port) const { return port == shoal::Port::companion ? faults.companion_bit_noise : 0; }
  bool cut(shoal::Port port) const { return port == shoal::Port::companion && faults.companion_cut; }
  bool i2c_start(uint8_t address, unsigned bytes);

  icm20948 imu_;
  ms5837 depth_;
  eeprom_change change_ = {};
  uint64_t random_;
  uint64_t now_ns_ = 0;
  uint64_t started_ns_ = 0;  // the last reset
  uint64_t bites_ns_ = 0;    // when the watchdog will reset the processor
  bool rebooting_ = false;
  shoal::ResetCause cause_ = shoal::ResetCause::power_on;
};

}  // namespace shoal_sim
