/* One direction of a serial line, shared by both makes of the microcontroller. */
#include "line.h"

#include <math.h>

uint64_t line_random(uint64_t *state) {
  uint64_t z = (*state += 0x9E3779B97F4A7C15u);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

void line_init(line *l, uint64_t seed, uint64_t stream) {
  *l = (line){.random = seed ^ (stream * 0xD1342543DE82EF95u)};
  line_random(&l->random);
}

uint64_t line_pass(line *l, uint64_t start_ns, double bit_ns) {
  uint64_t start = start_ns > l->free_ns ? start_ns : l->free_ns;
  return l->free_ns = start + (uint64_t)llround(LINE_BITS * bit_ns);
}

bool line_send(line *l, uint8_t value, uint64_t start_ns, double bit_ns) {
  if (l->count == LINE_CAPACITY) return false;
  uint64_t end = line_pass(l, start_ns, bit_ns);
  l->bytes[(l->head + l->count++) % LINE_CAPACITY] = (line_byte){.end_ns = end, .value = value};
  return true;
}

const line_byte *line_front(const line *l) { return l->count ? &l->bytes[l->head] : NULL; }

void line_pop(line *l) {
  if (!l->count) return;
  l->head = (l->head + 1) % LINE_CAPACITY;
  l->count--;
}

void line_cut_short(line *l, uint64_t now_ns) {
  while (l->count && l->bytes[(l->head + l->count - 1) % LINE_CAPACITY].end_ns > now_ns) l->count--;
  if (l->free_ns > now_ns) l->free_ns = now_ns;
}

uint8_t line_noise(line *l, uint8_t value, double p, uint64_t *flipped) {
  uint64_t draw = line_random(&l->random);
  if ((double)(draw >> 11) * 0x1p-53 >= p) return value;
  ++*flipped;
  return (uint8_t)(value ^ (1u << (draw & 7)));
}

uint8_t line_sample(uint8_t value, double sender_bit_ns, double receiver_bit_ns, bool *framing_error) {
  unsigned frame = ((unsigned)value << 1) | 0x200u, read = 0;
  for (int bit = 0; bit < LINE_BITS; ++bit) {
    int sent = (int)((bit + 0.5) * receiver_bit_ns / sender_bit_ns);
    unsigned level = sent < LINE_BITS ? (frame >> sent) & 1u : 1u;
    read |= level << bit;
  }
  *framing_error = !(read & 0x200u);
  return (uint8_t)(read >> 1);
}
