// Shoal's firmware for the Arduino Mega 2560: the sketch only starts the vehicle and ticks it.
#include "src/board_mega.h"
#include "src/vehicle.h"

shoal::Vehicle vehicle(shoal::mega_board());

void setup() {
  shoal::mega_begin();
  vehicle.begin();
}

void loop() {
  shoal::mega_wait_for_tick();
  vehicle.tick();
}
