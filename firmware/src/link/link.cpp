// The two halves of the link's tick.
#ifdef __AVR__
#pragma GCC optimize("O2")  // runs in every tick
#endif

#include "link.h"

namespace shoal {

void Link::receive() {
  Frame frame;
  uint8_t frames = 0;
  gave_way_ = handled_ && !gave_way_;
  for (uint8_t chunk = 0; chunk < kChunksPerTick && frames < kFramesPerTick;) {
    if (taken_ == count_) {
      ++chunk;
      taken_ = 0;
      count_ = parts_.board.read_bytes(Port::companion, bytes_, sizeof bytes_);
      if (count_ == 0) break;
    }
    if (!reader_.push(bytes_[taken_++])) continue;
    while (reader_.next(frame)) {
      commands_.handle(frame);
      ++frames;
    }
  }
  handled_ = frames > 0;
}

// A tick that had to answer sends nothing on its own, unless the one before did so already.
void Link::send() {
  const bool gives_way = handled_ && !gave_way_;
  const bool said = notices_.step() || commands_.step();
  if (!gives_way) telemetry_.step(said ? 1 : 2);
}

}  // namespace shoal
