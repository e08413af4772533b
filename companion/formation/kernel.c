// The auction of auction.py, compiled: the same bids in the same order with the same sums, so the same answer to the
// bit.
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { LANES = 8 };

// Both are declared in auction.py as well, and a test compares what follows from them.
static const double kResolution = 1e-12;
static const double kFirstRound = 1.0 / 64.0;

typedef struct {
  double paid;
  int32_t point;
} Seat;

typedef struct {
  int32_t points, columns, stride;
  double *rows;    // points x stride; what lies behind the columns costs infinitely much
  double *prices;  // stride
  double *values;  // stride
  int32_t *room;   // of each column
  int32_t *taken;  // seats taken of each column
  Seat **seats;    // of each column, in no order
  Seat *all_seats;
  int32_t *queue;      // points to be presented, the next one last
  int32_t *presented;  // their order at the start of a round
  int32_t *winner;
} Auction;

// The least of row + prices and the second least; the return value is the first column that has the least.
static int32_t best_two(const Auction *a, const double *row, double *best, double *second) {
  double first[LANES], next[LANES];
  for (int k = 0; k < LANES; k++) first[k] = next[k] = INFINITY;
  for (int32_t j = 0; j < a->stride; j += LANES) {
    for (int k = 0; k < LANES; k++) {
      const double value = row[j + k] + a->prices[j + k];
      const double larger = value > first[k] ? value : first[k];
      first[k] = value < first[k] ? value : first[k];
      next[k] = larger < next[k] ? larger : next[k];
      a->values[j + k] = value;
    }
  }
  double one = INFINITY, two = INFINITY;
  for (int k = 0; k < LANES; k++) {
    const double larger = first[k] > one ? first[k] : one;
    one = first[k] < one ? first[k] : one;
    two = larger < two ? larger : two;
    two = next[k] < two ? next[k] : two;
  }
  *best = one;
  *second = two;
  int32_t column = 0;
  while (a->values[column] != one) column++;
  return column;
}

// One round of bidding from the given prices, which it raises.
static void bid(Auction *a, double step) {
  int32_t waiting = a->points;
  for (int32_t i = 0; i < a->points; i++) {
    a->queue[i] = a->presented[a->points - 1 - i];
    a->winner[i] = -1;
  }
  for (int32_t j = 0; j < a->columns; j++) a->taken[j] = 0;
  while (waiting) {
    const int32_t point = a->queue[--waiting];
    double best, second;
    const int32_t column = best_two(a, a->rows + (size_t)point * a->stride, &best, &second);
    const double rise = second < INFINITY ? second - best + step : step;
    const Seat bought = {a->prices[column] + rise, point};
    Seat *seats = a->seats[column];
    a->winner[point] = column;
    int32_t cheapest = 0;
    for (int32_t i = 1; i < a->taken[column]; i++) {
      const int lower = seats[i].paid < seats[cheapest].paid ||
                        (seats[i].paid == seats[cheapest].paid && seats[i].point < seats[cheapest].point);
      if (lower) cheapest = i;
    }
    if (a->taken[column] < a->room[column]) {
      seats[a->taken[column]++] = bought;
    } else {
      a->queue[waiting++] = seats[cheapest].point;
      seats[cheapest] = bought;
    }
    if (a->taken[column] == a->room[column]) {
      double price = seats[0].paid;
      for (int32_t i = 1; i < a->room[column]; i++) price = seats[i].paid < price ? seats[i].paid : price;
      a->prices[column] = price;
    }
  }
}

static void assign(Auction *a, double epsilon, double coarsening, double *total, double *bound) {
  double dearest = 0.0;
  for (int32_t i = 0; i < a->points; i++) {
    for (int32_t j = 0; j < a->columns; j++) {
      const double cost = a->rows[(size_t)i * a->stride + j];
      if (cost > dearest) dearest = cost;
    }
  }
  const double finest = epsilon > dearest * kResolution ? epsilon : dearest * kResolution;
  double step = dearest * kFirstRound;
  while (step > finest * coarsening) {
    bid(a, step);
    step /= coarsening;
  }
  bid(a, finest);
  double paid = 0.0, least = 0.0, prices = 0.0;
  for (int32_t i = 0; i < a->points; i++) {
    const double *row = a->rows + (size_t)i * a->stride;
    double best, second;
    best_two(a, row, &best, &second);
    paid += row[a->winner[i]];
    least += best;
  }
  for (int32_t j = 0; j < a->columns; j++) prices += a->prices[j] * a->room[j];
  *total = paid;
  *bound = least - prices;
}

static void release(Auction *a) {
  free(a->rows);
  free(a->prices);
  free(a->values);
  free(a->room);
  free(a->taken);
  free(a->seats);
  free(a->all_seats);
  free(a->queue);
  free(a->presented);
  free(a->winner);
}

// Room for everything; false when there is no memory.
static int reserve(Auction *a, size_t seats) {
  const size_t points = (size_t)a->points, stride = (size_t)a->stride;
  a->rows = malloc(points * stride * sizeof(double));
  a->prices = calloc(stride, sizeof(double));
  a->values = malloc(stride * sizeof(double));
  a->room = calloc(stride, sizeof(int32_t));
  a->taken = calloc(stride, sizeof(int32_t));
  a->seats = malloc(stride * sizeof(Seat *));
  a->all_seats = malloc((seats + 1) * sizeof(Seat));
  a->queue = malloc((points + 1) * sizeof(int32_t));
  a->presented = malloc(points * sizeof(int32_t));
  a->winner = malloc(points * sizeof(int32_t));
  return a->rows && a->prices && a->values && a->room && a->taken && a->seats && a->all_seats && a->queue &&
         a->presented && a->winner;
}

// Assigns `points` rows of `columns` costs, as auction() of auction.py does; there must be at least one of each, and a
// seat of each column; without `room` there is one each, without `order` the points come as they are. Fills `winner`
// (points), `prices` (columns), total and bound. Returns 0, or 1 without memory.
int shoal_auction(int32_t points, int32_t columns, const double *costs, const int32_t *room, const int32_t *order,
                  double epsilon, double coarsening, int32_t *winner, double *prices, double *total_and_bound) {
  int64_t seats = 0;
  for (int32_t j = 0; j < columns; j++) seats += room ? room[j] : 1;
  const int32_t empty = seats > points ? (int32_t)(seats - points) : 0;
  const int overflow = seats < points;
  Auction a = {.points = points + empty, .columns = columns + overflow};
  a.stride = (a.columns + LANES - 1) / LANES * LANES;
  if (!reserve(&a, (size_t)(seats > points ? seats : points))) {
    release(&a);
    return 1;
  }
  Seat *free_seats = a.all_seats;
  for (int32_t j = 0; j < a.columns; j++) {
    a.room[j] = j >= columns ? (int32_t)(points - seats) : room ? room[j] : 1;
    a.seats[j] = free_seats;
    free_seats += a.room[j];
  }
  for (int32_t i = 0; i < a.points; i++) {
    double *row = a.rows + (size_t)i * a.stride;
    for (int32_t j = 0; j < a.stride; j++) {
      row[j] = j >= a.columns ? INFINITY : i < points && j < columns ? costs[(size_t)i * columns + j] : 0.0;
    }
    a.presented[i] = i < points && order ? order[i] : i;
  }
  assign(&a, epsilon, coarsening, &total_and_bound[0], &total_and_bound[1]);
  for (int32_t i = 0; i < points; i++) winner[i] = a.winner[i] < columns ? a.winner[i] : -1;
  for (int32_t j = 0; j < columns; j++) prices[j] = a.prices[j];
  release(&a);
  return 0;
}

// Ways (points x vehicles) m between places of three coordinates.
void shoal_ways(int32_t points, int32_t vehicles, const double *to, const double *from, double *ways) {
  for (int32_t i = 0; i < points; i++) {
    for (int32_t j = 0; j < vehicles; j++) {
      const double x = to[3 * i] - from[3 * j], y = to[3 * i + 1] - from[3 * j + 1],
                   z = to[3 * i + 2] - from[3 * j + 2];
      ways[(size_t)i * vehicles + j] = sqrt(x * x + y * y + z * z);
    }
  }
}
