// The two halves of the link's tick.
#include "link.h"

namespace shoal {

void Link::receive() {
  Frame frame;
  handled_ = false;
  for (uint8_t i = 0; i < kBytesPerTick; ++i) {
    const int16_t byte = parts_.board.read_byte(Port::companion);
    if (byte < 0) return;
    if (!reader_.push(static_cast<uint8_t>(byte))) continue;
    while (reader_.next(frame)) {
      commands_.handle(frame);
      handled_ = true;
    }
  }
}

// A tick that had to answer sends less on its own.
void Link::send() {
  notices_.step();
  commands_.step();
  telemetry_.step(handled_ ? 1 : 2);
}

}  // namespace shoal
