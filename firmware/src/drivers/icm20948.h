// ICM-20948 (InvenSense DS-000189) over SPI: accelerometer, gyroscope and, through its own I2C master, the AK09916
// compass.
#pragma once

#include <stdint.h>

#include "../board.h"
#include "../control/maths.h"

namespace shoal {

// One reading in the body frame: forward, right, down.
struct ImuSample {
  Vec3 specific_force;  // m/s^2; (0, 0, -g) at rest
  Vec3 rate;            // rad/s
  Vec3 field;           // uT, the last valid one
  float temperature_c;
  bool field_read;   // this sample holds a new reading of field and temperature
  bool field_valid;  // the field is alive and was not overflowed
};

enum class ImuState : uint8_t { starting, running, silent, frozen };

class Icm20948 {
 public:
  explicit Icm20948(Board& board) : board_(board) {}

  // One step of start-up, or one burst read, which goes on to temperature and compass when asked; true when `sample()`
  // is new. Call every 10 ms.
  bool step(bool with_compass);

  const ImuSample& sample() const { return sample_; }
  // `silent` and `frozen` hold, through the retries, until a good sample comes.
  ImuState state() const { return state_; }

 private:
  void start_again(ImuState cause);
  bool start_step();
  bool read_sample(bool with_compass);
  void read_compass(const uint8_t* bytes);

  uint8_t read(uint8_t bank, uint8_t address);
  void write(uint8_t bank, uint8_t address, uint8_t value);
  void select(uint8_t bank);

  Board& board_;
  ImuSample sample_ = {};
  ImuState state_ = ImuState::starting;
  bool configured_ = false;
  uint8_t step_ = 0;
  uint8_t wait_ = 3;  // ticks; registers answer 11 ms after power-on (table 1)
  uint8_t bank_ = 0xFF;
  uint8_t same_ = 0;
  uint16_t fingerprint_ = 0;
  uint16_t compass_sum_ = 0;
  uint8_t compass_same_ = 0;
};

}  // namespace shoal
