// Servo and ESC pulses in time, without a timer.
#include "board_native.h"

namespace shoal_sim {
namespace {

constexpr uint64_t kPeriodNs = 20000000;
constexpr uint64_t kSilenceNs = 50000000;
constexpr uint64_t kLongestUs = 2500;  // as the board's own timers are limited

}  // namespace

// The timers start with the processor; a pulse under way ends without counting.
void Pulses::restart(uint64_t now_ns) {
  run_until(now_ns);
  open_width_ns_ = width_ns_ = 0;
  next_rise_ns_ = now_ns + kPeriodNs;
}

void Pulses::run_until(uint64_t now_ns) {
  for (;;) {
    const bool ends = open_width_ns_ != 0 && open_since_ns_ + open_width_ns_ <= now_ns;
    if (ends) {
      ended_ns_ = open_since_ns_ + open_width_ns_;
      ended_width_ns_ = open_width_ns_;
      open_width_ns_ = 0;
    }
    if (next_rise_ns_ > now_ns) return;
    open_since_ns_ = next_rise_ns_;
    open_width_ns_ = width_ns_;
    next_rise_ns_ += kPeriodNs;
  }
}

void Pulses::set_width_us(uint16_t width_us, uint64_t now_ns) {
  run_until(now_ns);
  width_ns_ = 1000 * (width_us > kLongestUs ? kLongestUs : width_us);
}

double Pulses::last_us(uint64_t now_ns) const {
  Pulses copy = *this;
  copy.run_until(now_ns);
  if (copy.ended_width_ns_ == 0 || now_ns > copy.ended_ns_ + kSilenceNs) return 0;
  return static_cast<double>(copy.ended_width_ns_) / 1000;
}

}  // namespace shoal_sim
