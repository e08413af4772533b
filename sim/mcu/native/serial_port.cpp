// A serial port and its line, as the firmware's interrupts would run it.
#include <cmath>

#include "board_native.h"

namespace shoal_sim {
namespace {

// The bit that a divider of 16 MHz in double speed gives: 115200 is really 117647 (as in the board's file).
double programmed_bit_ns(uint32_t baud) {
  const uint32_t divider = static_cast<uint32_t>((SHOAL_CPU_HZ + 4 * baud) / (8 * baud));
  return divider * 8e9 / SHOAL_CPU_HZ;
}

}  // namespace

SerialPort::SerialPort(uint64_t seed, unsigned number, uint32_t host_baud, uint32_t own_baud, unsigned receive_ring,
                       unsigned transmit_ring)
    : host_bit_ns_(1e9 / host_baud),
      own_bit_ns_(programmed_bit_ns(own_baud)),
      ring_size_(receive_ring),
      transmit_size_(transmit_ring) {
  line_init(&to_mcu_, seed, 2 * number + 1);
  line_init(&to_host_, seed, 2 * number + 2);
}

void SerialPort::restart(uint64_t now_ns) {
  line_cut_short(&to_host_, now_ns);
  head_ = used_ = 0;
  overruns_ = 0;
}

void SerialPort::run_until(uint64_t now_ns, double noise, bool cut, mcu_counters* counters) {
  for (const line_byte* front; (front = line_front(&to_mcu_)) && front->end_ns <= now_ns; line_pop(&to_mcu_)) {
    bool bad_frame = false;
    uint8_t value = line_noise(&to_mcu_, front->value, noise, &counters->rx_corrupted);
    value = line_sample(value, host_bit_ns_, own_bit_ns_, &bad_frame);
    if (cut) continue;
    if (used_ == ring_size_) {
      ++overruns_;
    } else {
      ring_[(head_ + used_++) % ring_size_] = value;
    }
  }
}

int16_t SerialPort::read_byte(uint64_t now_ns, double noise, bool cut, mcu_counters* counters) {
  run_until(now_ns, noise, cut, counters);
  if (used_ == 0) return -1;
  const uint8_t value = ring_[head_];
  head_ = (head_ + 1) % ring_size_;
  --used_;
  return value;
}

bool SerialPort::write_bytes(const uint8_t* bytes, uint16_t count, uint64_t now_ns, double noise, bool cut,
                             mcu_counters* counters) {
  // One byte is in the shift register and one in the data register; the others wait in the ring.
  const double waiting = to_host_.free_ns > now_ns ? static_cast<double>(to_host_.free_ns - now_ns) : 0;
  const double queued = std::ceil(waiting / (LINE_BITS * own_bit_ns_)) - 2;
  if ((queued > 0 ? queued : 0) + count > transmit_size_) return false;
  for (uint16_t i = 0; i < count; ++i) {
    bool bad_frame = false;
    uint8_t value = line_noise(&to_host_, bytes[i], noise, &counters->tx_corrupted);
    value = line_sample(value, own_bit_ns_, host_bit_ns_, &bad_frame);
    if (cut || !line_send(&to_host_, value, now_ns, own_bit_ns_)) line_pass(&to_host_, now_ns, own_bit_ns_);
  }
  return true;
}

size_t SerialPort::host_write(const uint8_t* bytes, size_t count, uint64_t start_ns) {
  size_t taken = 0;
  while (taken < count && line_send(&to_mcu_, bytes[taken], start_ns, host_bit_ns_)) ++taken;
  return taken;
}

size_t SerialPort::host_read(uint8_t* bytes, size_t capacity, uint64_t now_ns) {
  size_t count = 0;
  for (const line_byte* b; count < capacity && (b = line_front(&to_host_)) && b->end_ns <= now_ns; line_pop(&to_host_))
    bytes[count++] = b->value;
  return count;
}

}  // namespace shoal_sim
