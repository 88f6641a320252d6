// The demo's drive with one fault of a sensor: in each mode, at each speed, with each load. What its true shaft does
// then, which the drive itself does not see.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/fault_texts.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests {

struct SensorFault {
  std::string_view name;
  std::vector<Injection> injections;
};
inline const std::vector<SensorFault>& sensor_faults() {
  static const std::vector<SensorFault> all = {
      {"none", {}},
      {"line lost", {Injection::encoder_line_lost}},
      {"stuck", {Injection::motor_encoder_stuck}},
      {"stale", {Injection::motor_encoder_stale}},
      {"jump", {Injection::motor_encoder_jump}},
      {"swapped direction", {Injection::motor_encoder_swapped}},
      {"motor coupling slips", {Injection::motor_encoder_slips}},
      {"output coupling slips", {Injection::output_encoder_slips}},
      {"output line lost", {Injection::output_line_lost}},
      {"both stuck", {Injection::motor_encoder_stuck, Injection::output_encoder_stuck}},
      {"both stale", {Injection::motor_encoder_stale, Injection::output_encoder_stale}},
  };
  return all;
}

enum class CellLoad { free, inertia, gravity };
inline constexpr std::array<std::string_view, 3> kCellLoads{"free", "inertia x 4", "gravity"};

struct SensorFaultCell {
  const SensorFault* fault = nullptr;
  Mode mode = Mode::velocity;
  double speed_share = 0.0;  // of rated; zero: the fault is there before the shaft moves, and it then goes to a quarter
  int direction = 1;
  CellLoad load = CellLoad::free;
  bool compensate = false;
  bool output_encoder = true;
  double current_a = 3.0;  // mode current

  std::string name() const {
    return std::string(fault->name) + ", " + std::string(protocol::name_of(static_cast<protocol::Mode>(mode))) +
           (mode == Mode::current && current_a < 3.0 ? " 1.75 A, " : " ") +
           std::to_string(static_cast<int>(std::lround(100.0 * direction * speed_share))) + " % " +
           (direction < 0 ? "back" : "forth") + ", " + std::string(kCellLoads[static_cast<std::size_t>(load)]) +
           (compensate ? ", compensated" : "") + (output_encoder ? "" : ", no output encoder");
  }
};
struct SensorFaultOutcome {
  Fault fault = Fault::none;
  double found_s = -1.0;       // after the fault of the sensor; below zero: never
  double peak_rad_s = 0.0;     // of the true motor, from then on
  double travel_rad = 0.0;     // of the true motor, from then on, until rest or the end
  Fault before = Fault::none;  // a false alarm
  bool over(double limit_rad_s) const { return peak_rad_s > limit_rad_s; }
};

// More than half of what the motor can hold. Fast, viscous friction leaves less; and in mode current nobody holds the
// shaft before it is armed but friction.
inline double gravity_nm(Mode mode, double speed_share) {
  return mode != Mode::current && speed_share < 0.3 ? 10.0 : 4.0;
}

inline plant::Drive cell_drive(CellLoad load) {
  plant::Drive drive = demo_drive();
  const double ratio = drive.gear_ratio;
  if (load == CellLoad::inertia) {
    for (plant::Effect& effect : drive.effects) {
      if (effect.type != "output_inertia") continue;
      const double all = demo_drive().find("inertia")->value("inertia") * ratio * ratio + effect.value("inertia");
      effect.parameter("inertia").value += 3.0 * all;
    }
  }
  return drive;
}

inline control::DriveSetup<double> cell_setup(bool output_encoder) {
  auto setup = demo_setup();
  if (!output_encoder) setup.output_counts = 0;
  return setup;
}

inline SensorFaultOutcome run_cell(const SensorFaultCell& cell, const Block& block, double after_s = 0.8) {
  constexpr double kRampRadS2 = 200.0, kSettleS = 0.1, kMsS = 1e-3;
  constexpr std::uint32_t kMsTicks = kTickHz / 1000;
  const double way = cell.direction, speed = cell.speed_share * demo_drive().rated_velocity_rad_s;
  VirtualDrive drive({.drive = cell_drive(cell.load), .seed = 7, .start_turns = board::initial_turns(7)}, block);
  drive.read_frames(false);
  drive.run(100);
  const plant::State& truth = drive.rig().truth();
  SensorFaultOutcome outcome;
  double set = 0.0, position = truth.motor_angle / kTurn;
  const auto command = [&](Command::Kind kind) {
    Command c = cell.mode == Mode::current    ? arm_current(way * set)
                : cell.mode == Mode::velocity ? arm_velocity(way * set)
                                              : arm_position(position);
    if (cell.mode == Mode::position) {
      c.stream = true;
      c.velocity = N::value(way * set / demo_constants().velocity_base);
    }
    c.kind = kind;
    c.compensate = cell.compensate;
    return c;
  };
  const auto goes_on = [&](double target) {  // a millisecond of the host
    if (cell.mode == Mode::current)
      set = cell.current_a;
    else
      set = std::min(target, set + kRampRadS2 * kMsS);
    position += way * set * kMsS / kTurn;
    drive.post(command(Command::Kind::set));
  };
  if (drive.command(command(Command::Kind::arm)).refusal != Refusal::none) {
    outcome.before = Fault::stop_failed;
    return outcome;
  }
  if (cell.load == CellLoad::gravity) drive.rig().set_load_torque(gravity_nm(cell.mode, cell.speed_share));
  for (int ms = 0; ms < 100 && cell.mode != Mode::current; ++ms) {
    drive.post(command(Command::Kind::set));
    drive.run(kMsTicks);
  }
  // Up to speed.
  double left_s = cell.speed_share > 0.0 ? speed / kRampRadS2 + kSettleS : kSettleS;
  for (double t = 0.0; t < left_s; t += kMsS) {
    if (cell.speed_share > 0.0)
      goes_on(speed);
    else
      drive.post(command(Command::Kind::set));
    if (cell.mode == Mode::current && cell.speed_share > 0.0) {
      bool there = false;
      for (std::uint32_t k = 0; k < kMsTicks && !there; ++k) {
        drive.run(1);
        there = way * truth.motor_velocity >= speed;
      }
      if (there) break;
    } else {
      drive.run(kMsTicks);
    }
  }
  outcome.before = drive.status().fault.fault;
  if (outcome.before != Fault::none) return outcome;
  // The sensor fails.
  for (const Injection injection : cell.fault->injections) drive.rig().inject(injection);
  const double from = truth.motor_angle;
  const std::uint32_t at = drive.status().tick;
  const double target = cell.speed_share > 0.0 ? speed : 0.25 * demo_drive().rated_velocity_rad_s;
  const auto ticks = static_cast<std::uint32_t>(after_s * kTickHz);
  for (std::uint32_t k = 0; k < ticks; ++k) {
    if (k % kMsTicks == 0) goes_on(target);
    drive.run(1);
    outcome.peak_rad_s = std::max(outcome.peak_rad_s, std::abs(truth.motor_velocity));
    outcome.travel_rad = std::max(outcome.travel_rad, std::abs(truth.motor_angle - from));
    const firmware::Status& status = drive.status();
    if (outcome.fault == Fault::none && status.fault.fault != Fault::none) {
      outcome.fault = status.fault.fault;
      outcome.found_s = static_cast<double>(status.fault.tick - at) / kTickHz;
    }
    if (status.mode == Mode::fault && truth.motor_velocity == 0.0) break;
  }
  return outcome;
}

// Every cell; in mode current with half of the limit's current as well.
inline std::vector<SensorFaultCell> all_cells(const std::vector<double>& speed_shares) {
  std::vector<SensorFaultCell> cells;
  for (const SensorFault& fault : sensor_faults())
    for (const bool output_encoder : {true, false}) {
      if (!output_encoder && fault.name.starts_with("output")) continue;
      for (const Mode mode : {Mode::current, Mode::velocity, Mode::position})
        for (const CellLoad load : {CellLoad::free, CellLoad::inertia, CellLoad::gravity})
          for (const bool compensate : {false, true}) {
            if (compensate && mode == Mode::current) continue;
            for (const double share : speed_shares)
              for (const int direction : {1, -1}) {
                cells.push_back({&fault, mode, share, direction, load, compensate, output_encoder});
                if (mode != Mode::current) continue;
                cells.push_back(cells.back());
                cells.back().current_a = 1.75;
              }
          }
    }
  return cells;
}

}  // namespace flexspline::tests
