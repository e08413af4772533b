// The one small interface between the vehicle and its hardware; one file a board stands behind it.
#pragma once

#include <stdint.h>

namespace shoal {

enum class Port : uint8_t { console = 0, companion = 1 };
enum class Actuator : uint8_t { bow = 0, stern = 1, motor = 2 };
enum class Analog : uint8_t { battery_voltage = 0, battery_current = 1 };
enum class ResetCause : uint8_t { power_on, external, brown_out, watchdog, software };

// Every call returns within a bounded time: a bus that is held or silent is an answer, never a hang.
class Board {
 public:
  // Microseconds since reset; wraps after 71.6 minutes.
  virtual uint32_t micros() = 0;

  // Exchanges `count` bytes in place with the IMU selected, at no more than 400 kbit/s.
  virtual void imu_transfer(uint8_t* bytes, uint8_t count) = 0;

  // I2C at 200 kHz; false on a missing acknowledge, a held bus or a timeout.
  virtual bool i2c_write(uint8_t address, const uint8_t* bytes, uint8_t count) = 0;
  virtual bool i2c_read(uint8_t address, uint8_t* bytes, uint8_t count) = 0;

  // Pulse width from the next 20 ms period on; 0 ends the pulses.
  virtual void write_pulse_us(Actuator actuator, uint16_t width_us) = 0;

  // 10 bits of a 5 V reference.
  virtual uint16_t read_analog(Analog input) = 0;
  virtual bool leak_detected() = 0;
  virtual void write_led(bool on) = 0;

  // Takes the oldest received bytes, at most `capacity`; returns how many.
  virtual uint8_t read_bytes(Port port, uint8_t* bytes, uint8_t capacity) = 0;
  // Queues all bytes and returns true, or none and false when the transmit ring has no room.
  virtual bool write_bytes(Port port, const uint8_t* bytes, uint16_t count) = 0;
  // Bytes lost since reset to a full ring or a hardware overrun.
  virtual uint16_t receive_overruns(Port port) = 0;

  virtual uint8_t eeprom_read(uint16_t address) = 0;
  // A byte takes 3.4 ms to write; a write while not ready is refused.
  virtual bool eeprom_ready() = 0;
  virtual bool eeprom_write(uint16_t address, uint8_t value) = 0;

  virtual ResetCause reset_cause() = 0;
  virtual void feed_watchdog() = 0;
  // Restarts the microcontroller through the watchdog; the reset cause is then `software`.
  virtual void reboot() = 0;
  // Bytes between heap and stack that were never used since reset.
  virtual uint16_t free_ram() = 0;

 protected:
  ~Board() = default;
};

}  // namespace shoal
