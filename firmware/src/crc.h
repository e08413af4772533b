// CRC-16/MCRF4XX, byte by byte: the checksum of MAVLink frames and of the stored parameters.
#pragma once

#include <stdint.h>

#if defined(__AVR__)
#include <util/crc16.h>
#endif

namespace shoal {

constexpr uint16_t kCrcStart = 0xFFFF;

inline uint16_t crc_update(uint16_t crc, uint8_t byte) {
#if defined(__AVR__)
  return _crc_ccitt_update(crc, byte);
#else
  uint8_t t = static_cast<uint8_t>(byte ^ (crc & 0xFF));
  t = static_cast<uint8_t>(t ^ (t << 4));
  return static_cast<uint16_t>((crc >> 8) ^ (t << 8) ^ (t << 3) ^ (t >> 4));
#endif
}

}  // namespace shoal
