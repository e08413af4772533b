// Builds the texts from what is pending; nothing is queued as text.
#include "notices.h"

#include "../flash.h"
#include "mavlink.h"

namespace shoal {
namespace {

constexpr uint16_t kQuiet = 1000;  // ms between two texts that the other side may provoke

const char kHex[] PROGMEM = "0123456789abcdef";

void append_hash(char* text, const uint8_t hash[8]) {
  char* end = text + strlen(text);
  for (uint8_t i = 0; i < 8; ++i) {
    *end++ = read_flash(kHex[hash[i] >> 4]);
    *end++ = read_flash(kHex[hash[i] & 15]);
  }
  *end = '\0';
}

}  // namespace

bool Notices::step() {
  quiet_ms_ -= quiet_ms_ > kTickMs ? kTickMs : quiet_ms_;
  single_quiet_ms_ -= single_quiet_ms_ > kTickMs ? kTickMs : single_quiet_ms_;
  if (pending_ == 0 && refused_ == 0 && announced_ == parts_.safety.active()) return false;
  for (uint8_t i = 0; i < single_count; ++i) {
    if (!(pending_ & (1U << i))) continue;
    const bool repeats = i == dialect || i == unknown_dialect || i == bad_setpoint;
    if (repeats && single_quiet_ms_ > 0) continue;
    if (!send_single(static_cast<Single>(i))) return true;
    if (repeats) single_quiet_ms_ = kQuiet;
    pending_ &= static_cast<uint8_t>(~(1U << i));
    return true;
  }
  for (uint8_t i = 0; i < kCauseCount; ++i) {
    const Cause cause = static_cast<Cause>(i);
    const CauseSet changed = announced_ ^ parts_.safety.active();
    if (refused_ & bit_of(cause)) {
      if (send_cause(cause, PSTR("arming refused: "))) refused_ &= static_cast<CauseSet>(~bit_of(cause));
      return true;
    }
    if (changed & bit_of(cause)) {
      const bool set = (parts_.safety.active() & bit_of(cause)) != 0;
      if (send_cause(cause, set ? PSTR("") : PSTR("cleared: "))) announced_ ^= bit_of(cause);
      return true;
    }
  }
  return false;
}

void Notices::arming_refused(CauseSet causes) {
  if (quiet_ms_ > 0) return;
  refused_ = causes;
  quiet_ms_ = kQuiet;
}

void Notices::dialect_refused(const uint8_t theirs[8]) {
  memcpy(theirs_, theirs, sizeof theirs_);
  say(dialect);
}

void Notices::parameter_refused(uint8_t index) {
  parameter_ = index;
  say(parameter);
}

bool Notices::send(uint8_t severity, const char* text) {
  mavlink_statustext_t m = {};
  m.severity = severity;
  memcpy(m.text, text, strnlen(text, sizeof m.text));
  return SHOAL_SEND(writer_, parts_.system(), STATUSTEXT, m);
}

bool Notices::send_cause(Cause cause, const char* before) {
  char text[50] = {};
  char name[kCauseTextLength];
  const uint8_t severity = Safety::describe(cause, name);
  strncpy_P(text, before, sizeof text - sizeof name);
  strcat(text, name);
  const bool clears = !(parts_.safety.active() & bit_of(cause));
  return send(clears ? static_cast<uint8_t>(MAV_SEVERITY_NOTICE) : severity, text);
}

bool Notices::send_single(Single single) {
  static const char kCauses[][12] PROGMEM = {"power on", "reset pin", "brown-out", "watchdog", "command"};
  char text[52] = {};
  uint8_t severity = MAV_SEVERITY_ERROR;
  const char* format = PSTR("");
  switch (single) {
    case started:
      strncpy_P(text, PSTR("started by "), sizeof text);
      strncpy_P(text + strlen(text), kCauses[static_cast<uint8_t>(parts_.board.reset_cause())], sizeof kCauses[0]);
      severity = MAV_SEVERITY_INFO;
      return send(severity, text);
    case dialect: {
      const uint8_t ours[] = SHOAL_DIALECT_HASH;
      strncpy_P(text, PSTR("dialect "), sizeof text);
      append_hash(text, ours);
      strncpy_P(text + strlen(text), PSTR(", not "), 8);
      append_hash(text, theirs_);
      return send(severity, text);
    }
    case unknown_dialect:
      format = PSTR("arming refused: companion's dialect unknown");
      break;
    case termination:
      format = PSTR("terminated: restart to go on");
      severity = MAV_SEVERITY_CRITICAL;
      break;
    case parameter:
      Parameters::copy_name(parameter_, text);
      strncpy_P(text + strlen(text), PSTR(" refused: out of range"), 24);
      return send(severity, text);
    case bad_setpoint:
      format = PSTR("setpoint refused: out of range or malformed");
      severity = MAV_SEVERITY_WARNING;
      break;
    case single_count:
      break;
  }
  strncpy_P(text, format, sizeof text - 1);
  return send(severity, text);
}

}  // namespace shoal
