// The link to the companion: bytes in to commands, and notices, parameters and telemetry out.
#pragma once

#include "../parts.h"
#include "commands.h"
#include "frame.h"
#include "notices.h"
#include "telemetry.h"

namespace shoal {

class Link {
 public:
  explicit Link(Parts& parts)
      : parts_(parts),
        writer_(parts.board, Port::companion),
        telemetry_(parts, writer_, reader_),
        notices_(parts, writer_),
        commands_(parts, writer_, telemetry_, notices_) {}

  // Takes what has arrived, no more than the line can bring in a tick and a third; further frames wait for the next
  // tick.
  void receive();
  void send();

  const LossCounters& losses() const { return reader_.losses(); }

 private:
  static constexpr uint8_t kFramesPerTick = 2;
  static constexpr uint8_t kChunksPerTick = 5;

  Parts& parts_;
  FrameReader reader_;
  FrameWriter writer_;
  Telemetry telemetry_;
  Notices notices_;
  Commands commands_;
  uint8_t bytes_[32] = {};
  uint8_t count_ = 0;
  uint8_t taken_ = 0;
  bool handled_ = false;   // a frame, in this tick
  bool gave_way_ = false;  // the tick before sent no telemetry
};

}  // namespace shoal
