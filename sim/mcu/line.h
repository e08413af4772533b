/* One direction of a serial line: bytes in order with the instant their stop bit ends, its noise, and what a receiver
 * at another baud makes of them. Times are nanoseconds since power was first applied. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { LINE_CAPACITY = 8192, LINE_BITS = 10 }; /* 8N1: start, eight data bits, stop */

typedef struct line_byte {
  uint64_t end_ns;
  uint8_t value;
} line_byte;

typedef struct line {
  uint64_t random;  /* state of the noise generator */
  uint64_t free_ns; /* end of the last byte that was sent */
  size_t head, count;
  line_byte bytes[LINE_CAPACITY];
} line;

/* An empty line; `seed` and `stream` choose its noise. */
void line_init(line *l, uint64_t seed, uint64_t stream);

/* Sends a byte after those before it, not before `start_ns`; false when the line holds LINE_CAPACITY bytes. */
bool line_send(line *l, uint8_t value, uint64_t start_ns, double bit_ns);
/* Time passes on the line as for a byte, but nobody hears it; returns the end of its stop bit. */
uint64_t line_pass(line *l, uint64_t start_ns, double bit_ns);
/* The oldest byte, or NULL. */
const line_byte *line_front(const line *l);
void line_pop(line *l);
/* Takes back a byte whose stop bit lies after `now_ns`: its sender lost power or was reset. */
void line_cut_short(line *l, uint64_t now_ns);

/* Flips one data bit with probability `p`; one draw a byte whatever `p` is. Counts flipped bytes in `flipped`. */
uint8_t line_noise(line *l, uint8_t value, double p, uint64_t *flipped);

/* What a receiver reads that samples mid-bit at its own rate, counted from the start edge; the line idles high after
 * the byte. `framing_error` is set when it finds no stop bit. */
uint8_t line_sample(uint8_t value, double sender_bit_ns, double receiver_bit_ns, bool *framing_error);

/* The next number of a SplitMix64 generator (Steele, Lea and Flood 2014). */
uint64_t line_random(uint64_t *state);

#ifdef __cplusplus
}
#endif
