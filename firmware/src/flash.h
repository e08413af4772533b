// Constants that stay in flash: avr-libc's names on the vehicle, plain memory on a host.
#pragma once

#include <stdint.h>
#include <string.h>

#if defined(__AVR__)
#include <avr/pgmspace.h>
#else
#define PROGMEM
#define PSTR(text) (text)
#define memcpy_P memcpy
#define strncpy_P strncpy
#define strncmp_P strncmp
#endif

namespace shoal {

// Copies one object out of flash.
template <typename T>
inline T read_flash(const T& stored) {
  T copy;
  memcpy_P(&copy, &stored, sizeof copy);
  return copy;
}

}  // namespace shoal
