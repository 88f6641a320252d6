// The demo's drive with a three-phase stage and one fault of the stage, its motor or its encoder: in each mode, at each
// speed, with each load. What its true shaft, its wires and its switches do then.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/sensor_fault_cells.hpp"

namespace flexspline::tests {

// Where a fault has no time, as a shaft at rest without torque shows nothing of it: speed, current and travel are
// bounded.
enum class StageTime {
  always,   // in every cell
  turning,  // from a tenth of rated speed on; and a sixth of an electrical turn, in which a phase passes zero
  fast,     // from half of rated speed on
};
struct StageFaultKind {
  std::string_view name;
  std::vector<Injection> injections;
  // What may be named: faults of the stage, and of the application, which sees the same from outside.
  std::vector<firmware::StageFault> of_stage;
  std::vector<Fault> of_drive;
  double within_s = 0.0;  // as firmware/OPERATION.md states it, and a tick in which it is told
  StageTime time = StageTime::always;
  bool is_short = false;  // its current is limited by the bus and the wires alone until the switches open
};
// Of a cause that the stage samples for so many periods; the first one begins before the sample.
inline double stated_s(firmware::StageFault fault) {
  return (firmware::periods_of(fault) + 1.0) / board::ThreePhaseAmplifier::kPwmHz;
}
inline const std::vector<StageFaultKind>& stage_faults() {
  using S = firmware::StageFault;
  constexpr double kTickS = 1.0 / kTickHz;
  static const std::vector<Fault> kEncoder = {Fault::motor_encoder_stuck, Fault::implausible_motion,
                                              Fault::following_error, Fault::encoders_disagree,
                                              Fault::output_encoder_stuck};
  static const std::vector<StageFaultKind> all = {
      {"none", {}, {}, {}},
      {"phase lost",
       {Injection::phase_lost},
       {S::phase_lost, S::voltage_residual},
       {},
       stated_s(S::phase_lost),
       StageTime::turning},
      {"phases shorted",
       {Injection::phases_shorted},
       {S::overcurrent},
       {},
       stated_s(S::current_sum),
       StageTime::always,
       true},
      {"phase to ground",
       {Injection::phase_grounded},
       {S::current_sum, S::overcurrent},
       {},
       stated_s(S::current_sum),
       StageTime::always,
       true},
      // The bus falls with its capacitor and the supply's resistance, 25 us.
      {"bus collapse", {Injection::bus_collapse}, {S::bus_low}, {}, stated_s(S::bus_low) + 4 * 25e-6},
      {"driver fault", {Injection::driver_fault}, {S::driver}, {}, stated_s(S::driver)},
      {"thermistor open", {Injection::thermistor_open}, {S::thermistor_open}, {}, stated_s(S::thermistor_open)},
      {"thermistor shorted",
       {Injection::thermistor_shorted},
       {S::thermistor_shorted},
       {},
       stated_s(S::thermistor_shorted)},
      {"encoder stale",
       {Injection::motor_encoder_stale},
       {},
       {Fault::motor_encoder_stale},
       (firmware::kStaleTicks + 1) * kTickS},
      {"encoder jump", {Injection::motor_encoder_jump}, {}, {Fault::motor_encoder_jump}, 2 * kTickS},
      {"encoder stuck",
       {Injection::motor_encoder_stuck},
       {S::voltage_residual},
       kEncoder,
       60 * kTickS,
       StageTime::fast},
      {"encoder halved",
       {Injection::motor_encoder_slips},
       {S::voltage_residual},
       kEncoder,
       60 * kTickS,
       StageTime::fast},
  };
  return all;
}

struct StageFaultCell {
  const StageFaultKind* kind = nullptr;
  Mode mode = Mode::velocity;
  double speed_share = 0.0;  // of rated
  int direction = 1;
  CellLoad load = CellLoad::free;
  std::uint64_t seed = 7;
  std::string name() const {
    return std::string(kind->name) + ", " + std::string(protocol::name_of(static_cast<protocol::Mode>(mode))) + " " +
           std::to_string(static_cast<int>(std::lround(100.0 * direction * speed_share))) + " %, " +
           std::string(kCellLoads[static_cast<std::size_t>(load)]) + ", seed " + std::to_string(seed);
  }
};
inline double stated_s(const StageFaultCell& cell) {
  if (cell.kind->time != StageTime::turning) return cell.kind->within_s;
  const double electrical_rad_s =
      board::three_phase_of(demo_drive()).motor.pole_pairs * cell.speed_share * demo_drive().rated_velocity_rad_s;
  return cell.kind->within_s + kTurn / 6.0 / electrical_rad_s;
}
// Whether the fault has to be found within its time.
inline bool has_time(const StageFaultCell& cell) {
  switch (cell.kind->time) {
    case StageTime::always:
      return !cell.kind->injections.empty();
    case StageTime::turning:
      return cell.speed_share >= 0.1;
    case StageTime::fast:
      return cell.speed_share >= 0.5;
  }
  return true;
}
struct StageFaultOutcome {
  Fault before = Fault::none;  // a false alarm
  firmware::StageFault stage_before = firmware::StageFault::none;
  Fault fault = Fault::none;
  firmware::StageFault stage_fault = firmware::StageFault::none;
  double open_s = -1.0;     // from the fault until all switches are open; below zero: never
  double peak_rad_s = 0.0;  // of the true motor, from then on
  double peak_phase_a = 0.0;
  double travel_turns = 0.0;
  double end_rad_s = 0.0;

  std::string named() const {
    if (fault == Fault::amplifier_fault)
      return std::string(protocol::stage_fault_text(static_cast<std::int32_t>(stage_fault)).name);
    return std::string(firmware::info_of(fault).name);
  }
  bool is_expected(const StageFaultKind& kind) const {
    if (fault == Fault::amplifier_fault)
      return std::find(kind.of_stage.begin(), kind.of_stage.end(), stage_fault) != kind.of_stage.end();
    return std::find(kind.of_drive.begin(), kind.of_drive.end(), fault) != kind.of_drive.end();
  }
};

inline std::unique_ptr<VirtualDrive> three_phase_drive(const StageFaultCell& cell, const Block& block) {
  auto drive = std::make_unique<VirtualDrive>(RigSetup{.drive = cell_drive(cell.load),
                                                       .seed = cell.seed,
                                                       .start_turns = board::initial_turns(cell.seed),
                                                       .three_phase = true},
                                              block);
  drive->read_frames(false);
  return drive;
}

class StageFaultRun {
 public:
  StageFaultRun(const StageFaultCell& cell, const Block& block)
      : cell_(cell), drive_(three_phase_drive(cell, block)), position_(truth().motor_angle / kTurn) {}

  StageFaultOutcome run(double after_s) {
    StageFaultOutcome out;
    begin();
    out.before = drive_->status().fault.fault;
    out.stage_before = reason();
    if (out.before != Fault::none) return out;
    board::ThreePhaseAmplifier& stage = *drive_->rig().three_phase();
    stage.forget_peak();
    const double from = truth().motor_angle;
    const std::uint64_t at = stage.periods();
    for (const Injection injection : cell_.kind->injections) drive_->rig().inject(injection);
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(after_s * kTickHz); ++k) {
      if (k % kMsTicks == 0) goes_on();
      drive_->run(1);
      out.peak_rad_s = std::max(out.peak_rad_s, std::abs(truth().motor_velocity));
      out.travel_turns = std::max(out.travel_turns, std::abs(truth().motor_angle - from) / kTurn);
      if (out.fault == Fault::none && drive_->status().fault.fault != Fault::none) {
        out.fault = drive_->status().fault.fault;
        out.stage_fault = reason();
      }
      if (drive_->status().mode == Mode::fault && out.open_s < 0.0)
        out.open_s = static_cast<double>(stage.opened_at() - at) / board::ThreePhaseAmplifier::kPwmHz;
      if (drive_->status().mode == Mode::fault && truth().motor_velocity == 0.0) break;
    }
    out.peak_phase_a = stage.peak_phase_a();
    out.end_rad_s = std::abs(truth().motor_velocity);
    return out;
  }
  VirtualDrive& drive() { return *drive_; }

 private:
  static constexpr double kRampRadS2 = 200.0, kMsS = 1e-3;
  static constexpr std::uint32_t kMsTicks = kTickHz / 1000;

  const plant::State& truth() const { return drive_->rig().truth(); }
  firmware::StageFault reason() const { return static_cast<firmware::StageFault>(drive_->status().fault.limit); }
  double speed() const { return cell_.speed_share * demo_drive().rated_velocity_rad_s; }
  Command command(Command::Kind kind) const {
    Command c = cell_.mode == Mode::current    ? arm_current(cell_.direction * set_)
                : cell_.mode == Mode::velocity ? arm_velocity(cell_.direction * set_)
                                               : arm_position(position_);
    if (cell_.mode == Mode::position) {
      c.stream = true;
      c.velocity = N::value(cell_.direction * set_ / demo_constants().velocity_base);
    }
    c.kind = kind;
    return c;
  }
  // A millisecond of the host.
  void goes_on() {
    constexpr double kCurrentA = 3.0;
    set_ = cell_.mode == Mode::current ? kCurrentA : std::min(speed(), set_ + kRampRadS2 * kMsS);
    position_ += cell_.direction * set_ * kMsS / kTurn;
    drive_->post(command(Command::Kind::set));
  }
  // Up to speed.
  void begin() {
    constexpr double kSettleS = 0.1;
    drive_->run(1000);  // zeros of the current sensors
    if (drive_->command(command(Command::Kind::arm)).refusal != Refusal::none) return;
    if (cell_.load == CellLoad::gravity) drive_->rig().set_load_torque(gravity_nm(cell_.mode, cell_.speed_share));
    const double all_s = cell_.mode == Mode::current ? 2.0 : speed() / kRampRadS2 + 2.0 * kSettleS;
    for (double t = 0.0; t < all_s; t += kMsS) {
      goes_on();
      drive_->run(kMsTicks);
      if (cell_.mode == Mode::current && cell_.direction * truth().motor_velocity >= speed()) return;
    }
  }

  StageFaultCell cell_;
  std::unique_ptr<VirtualDrive> drive_;
  double set_ = 0.0;
  double position_ = 0.0;
};

inline std::vector<StageFaultCell> stage_cells(const std::vector<double>& speed_shares,
                                               const std::vector<std::uint64_t>& seeds) {
  std::vector<StageFaultCell> cells;
  for (const StageFaultKind& kind : stage_faults())
    for (const Mode mode : {Mode::current, Mode::velocity, Mode::position})
      for (const CellLoad load : {CellLoad::free, CellLoad::inertia, CellLoad::gravity})
        for (const double share : speed_shares)
          for (const int direction : {1, -1})
            for (const std::uint64_t seed : seeds) cells.push_back({&kind, mode, share, direction, load, seed});
  return cells;
}

}  // namespace flexspline::tests
