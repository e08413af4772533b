// Texts for people: causes set and cleared, arming refusals, dialect mismatch; one STATUSTEXT a tick at most.
#pragma once

#include <stdint.h>

#include "../parts.h"
#include "frame.h"

namespace shoal {

class Notices {
 public:
  Notices(const Parts& parts, FrameWriter& writer) : parts_(parts), writer_(writer) {}

  // Sends what is to be said next; true when there was something.
  bool step();

  // Says every reason why arming was refused; at most once a second.
  void arming_refused(CauseSet causes);
  void dialect_refused(const uint8_t theirs[8]);
  void dialect_unknown() { say(unknown_dialect); }
  void terminated() { say(termination); }
  void parameter_refused(uint8_t index);
  void setpoint_refused() { say(bad_setpoint); }

 private:
  enum Single : uint8_t { started, dialect, unknown_dialect, termination, parameter, bad_setpoint, single_count };

  void say(Single single) { pending_ |= static_cast<uint8_t>(1U << single); }
  bool send(uint8_t severity, const char* text);
  bool send_cause(Cause cause, const char* before);
  bool send_single(Single single);

  const Parts& parts_;
  FrameWriter& writer_;
  CauseSet announced_ = 0;  // as the other side knows it
  CauseSet refused_ = 0;    // still to be said
  uint16_t quiet_ms_ = 0;   // until the next refusal may be said
  uint16_t single_quiet_ms_ = 0;
  uint8_t pending_ = 1U << started;
  uint8_t parameter_ = 0;
  uint8_t theirs_[8] = {};
};

}  // namespace shoal
