// Prints what auctions of random markets end in, every number to its last bit, for comparison between machines.
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST = 60, CASES = 300 };

int shoal_auction(int32_t points, int32_t columns, const double *costs, const int32_t *room, const int32_t *order,
                  double epsilon, double coarsening, int32_t *winner, double *prices, double *total_and_bound);
void shoal_ways(int32_t points, int32_t vehicles, const double *to, const double *from, double *ways);

// A number of 0 to 1 by xorshift: the same on every machine.
static double draw(uint64_t *state) {
  *state ^= *state << 13;
  *state ^= *state >> 7;
  *state ^= *state << 17;
  return (double)(*state >> 11) / 9007199254740992.0;
}

static void print_bits(double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  printf(" %016" PRIx64, bits);
}

int main(void) {
  static double to[3 * MOST], from[3 * MOST], ways[MOST * MOST], prices[MOST], figures[2];
  static int32_t winner[MOST];
  uint64_t state = 88172645463325252u;
  for (int i = 0; i < CASES; i++) {
    const int32_t points = 1 + (int32_t)(draw(&state) * (MOST - 1)),
                  vehicles = 1 + (int32_t)(draw(&state) * (MOST - 1));
    for (int k = 0; k < 3 * MOST; k++) {
      to[k] = 40.0 * draw(&state);
      from[k] = 40.0 * draw(&state);
    }
    shoal_ways(points, vehicles, to, from, ways);
    if (shoal_auction(points, vehicles, ways, NULL, NULL, 1e-4, 5.0, winner, prices, figures)) return 1;
    for (int32_t j = 0; j < points; j++) printf("%" PRId32 " ", winner[j]);
    for (int32_t j = 0; j < vehicles; j++) print_bits(prices[j]);
    print_bits(figures[0]);
    print_bits(figures[1]);
    putchar('\n');
  }
  return 0;
}
