// Frame search, CRC with the message's extra byte, and the trimming of trailing zeros on sending.
#ifdef __AVR__
#pragma GCC optimize("O2")  // runs in every tick
#endif

#include "frame.h"

#include "../crc.h"
#include "mavlink.h"

namespace shoal {
namespace {

uint16_t crc_over(uint16_t crc, const uint8_t* bytes, uint8_t count) {
  for (uint8_t i = 0; i < count; ++i) crc = crc_update(crc, bytes[i]);
  return crc;
}

uint32_t id_of(const uint8_t* frame) {
  return frame[7] | static_cast<uint32_t>(frame[8]) << 8 | static_cast<uint32_t>(frame[9]) << 16;
}

// Whether the message is of this dialect and length and CRC are its own; the CRC stands at `end`.
bool valid(const uint8_t* frame, uint8_t end) {
  const mavlink_msg_entry_t* entry = mavlink_get_msg_entry(id_of(frame));
  if (entry == nullptr || frame[1] > entry->max_msg_len) return false;
  const uint16_t crc = crc_update(crc_over(kCrcStart, frame + 1, end - 1), entry->crc_extra);
  return crc == (frame[end] | static_cast<uint16_t>(frame[end + 1]) << 8);
}

}  // namespace

void FrameReader::drop(uint8_t count) {
  if (count == 0) return;
  count_ -= count;
  memmove(buffer_, buffer_ + count, count_);
}

bool FrameReader::wait_for(uint8_t count) {
  needed_ = count;
  return false;
}

bool FrameReader::next(Frame& frame) {
  drop(returned_);
  returned_ = 0;
  while (count_ > 0) {
    if (buffer_[0] != kFrameMarker) {
      const void* marker = memchr(buffer_, kFrameMarker, count_);
      drop(marker ? static_cast<uint8_t>(static_cast<const uint8_t*>(marker) - buffer_) : count_);
      continue;
    }
    if (count_ < 3) return wait_for(3);
    const uint8_t length = buffer_[1];
    const uint8_t incompatible_flags = buffer_[2];
    if (length > 0 && length <= SHOAL_FIRMWARE_PAYLOAD_MAX && incompatible_flags == 0) {
      const uint8_t end = kHeaderLength + length;
      if (count_ < end + 2) return wait_for(end + 2);
      if (valid(buffer_, end)) {
        frame = {id_of(buffer_), buffer_[4], buffer_[5], buffer_[6], length, buffer_ + kHeaderLength};
        returned_ = end + 2;
        note_sequence(frame);
        return true;
      }
    }
    ++losses_.bad_frames;
    drop(1);
  }
  return wait_for(1);
}

// Counts the frames missing between two of the same sender.
void FrameReader::note_sequence(const Frame& frame) {
  const uint16_t peer = static_cast<uint16_t>(frame.system << 8 | frame.component);
  if (peer == peer_) losses_.gaps += static_cast<uint8_t>(frame.sequence - expected_sequence_);
  peer_ = peer;
  expected_sequence_ = static_cast<uint8_t>(frame.sequence + 1);
}

bool FrameWriter::send(uint8_t system, uint32_t id, const void* payload, uint8_t length, uint8_t crc_extra) {
  uint8_t bytes[kLongestFrame];
  const uint8_t* const source = static_cast<const uint8_t*>(payload);
  while (length > 1 && source[length - 1] == 0) --length;
  bytes[0] = kFrameMarker;
  bytes[1] = length;
  bytes[2] = 0;
  bytes[3] = 0;
  bytes[4] = sequence_;
  bytes[5] = system;
  bytes[6] = 1;  // component: autopilot
  bytes[7] = static_cast<uint8_t>(id);
  bytes[8] = static_cast<uint8_t>(id >> 8);
  bytes[9] = static_cast<uint8_t>(id >> 16);
  memcpy(bytes + kHeaderLength, source, length);
  const uint8_t end = kHeaderLength + length;
  const uint16_t crc = crc_update(crc_over(kCrcStart, bytes + 1, end - 1), crc_extra);
  bytes[end] = static_cast<uint8_t>(crc);
  bytes[end + 1] = static_cast<uint8_t>(crc >> 8);
  if (!board_.write_bytes(port_, bytes, end + 2)) return false;
  ++sequence_;
  return true;
}

}  // namespace shoal
