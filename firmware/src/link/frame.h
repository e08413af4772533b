// MAVLink 2 framing: finds frames in received bytes and builds frames to send; unsigned frames of this dialect only.
#pragma once

#include <stdint.h>
#include <string.h>

#include "../board.h"
#include "dialect/constants.h"

namespace shoal {

constexpr uint8_t kFrameMarker = 0xFD;
constexpr uint8_t kHeaderLength = 10;
constexpr uint8_t kFrameOverhead = kHeaderLength + 2;
constexpr uint8_t kLongestFrame = kFrameOverhead + SHOAL_FIRMWARE_PAYLOAD_MAX;

// One received frame; valid until the next call on its reader.
struct Frame {
  uint32_t id;
  uint8_t sequence, system, component, length;
  const uint8_t* payload;

  // The payload as a generated message; bytes that the sender cut off are zeros.
  template <typename Message>
  Message as() const {
    Message message;
    memset(&message, 0, sizeof message);
    memcpy(&message, payload, length < sizeof message ? length : sizeof message);
    return message;
  }
};

// What the line lost, since reset.
struct LossCounters {
  uint16_t bad_frames;  // wrong CRC, length or flags
  uint16_t gaps;        // frames missing by their sequence numbers
};

// After a bad frame the search goes on behind its marker, so a corrupted length byte costs no frame but its own.
class FrameReader {
 public:
  // Takes one byte; when this is true call `next` until it is false.
  bool push(uint8_t byte) {
    buffer_[count_++] = byte;
    return count_ >= needed_;
  }
  bool next(Frame& frame);

  const LossCounters& losses() const { return losses_; }

 private:
  void drop(uint8_t count);
  bool wait_for(uint8_t count);
  void note_sequence(const Frame& frame);

  uint8_t buffer_[kLongestFrame] = {};
  uint8_t count_ = 0;
  uint8_t needed_ = 1;    // bytes without which nothing new can be said
  uint8_t returned_ = 0;  // bytes of the frame given out last
  LossCounters losses_ = {};
  uint8_t expected_sequence_ = 0;
  uint16_t peer_ = 0;  // system and component whose sequence is followed; 0: none yet
};

class FrameWriter {
 public:
  FrameWriter(Board& board, Port port) : board_(board), port_(port) {}

  // Queues one frame; false, and nothing sent, when the line has no room.
  bool send(uint8_t system, uint32_t id, const void* payload, uint8_t length, uint8_t crc_extra);

 private:
  Board& board_;
  Port port_;
  uint8_t sequence_ = 0;
};

// Sends a generated message through a writer: SHOAL_SEND(writer, system, HEARTBEAT, heartbeat).
#define SHOAL_SEND(writer, system, NAME, message) \
  (writer).send(system, MAVLINK_MSG_ID_##NAME, &(message), MAVLINK_MSG_ID_##NAME##_LEN, MAVLINK_MSG_ID_##NAME##_CRC)

}  // namespace shoal
