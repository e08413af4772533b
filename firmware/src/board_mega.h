// The Arduino Mega 2560 behind the board's interface, and its 100 Hz tick.
#pragma once

#include "board.h"

namespace shoal {

// Sets up pins, buses, timers and the watchdog; call once, first of all.
void mega_begin();
Board& mega_board();
// Sleeps in IDLE until the next 10 ms tick; returns at once when it has passed already.
void mega_wait_for_tick();

}  // namespace shoal
