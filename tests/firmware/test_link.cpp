// The whole firmware on a fake board, spoken to over its line: setpoints, arming, dialects, parameters, noise.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "companion.h"

using namespace shoal;

namespace {

std::string hex(const uint8_t hash[8]) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    char two[3];
    snprintf(two, sizeof two, "%02x", hash[i]);
    text += two;
  }
  return text;
}

const uint8_t kOwnHash[8] = SHOAL_DIALECT_HASH;

}  // namespace

TEST_CASE("a vehicle boots, arms, drives and disarms") {
  Rig rig;
  CHECK(rig.board.pulses[2] == 1500);  // before the first tick
  rig.arm();
  REQUIRE(rig.acks.size() == 1);
  CHECK(rig.acks[0].result == MAV_RESULT_ACCEPTED);
  CHECK(rig.acks[0].target_component == MAV_COMP_ID_ONBOARD_COMPUTER);
  CHECK(rig.mode() == Mode::armed);
  rig.drive(2.0, 1.0f, 3.0f, 0.5f);
  CHECK(rig.board.pulses[2] > 1700);  // ahead
  CHECK(rig.board.pulses[1] > 1600);  // to starboard
  CHECK(rig.board.pulses[0] < 1450);  // bow down
  rig.command(MAV_CMD_COMPONENT_ARM_DISARM, 0);
  rig.run(0.1);
  CHECK(rig.mode() == Mode::disarmed);
  CHECK(rig.board.pulses[0] == 1500);
  CHECK(rig.board.pulses[1] == 1500);
  CHECK(rig.board.pulses[2] == 1500);
}

TEST_CASE("all streams keep their rates on a third of the line") {
  Rig rig;
  rig.run(3);
  const unsigned before = rig.frames;
  rig.run(10);
  CHECK(rig.frames - before >= 960);
  CHECK(rig.frames - before <= 980);
}

TEST_CASE("arming is refused without a known dialect, across dialects with both hashes, and with every other reason") {
  Rig rig;
  rig.run(3);
  rig.command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
  rig.run(0.2);
  CHECK(rig.acks.back().result == MAV_RESULT_TEMPORARILY_REJECTED);
  CHECK(rig.heard("arming refused: companion's dialect unknown"));

  uint8_t other[8];
  for (int i = 0; i < 8; ++i) other[i] = static_cast<uint8_t>(kOwnHash[i] ^ 0x11);
  rig.version(other);
  rig.run(1.2);
  rig.command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
  rig.run(1.2);
  CHECK(rig.acks.back().result == MAV_RESULT_TEMPORARILY_REJECTED);
  CHECK(rig.heard("dialect " + hex(kOwnHash) + ", not " + hex(other)));
  CHECK(rig.mode() == Mode::disarmed);

  rig.version(kOwnHash);
  rig.board.readings.leak = 1;
  rig.board.depth_silent = true;
  rig.run(2);
  rig.texts.clear();
  for (int i = 0; i < 10; ++i) {
    rig.command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
    rig.run(0.09);
  }
  CHECK(rig.mode() == Mode::disarmed);
  CHECK(rig.heard("arming refused: leak"));
  CHECK(rig.heard("arming refused: depth sensor silent"));
  CHECK(rig.texts.size() == 2);  // ten refusals in a second are told once
}

TEST_CASE("a setpoint that is malformed, out of range or at odds with itself changes nothing and is counted") {
  Rig rig;
  rig.arm();
  rig.drive(0.5, 0.3f, 2.0f, 0.4f);
  const auto good = Rig::setpoint_of(0.3f, 2.0f, 0.4f);
  std::vector<mavlink_set_position_target_local_ned_t> bad(12, good);
  bad[0].yaw = NAN;
  bad[1].z = INFINITY;
  bad[2].z = -0.1f;
  bad[3].z = 10.5f;
  bad[4].vx = 2.5f;
  bad[5].vy = -INFINITY;
  bad[6].vx = -NAN;
  bad[7].vy += 0.2f;  // velocity and heading disagree
  bad[8].type_mask = 0x09E2;
  bad[9].coordinate_frame = MAV_FRAME_BODY_NED;
  bad[10].yaw = 9.0f;
  bad[11].vx = bad[11].vy = 1.9f;  // 2.7 m/s together
  bad[11].yaw = kPi / 4.0f;
  uint16_t refused = 0;
  for (size_t i = 0; i < bad.size(); ++i) {
    CAPTURE(i);
    rig.setpoint(bad[i]);
    rig.run(0.02);
    CHECK(rig.vehicle.parts().companion.setpoints_refused == ++refused);
    CHECK(rig.vehicle.parts().companion.setpoint.heading == doctest::Approx(0.3));
    CHECK(rig.vehicle.parts().companion.setpoint.depth == 2.0f);
    CHECK(rig.vehicle.parts().companion.setpoint.speed == doctest::Approx(0.4));
  }
  auto foreign = Rig::setpoint_of(1.0f, 5.0f, 0.6f);
  foreign.target_system = 7;
  rig.setpoint(foreign);
  rig.component = MAV_COMP_ID_MISSIONPLANNER;
  rig.setpoint(Rig::setpoint_of(1.0f, 5.0f, 0.6f));
  rig.run(0.05);
  CHECK(rig.vehicle.parts().companion.setpoint.depth == 2.0f);
  CHECK(rig.vehicle.parts().companion.setpoints_refused == refused);
}

TEST_CASE("astern is a setpoint, too") {
  Rig rig;
  rig.arm();
  rig.drive(1.0, 0.0f, 2.0f, -0.3f);
  CHECK(rig.vehicle.parts().companion.setpoint.speed == doctest::Approx(-0.3));
  CHECK(rig.board.pulses[2] < 1450);
}

TEST_CASE("a silent companion: half a second to zero thrust, two to the failsafe, a re-arm to go on") {
  Rig rig;
  rig.arm();
  rig.drive(2.0, 0.0f, 2.0f, 0.5f);
  REQUIRE(rig.board.pulses[2] > 1700);
  rig.run(0.4);
  CHECK(rig.vehicle.parts().safety.action() == Action::none);
  rig.run(0.8);
  CHECK(rig.vehicle.parts().safety.action() == Action::hold);
  CHECK(rig.board.pulses[2] == 1500);
  CHECK(rig.heard("setpoint stale"));

  rig.drive(0.5, 0.0f, 2.0f, 0.5f);  // a new setpoint recovers from the hold
  CHECK(rig.board.pulses[2] > 1600);
  CHECK(rig.heard("cleared: setpoint stale"));

  rig.board.readings.pressure_pa = 101325 + 2.0 * 1025 * 9.80665;
  rig.run(2.2);
  CHECK(rig.mode() == Mode::failsafe);
  CHECK(rig.vehicle.parts().safety.action() == Action::surface);
  rig.run(1);
  CHECK(rig.board.pulses[2] > 1600);  // drives up
  CHECK(rig.board.pulses[0] > 1550);  // bow up
  rig.drive(1.0, 0.0f, 2.0f, 0.5f);   // setpoints alone do not recover from the failsafe
  CHECK(rig.mode() == Mode::failsafe);
  rig.command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
  rig.drive(0.2, 0.0f, 2.0f, 0.5f);
  CHECK(rig.mode() == Mode::armed);
}

TEST_CASE("after arming the vehicle stays where it is until a setpoint comes, whatever came before") {
  Rig rig;
  rig.run(3);
  rig.drive(0.3, 2.0f, 5.0f, 0.6f);
  rig.arm();
  REQUIRE(rig.mode() == Mode::armed);
  CHECK(rig.vehicle.parts().target.speed == 0.0f);
  CHECK(rig.board.pulses[2] == 1500);
}

TEST_CASE("a dead IMU stops an armed vehicle, a dead companion makes it surface") {
  Rig rig;
  rig.arm();
  rig.drive(1.0, 0.0f, 2.0f, 0.5f);
  rig.board.imu_silent = true;
  rig.drive(0.6, 0.0f, 2.0f, 0.5f);
  CHECK(rig.mode() == Mode::failsafe);
  CHECK(rig.heard("IMU silent"));
  CHECK(rig.board.pulses[2] == 1500);

  Rig other;
  other.arm();
  other.beats = false;
  other.drive(6.5, 0.0f, 2.0f, 0.5f);
  CHECK(other.mode() == Mode::failsafe);
  CHECK(other.heard("companion's heartbeat lost"));
}

TEST_CASE("termination ends everything but the telemetry; a restart is what ends it") {
  Rig rig;
  rig.arm();
  rig.drive(1.0, 0.0f, 2.0f, 0.5f);
  rig.command(MAV_CMD_DO_FLIGHTTERMINATION, 1);
  rig.drive(1.0, 0.0f, 2.0f, 0.5f);
  CHECK(rig.board.pulses[2] == 1500);
  rig.command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
  rig.run(0.1);
  CHECK(rig.acks.back().result == MAV_RESULT_TEMPORARILY_REJECTED);
  CHECK(rig.mode() == Mode::terminated);
  rig.command(MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1);
  rig.run(0.1);
  CHECK_FALSE(rig.board.rebooted);  // the acknowledgement leaves first
  rig.run(0.2);
  CHECK(rig.board.rebooted);
}

TEST_CASE("every command gets an honest answer") {
  Rig rig;
  rig.run(1);
  struct Expectation {
    uint16_t command;
    float p1, p2;
    uint8_t result;
  };
  const Expectation expectations[] = {
      {MAV_CMD_RUN_PREARM_CHECKS, 0, 0, MAV_RESULT_ACCEPTED},
      {MAV_CMD_COMPONENT_ARM_DISARM, 0.5f, 0, MAV_RESULT_DENIED},
      {MAV_CMD_COMPONENT_ARM_DISARM, NAN, 0, MAV_RESULT_DENIED},
      {MAV_CMD_SET_MESSAGE_INTERVAL, MAVLINK_MSG_ID_ATTITUDE, 100000, MAV_RESULT_ACCEPTED},
      {MAV_CMD_SET_MESSAGE_INTERVAL, MAVLINK_MSG_ID_ODOMETRY, 100000, MAV_RESULT_DENIED},
      {MAV_CMD_SET_MESSAGE_INTERVAL, -5, 100000, MAV_RESULT_DENIED},
      {MAV_CMD_GET_MESSAGE_INTERVAL, MAVLINK_MSG_ID_ATTITUDE, 0, MAV_RESULT_ACCEPTED},
      {MAV_CMD_REQUEST_MESSAGE, MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0, MAV_RESULT_ACCEPTED},
      {MAV_CMD_REQUEST_MESSAGE, 1e9f, 0, MAV_RESULT_DENIED},
      {MAV_CMD_PREFLIGHT_STORAGE, 1, 0, MAV_RESULT_ACCEPTED},
      {MAV_CMD_PREFLIGHT_STORAGE, 9, 0, MAV_RESULT_DENIED},
      {MAV_CMD_DO_FLIGHTTERMINATION, 0, 0, MAV_RESULT_DENIED},
      {MAV_CMD_INJECT_FAILURE, 0, 0, MAV_RESULT_UNSUPPORTED},
      {MAV_CMD_DO_SET_MODE, 1, 0, MAV_RESULT_UNSUPPORTED},
      {12345, 0, 0, MAV_RESULT_UNSUPPORTED},
  };
  for (const Expectation& e : expectations) {
    CAPTURE(e.command);
    CAPTURE(e.p1);
    rig.acks.clear();
    rig.command(e.command, e.p1, e.p2);
    rig.run(0.03);
    REQUIRE(rig.acks.size() == 1);
    CHECK(rig.acks[0].command == e.command);
    CHECK(rig.acks[0].result == e.result);
  }
  REQUIRE(rig.versions.size() == 1);
  CHECK(memcmp(rig.versions[0].middleware_custom_version, kOwnHash, 8) == 0);
  rig.target = 9;
  rig.acks.clear();
  rig.command(MAV_CMD_RUN_PREARM_CHECKS);
  rig.run(0.05);
  CHECK(rig.acks.empty());  // not for this vehicle
}

TEST_CASE("the parameter service lists, sets, refuses with the name, and changes the system id at once") {
  Rig rig;
  rig.run(1);
  mavlink_param_request_list_t request = {1, 1};
  mavlink_message_t packed;
  mavlink_status_t status = {};
  mavlink_msg_param_request_list_encode_status(1, 191, &status, &packed, &request);
  rig.put(packed);
  rig.run(1.5);
  REQUIRE(rig.values.size() == kParameterCount);
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    CHECK(rig.values[i].param_index == i);
    CHECK(rig.values[i].param_count == kParameterCount);
    CHECK(rig.values[i].param_type == MAV_PARAM_TYPE_REAL32);
  }
  rig.set_parameter("FIN_LIMIT", 99.0f);
  rig.run(0.1);
  CHECK(rig.heard("FIN_LIMIT refused: out of range"));
  CHECK(rig.values.back().param_value == 30.0f);  // the answer is what holds
  rig.set_parameter("SYS_ID", 4.0f);
  rig.run(0.1);
  CHECK(rig.vehicle.parts().system() == 4);
  rig.acks.clear();
  rig.command(MAV_CMD_RUN_PREARM_CHECKS);
  rig.run(0.05);
  CHECK(rig.acks.empty());  // system 1 is somebody else now
  rig.target = 4;
  rig.command(MAV_CMD_RUN_PREARM_CHECKS);
  rig.run(0.05);
  CHECK(rig.acks.size() == 1);
}

TEST_CASE("noise: of twenty thousand setpoints with flipped bits only whole ones are taken, and the loss is counted") {
  Rig rig;
  rig.arm();
  uint64_t state = 7;
  const auto draw = [&] { return state = state * 6364136223846793005ull + 1442695040888963407ull, state >> 33; };
  int flipped_frames = 0;
  for (int n = 0; n < 20000; ++n) {
    const auto before = rig.board.arriving.size();
    const float depth = 1.0f + static_cast<float>(n % 8);
    rig.setpoint(0.1f, depth, 0.3f);
    bool flipped = false;
    for (size_t i = before; i < rig.board.arriving.size(); ++i) {
      if (draw() % 100 == 0) {
        rig.board.arriving[i] ^= static_cast<uint8_t>(1U << draw() % 8);
        flipped = true;
      }
    }
    flipped_frames += flipped;
    rig.board.advance_ms(1);
    rig.vehicle.tick();
    rig.board.sent.clear();
    const Setpoint& s = rig.vehicle.parts().companion.setpoint;
    const bool whole = s.depth >= 1.0f && s.depth <= 8.0f && s.depth == floorf(s.depth) &&
                       fabsf(s.heading - 0.1f) < 1e-6f && fabsf(s.speed - 0.3f) < 1e-6f;
    if (!whole) FAIL("a setpoint that was never sent: ", s.heading, " ", s.depth, " ", s.speed);
  }
  CHECK(flipped_frames > 5000);
  CHECK(rig.vehicle.losses().bad_frames > flipped_frames / 2);
}

TEST_CASE("after garbage of any kind the next whole frame is heard") {
  Rig rig;
  rig.run(1);
  uint64_t state = 3;
  for (int round = 0; round < 300; ++round) {
    for (int i = 0; i < round % 90; ++i) {
      state = state * 6364136223846793005ull + 1442695040888963407ull;
      const uint8_t byte = static_cast<uint8_t>(state >> 40);
      rig.board.arriving.push_back(i % 11 == 0 ? kFrameMarker : byte);
    }
    for (int i = 0; i < 100; ++i) rig.board.arriving.push_back(0);  // longer than any frame that garbage may announce
    rig.acks.clear();
    rig.command(MAV_CMD_RUN_PREARM_CHECKS);
    rig.run(0.05);
    CHECK(rig.acks.size() == 1);
  }
}

TEST_CASE("a full transmit line loses streams, never the loop") {
  Rig rig;
  rig.arm();
  rig.board.transmit_full = true;
  rig.drive(2.0, 0.0f, 2.0f, 0.5f);
  CHECK(rig.mode() == Mode::armed);
  rig.board.transmit_full = false;
  const unsigned before = rig.frames;
  rig.drive(1.0, 0.0f, 2.0f, 0.5f);
  CHECK(rig.frames - before > 80);
}

TEST_CASE("two vehicles in one process share nothing") {
  Rig alone;
  alone.arm();
  alone.drive(2.0, 0.4f, 3.0f, 0.5f);

  Rig first, second;
  second.board.readings.specific_force_mps2[0] = 2.0;
  for (int i = 0; i < 300; ++i) {
    first.run(0.01);
    second.run(0.01);
  }
  first.version(kOwnHash);
  first.command(MAV_CMD_COMPONENT_ARM_DISARM, 1);
  for (int i = 0; i < 10; ++i) {
    first.run(0.01);
    second.run(0.01);
  }
  for (int i = 0; i < 20; ++i) {
    first.setpoint(0.4f, 3.0f, 0.5f);
    second.setpoint(-1.0f, 1.0f, 0.2f);
    first.run(0.1);
    second.run(0.1);
  }
  CHECK(second.mode() == Mode::disarmed);
  for (int i = 0; i < 3; ++i) CHECK(first.board.pulses[i] == alone.board.pulses[i]);
  CHECK(first.frames == alone.frames);
  CHECK(first.vehicle.parts().attitude.yaw() == alone.vehicle.parts().attitude.yaw());
}
