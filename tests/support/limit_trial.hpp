// A block with drawn limits, and, where the drive's validator takes it, each limit's signal driven beyond the limit.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>

#include "firmware/fault_texts.hpp"
#include "shared/control/drive_block.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests {

inline control::DriveSetup<double> drawn_limits(std::mt19937_64& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  auto s = demo_setup();
  const effects::DriveConstants<double> d = demo_constants();
  s.output_counts = random() % 2 == 0 ? s.output_counts : 0;
  s.has_torque_sensor = random() % 2 == 0;
  s.motor_corner = kTurn * between(20.0, 300.0);
  s.output_corner = kTurn * 50.0;
  s.loops.velocity_limit = between(0.3, 1.6) * d.velocity_base;
  s.loops.overspeed = std::min(1.15 * s.loops.velocity_limit, 2.0 * d.velocity_base);
  s.trajectory.velocity_limit = s.loops.velocity_limit;
  s.loops.current_limit = between(0.3, 1.9) * d.current_base;
  s.loops.torque_limit = s.loops.current_limit * d.torque_constant;
  s.current.full_scale = between(0.5, 4.0) * d.current_base;
  s.temperature.full_scale = between(80.0, 400.0);
  s.temperature.at_zero = between(-20.0, 60.0);
  s.amplifier_full_scale = 1.25 * s.loops.current_limit;
  s.safety.overspeed = between(1.0, 1.4) * s.loops.overspeed;
  s.safety.overcurrent = between(1.05, 2.0) * s.loops.current_limit;
  s.safety.overtemperature = between(30.0, 300.0);
  s.safety.acceleration = std::min(between(0.2, 15.0), 15.0) * d.acceleration_base;
  s.safety.stuck_torque = between(0.1, 2.2) * s.loops.torque_limit;
  s.safety.current_mismatch = between(0.05, 1.2) * s.loops.current_limit;
  s.safety.following_velocity = between(0.2, 1.2) * s.loops.velocity_limit;
  return s;
}

// The block of such limits, where they fit the drive's numbers and its validator takes them.
inline std::optional<Block> accepted_block(const control::DriveSetup<double>& setup) {
  try {
    Block block(board::parameters_of(demo_drive(), setup), demo_constants());
    if (firmware::check_block(block.bytes(), kTickHz) == firmware::BlockFinding::none) return block;
  } catch (const std::runtime_error&) {
  }
  return {};
}

// The application without a plant: what its sensors read is said here.
class Readout {
 public:
  Readout(const Block& block, const control::DriveSetup<double>& setup) : setup_(setup) {
    controller_.start(block, {}, firmware::ResetCause::power);
    temperature(25.0);
    for (int k = 0; k < 100; ++k) tick();
  }
  // Of the sensor; else it shows what the amplifier is told.
  void current(double amperes) {
    down_.readings.current = share(amperes / setup_.current.full_scale);
    follows_ = false;
  }
  void temperature(double celsius) {
    down_.readings.temperature = share((celsius + setup_.temperature.at_zero) / setup_.temperature.full_scale);
  }
  void turn(double rad_s) { velocity_ = rad_s; }
  void jump(double turns) { angle_ += turns * kTurn; }
  // The host says nothing any more.
  void be_silent() { silent_ = true; }
  bool arm(Command command) {
    command_ = command;
    tick();
    return up_.status.mode == command.mode;
  }
  const firmware::CoSimulationOutput& tick() {
    firmware::Readings& r = down_.readings;
    angle_ += velocity_ / kTickHz;
    r.motor_counter = counts(angle_, setup_.motor_counts);
    r.output_counter = counts(angle_ / demo_drive().gear_ratio, setup_.output_counts);
    r.torque = static_cast<std::int16_t>(r.torque == 1 ? 2 : 1);
    if (follows_)
      r.current = share(up_.actuation.current / 32768.0 * setup_.amplifier_full_scale / setup_.current.full_scale);
    ++r.motor_samples, ++r.output_samples, ++r.analog_samples;
    command_.kind = is_armed(up_.status.mode) ? Command::Kind::heartbeat : command_.kind;
    down_.has_command = command_.kind != Command::Kind::clear_fault && !silent_;
    down_.command = command_;
    return up_ = controller_.tick(down_);
  }
  // Runs until there is a fault, at most so long; its name.
  std::string fault_within(double seconds) {
    for (int k = 0; k < static_cast<int>(seconds * kTickHz) && up_.status.fault.fault == Fault::none; ++k) tick();
    return std::string(firmware::info_of(up_.status.fault.fault).name);
  }
  firmware::Readings& readings() { return down_.readings; }
  const firmware::Status& status() const { return up_.status; }
  double angle() const { return angle_; }

 private:
  static std::uint32_t counts(double angle, std::uint32_t a_turn) {
    return static_cast<std::uint32_t>(std::llround(angle / kTurn * a_turn));
  }
  static std::int16_t share(double x) {
    return static_cast<std::int16_t>(std::lround(std::clamp(x, -1.0, 0.99997) * 32768.0));
  }
  control::DriveSetup<double> setup_;
  board::SoftwareController controller_;
  firmware::CoSimulationInput down_;
  firmware::CoSimulationOutput up_;
  Command command_ = of_kind(Command::Kind::heartbeat);
  double velocity_ = 0.0, angle_ = 0.0;
  bool follows_ = true, silent_ = false;
};

// Drives the signal of each limit beyond it; what did not come, in words, or nothing.
inline std::string limits_that_do_not_act(const Block& block, const control::DriveSetup<double>& s) {
  std::string silent;
  const auto expect = [&](const std::string& found, const std::string& wanted) {
    if (found != wanted) silent += wanted + " (" + found + ") ";
  };
  constexpr double kBeyond = 1.03;
  for (const double sign : {1.0, -1.0}) {
    Readout r(block, s);
    r.current(sign * kBeyond * s.safety.overcurrent);
    expect(r.fault_within(0.01), "overcurrent");
  }
  {
    Readout r(block, s);
    r.temperature(kBeyond * s.safety.overtemperature + 0.2);
    expect(r.fault_within(0.05), "overtemperature");
  }
  {
    Readout r(block, s);
    if (!r.arm(arm(Mode::current))) return "not armed";
    // Slowly enough for the limit of acceleration.
    const double limit = kBeyond * s.safety.overspeed;
    const double step = std::min(0.1 * s.safety.acceleration, 20'000.0) / kTickHz;
    for (double v = 0.0; v < limit && r.status().fault.fault == Fault::none; v += step) {
      r.turn(v);
      r.tick();
    }
    expect(r.fault_within(0.5), "overspeed");
  }
  {
    Readout r(block, s);
    r.arm(arm(Mode::current));
    const double most = 0.97 * s.safety.overspeed;
    const double step = std::min(0.1 * s.safety.acceleration, 20'000.0) / kTickHz;
    for (double v = 0.0; v < most && r.status().fault.fault == Fault::none; v += step) {
      r.turn(v);
      r.tick();
    }
    r.turn(0.0);
    expect(r.fault_within(0.1), "implausible_motion");
  }
  {
    Readout r(block, s);
    Command full = arm(Mode::current);
    full.current = N::value(s.loops.current_limit / demo_constants().current_base);
    r.current(0.0);
    r.arm(full);
    expect(r.fault_within(s.safety.mismatch_s + 0.01), "current_mismatch");
  }
  {
    Readout r(block, s);
    r.arm(arm(Mode::current));
    r.jump(0.25);
    expect(r.fault_within(0.001), "motor_encoder_jump");
  }
  {
    Readout r(block, s);
    r.arm(arm(Mode::current));
    r.be_silent();
    expect(r.fault_within(s.safety.host_s + 0.01), "host_lost");
  }
  {
    // The shaft stands whatever the loop demands: which of both is found first depends on their times.
    Readout r(block, s);
    Command fast = arm(Mode::velocity);
    fast.velocity = N::value(s.loops.velocity_limit / demo_constants().velocity_base);
    r.arm(fast);
    const std::string found = r.fault_within(2.0);
    if (found != "motor_encoder_stuck") expect(found, "following_error");
  }
  return silent;
}

// An armed drive with readings drawn from all that a sensor can say. False where it could not be armed.
inline bool arm_with_random_readings(const Block& block, const control::DriveSetup<double>& s,
                                     std::mt19937_64& random) {
  Readout r(block, s);
  const Mode modes[] = {Mode::current, Mode::velocity, Mode::position};
  Command command = arm(modes[random() % 3], random() % 2 == 0);
  command.velocity = N::value(1.0);
  command.position = {static_cast<std::int64_t>(random()) >> 2};
  command.current = N::value(-1.0);
  const bool armed = r.arm(command);
  for (int k = 0; k < 50; ++k) {
    r.turn(std::uniform_real_distribution<double>(-400.0, 400.0)(random));
    r.current(0.0);
    r.readings().current = static_cast<std::int16_t>(random());
    r.readings().temperature = static_cast<std::int16_t>(random());
    r.tick();
  }
  return armed;
}

}  // namespace flexspline::tests
