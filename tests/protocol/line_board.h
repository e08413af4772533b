// A board of which only the transmit line exists: it keeps the bytes of the last write.
#pragma once

#include <string.h>

#include "board.h"

namespace shoal {

class LineBoard final : public Board {
 public:
  uint8_t sent[300];
  uint16_t count = 0;

  bool write_bytes(Port, const uint8_t* bytes, uint16_t length) override {
    memcpy(sent, bytes, length);
    count = length;
    return true;
  }

  uint32_t micros() override { return 0; }
  void imu_transfer(uint8_t*, uint8_t) override {}
  bool i2c_write(uint8_t, const uint8_t*, uint8_t) override { return false; }
  bool i2c_read(uint8_t, uint8_t*, uint8_t) override { return false; }
  void write_pulse_us(Actuator, uint16_t) override {}
  uint16_t read_analog(Analog) override { return 0; }
  bool leak_detected() override { return false; }
  void write_led(bool) override {}
  uint8_t read_bytes(Port, uint8_t*, uint8_t) override { return 0; }
  uint16_t receive_overruns(Port) override { return 0; }
  uint8_t eeprom_read(uint16_t) override { return 0xFF; }
  bool eeprom_ready() override { return true; }
  bool eeprom_write(uint16_t, uint8_t) override { return true; }
  ResetCause reset_cause() override { return ResetCause::power_on; }
  void feed_watchdog() override {}
  void reboot() override {}
  uint16_t free_ram() override { return 0; }
};

}  // namespace shoal
