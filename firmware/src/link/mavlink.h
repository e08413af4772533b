// The one door to the generated MAVLink headers: trimmed for the ATmega2560 and free of global state, on any host
// alike.
//
// Pack with mavlink_msg_*_encode_status and an own mavlink_status_t, then mavlink_msg_to_send_buffer; receive with
// mavlink_frame_char_buffer and own buffers. Everything that needs a hidden channel fails to link.
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "dialect/constants.h"

#define MAVLINK_COMM_NUM_BUFFERS 1
#define MAVLINK_NO_SIGN_PACKET
#define MAVLINK_NO_SIGNATURE_CHECK

// A longer frame is dropped at its length byte; only messages for the ground are longer.
#ifndef MAVLINK_MAX_PAYLOAD_LEN
#define MAVLINK_MAX_PAYLOAD_LEN SHOAL_FIRMWARE_PAYLOAD_MAX
#endif

#ifdef __AVR__
#include <avr/pgmspace.h>
#include <util/crc16.h>

#define HAVE_CRC_ACCUMULATE
static inline void crc_accumulate(uint8_t data, uint16_t* crc) { *crc = _crc_ccitt_update(*crc, data); }
#endif

#ifdef __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#if __GNUC__ >= 9
#pragma GCC diagnostic ignored "-Waddress-of-packed-member"
#endif
#endif

#include "dialect/mavlink_types.h"

#ifdef __cplusplus
extern "C" {
#endif

// Declared and never defined: the channels of the stock helpers are global state.
#define MAVLINK_GET_CHANNEL_STATUS
#define MAVLINK_GET_CHANNEL_BUFFER
mavlink_status_t* mavlink_get_channel_status(uint8_t channel);
mavlink_message_t* mavlink_get_channel_buffer(uint8_t channel);

#define MAVLINK_GET_MSG_ENTRY
static inline const mavlink_msg_entry_t* mavlink_get_msg_entry(uint32_t id);

#ifdef __cplusplus
}
#endif

#include "dialect/shoal/mavlink.h"

#ifdef __cplusplus
extern "C" {
#endif

// What the receiver must know of a message, or NULL for an unknown one. The table stays in flash; on AVR its one entry
// in use is copied out, and stays valid until the next call.
static inline const mavlink_msg_entry_t* mavlink_get_msg_entry(uint32_t id) {
#ifdef __AVR__
  static const mavlink_msg_entry_t table[] PROGMEM = MAVLINK_MESSAGE_CRCS;
  static mavlink_msg_entry_t copy;
#else
  static const mavlink_msg_entry_t table[] = MAVLINK_MESSAGE_CRCS;
#endif
  uint8_t low = 0;
  uint8_t high = sizeof(table) / sizeof(table[0]);
  while (low < high) {
    const uint8_t middle = (uint8_t)((low + high) / 2);
#ifdef __AVR__
    memcpy_P(&copy, &table[middle], sizeof(copy));
    const mavlink_msg_entry_t* entry = &copy;
#else
    const mavlink_msg_entry_t* entry = &table[middle];
#endif
    if (entry->msgid == id) return entry;
    if (entry->msgid < id) {
      low = (uint8_t)(middle + 1);
    } else {
      high = middle;
    }
  }
  return NULL;
}

#ifdef __cplusplus
}
#endif

#ifdef __GNUC__
#pragma GCC diagnostic pop
#endif
