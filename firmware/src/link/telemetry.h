// Streams to the companion: one table of messages, default intervals and senders, spread so that no tick carries many.
#pragma once

#include <stdint.h>

#include "../parts.h"
#include "frame.h"

namespace shoal {

constexpr uint8_t kStreamCount = 14;
constexpr uint32_t kFirmwareVersion = 0x00010000;  // 0.1.0, development

// type_mask of a setpoint: z, vx, vy and yaw count, everything else is ignored.
constexpr uint16_t kSetpointMask = 0x09E3;

class Telemetry {
 public:
  Telemetry(const Parts& parts, FrameWriter& writer, const FrameReader& reader);

  // Sends what is due, at most so many messages.
  void step(uint8_t at_most);

  // Has one message of the table, which AUTOPILOT_VERSION belongs to, sent as soon as possible; false when unknown.
  bool request(uint32_t id);
  static bool knows(uint32_t id);
  // Interval in us as MAV_CMD_SET_MESSAGE_INTERVAL has it: 0 default, negative off. False for an unknown message.
  bool set_interval(uint32_t id, float interval_us);
  // -1 when off, 0 when unknown.
  int32_t interval_us(uint32_t id) const;

  bool heartbeat();
  bool attitude();
  bool imu();
  bool pressure();
  bool hud();
  bool position_target();
  bool controller();
  bool servos();
  bool system_status();
  bool battery();
  bool memory();
  bool named_value();
  bool timesync();
  bool version();

 private:
  template <typename Message>
  bool write(uint32_t id, const Message& message, uint8_t length, uint8_t crc_extra) {
    return writer_.send(parts_.system(), id, &message, length, crc_extra);
  }
  static uint8_t index_of(uint32_t id);

  const Parts& parts_;
  FrameWriter& writer_;
  const FrameReader& reader_;
  uint16_t interval_[kStreamCount];  // ticks; 0: off
  uint16_t wait_[kStreamCount];      // ticks until due
  uint16_t requested_ = 0;           // bit by place in the table
  uint8_t first_ = 0;                // of the table, for a fair turn
  uint8_t named_ = 0;                // which named value is next
};

}  // namespace shoal
