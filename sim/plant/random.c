/* xoshiro256++ seeded by SplitMix64, and normals by Marsaglia's polar method. */
#include "random.h"

#include <math.h>

static uint64_t splitmix(uint64_t *x) {
  uint64_t z = (*x += UINT64_C(0x9e3779b97f4a7c15));
  z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
  return z ^ (z >> 31);
}

void random_seed(random_source *source, uint64_t seed, uint64_t stream) {
  uint64_t mixed_stream = stream;
  uint64_t x = seed ^ splitmix(&mixed_stream);
  for (int i = 0; i < 4; i++) source->state[i] = splitmix(&x);
  source->spare = 0.0;
  source->has_spare = 0;
}

static uint64_t rotate_left(uint64_t x, int bits) { return (x << bits) | (x >> (64 - bits)); }

uint64_t random_bits(random_source *source) {
  uint64_t *s = source->state;
  const uint64_t result = rotate_left(s[0] + s[3], 23) + s[0];
  const uint64_t t = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= t;
  s[3] = rotate_left(s[3], 45);
  return result;
}

double random_uniform(random_source *source) { return (double)(random_bits(source) >> 11) * 0x1.0p-53; }

double random_normal(random_source *source) {
  if (source->has_spare) {
    source->has_spare = 0;
    return source->spare;
  }
  double x, y, square;
  do {
    x = 2.0 * random_uniform(source) - 1.0;
    y = 2.0 * random_uniform(source) - 1.0;
    square = x * x + y * y;
  } while (square >= 1.0 || square == 0.0);
  const double scale = sqrt(-2.0 * log(square) / square);
  source->spare = y * scale;
  source->has_spare = 1;
  return x * scale;
}
