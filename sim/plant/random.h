/* Seeded random numbers whose sequence depends on nothing but the seed. */
#pragma once

#include <stdint.h>

typedef struct random_source {
  uint64_t state[4];
  double spare; /* second normal of the last pair */
  int has_spare;
} random_source;

/* Starts the sequence of one stream of one seed; streams of a seed are independent of each other. */
void random_seed(random_source *source, uint64_t seed, uint64_t stream);
uint64_t random_bits(random_source *source);
/* Uniform in [0, 1). */
double random_uniform(random_source *source);
/* Standard normal. */
double random_normal(random_source *source);
