#include "hil/board/scenario.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "firmware/fault_texts.hpp"
#include "hil/board/drive_setup.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::board {
namespace {

using firmware::Channel;
using firmware::N;

firmware::TelemetrySetup telemetry() {
  return {
      .every = 1,
      .count = 12,
      .channels = {Channel::state, Channel::motor_turns, Channel::motor_fraction, Channel::output_fraction,
                   Channel::velocity, Channel::output_velocity, Channel::torque, Channel::current, Channel::disturbance,
                   Channel::feedforward_torque, Channel::command_torque, Channel::command_current}};
}

class Host {
 public:
  Host(const effects::DriveConstants<double>& d, bool compensation) : d_(d), compensation_(compensation) {}

  firmware::Command command(firmware::Command::Kind kind, const Reference& r) const {
    firmware::Command c;
    c.kind = kind;
    c.mode = firmware::Mode::position;
    c.compensate = compensation_;
    c.stream = true;
    c.position = {std::llround(std::ldexp(r.position * d_.gear_ratio / kTurn, 32))};
    c.velocity = N::value(r.velocity * d_.gear_ratio / d_.velocity_base);
    c.acceleration = N::value(r.acceleration * d_.gear_ratio / d_.acceleration_base);
    return c;
  }
  // The host's work in a millisecond in which it received this status: it arms a drive again that was away.
  firmware::Command next(const firmware::Status& status, const Reference& r) const {
    using Kind = firmware::Command::Kind;
    if (status.mode == firmware::Mode::idle) return command(Kind::arm, r);
    if (status.mode == firmware::Mode::fault && status.fault.fault == firmware::Fault::host_lost)
      return command(Kind::clear_fault, r);
    return command(Kind::set, r);
  }

 private:
  effects::DriveConstants<double> d_;
  bool compensation_;
};

// The motion, from the output's angle at power-on, and after it the hold: from the velocity at its end to rest within a
// quarter of a second.
class MotionAndHold {
 public:
  MotionAndHold(const Scenario& motion, double duration_s, double from_rad)
      : motion_(motion), duration_s_(duration_s), from_rad_(from_rad) {}
  Reference at(double time_s) const {
    Reference r = from_its_start(time_s);
    r.position += from_rad_;
    return r;
  }

 private:
  Reference from_its_start(double time_s) const {
    if (time_s <= duration_s_) return motion_.at(time_s);
    constexpr double kStopS = 0.25;
    const Reference end = motion_.at(duration_s_);
    const double t = std::min(time_s - duration_s_, kStopS);
    const double stopping = t < kStopS ? -end.velocity / kStopS : 0.0;
    return {end.position + end.velocity * (t - t * t / (2.0 * kStopS)), end.velocity * (1.0 - t / kStopS), stopping};
  }

  const Scenario& motion_;
  double duration_s_, from_rad_;
};

// Waits until it has checked its sensors, brings it to the start of the motion unless it is there, and arms it.
// Returns the ticks.
std::uint32_t begin(VirtualDrive& drive, const Host& host, const Reference& start, std::uint32_t boot_ticks) {
  drive.run(boot_ticks);
  const firmware::Answer armed = drive.command(host.command(firmware::Command::Kind::arm, start));
  if (armed.refusal != firmware::Refusal::none)
    throw std::runtime_error("the drive cannot be armed: fault " +
                             std::string(firmware::info_of(drive.status().fault.fault).name));
  return boot_ticks + 1;
}

// Accumulates the measurements of a run, one a millisecond.
class RunMeasures {
 public:
  RunMeasures(const ScenarioPlan& plan, ScenarioResult& result) : plan_(plan), result_(result) {}

  void add(double time_s, const Reference& set, const PlantRig& rig) {
    const plant::State& state = rig.truth();
    const double error = state.output_angle - set.position, current = rig.current_a();
    result_.peak_current_a = std::max(result_.peak_current_a, std::abs(current));
    fastest_ = std::max(fastest_, std::abs(set.velocity));
    if (time_s <= plan_.duration_s) {
      if (time_s <= kSettleS) return;
      error_squares_ += error * error;
      result_.peak_error_rad = std::max(result_.peak_error_rad, std::abs(error));
      current_squares_ += current * current;
      ++samples_;
      const bool rests = state.motor_velocity == 0.0;
      if (rests && !rested_ && std::abs(set.velocity) > 0.1 * fastest_) ++result_.stops;
      rested_ = rests;
    } else if (time_s > plan_.duration_s + plan_.hold_s / 2.0) {
      low_ = std::min(low_, state.output_angle);
      high_ = std::max(high_, state.output_angle);
      error_sum_ += error;
      ++hold_samples_;
      if (state.motor_direction != 0) {
        if (direction_ != 0 && state.motor_direction != direction_) ++result_.hold_reversals;
        direction_ = state.motor_direction;
      }
    }
  }
  void finish() {
    const double count = samples_ > 0 ? static_cast<double>(samples_) : 1.0;
    result_.rms_error_rad = std::sqrt(error_squares_ / count);
    result_.rms_current_a = std::sqrt(current_squares_ / count);
    if (hold_samples_ == 0) return;
    result_.hold_swing_rad = 0.5 * (high_ - low_);
    result_.hold_error_rad = error_sum_ / static_cast<double>(hold_samples_);
  }

 private:
  static constexpr double kSettleS = 1.0;
  const ScenarioPlan& plan_;
  ScenarioResult& result_;
  double error_squares_ = 0.0, current_squares_ = 0.0, error_sum_ = 0.0, fastest_ = 0.0;
  double low_ = 1e300, high_ = -1e300;
  std::uint64_t samples_ = 0, hold_samples_ = 0;
  int direction_ = 0;
  bool rested_ = false;
};

Motion of_sines(std::vector<Motion::Sine> sines) {
  Motion m;
  m.sines = std::move(sines);
  return m;
}
Motion constant_slow() {
  Motion m;
  m.kind = Motion::Kind::constant;
  m.velocity_rad_s = 0.005;
  return m;
}
Motion trapezoid() {
  Motion m;
  m.kind = Motion::Kind::trapezoid;
  m.acceleration_rad_s2 = 4.0;
  m.period_s = 2.0;
  return m;
}

RigSetup rig_of(const ScenarioPlan& plan, double start_turns) {
  return {.drive = plan.drive,
          .seed = plan.seed,
          .tick_hz = plan.tick_hz,
          .noise = plan.noise,
          .start_turns = start_turns,
          .three_phase = plan.three_phase};
}
// A three-phase drive measures its current sensors' zero first.
std::uint32_t boot_ticks_of(const ScenarioPlan& plan) {
  return plan.three_phase ? 1100 : 100;
}

TracePoint traced(double time_s, const Reference& set, const VirtualDrive& drive, double load_torque_nm) {
  const PlantRig& rig = drive.rig();
  return {time_s,
          set,
          rig.truth().output_angle,
          rig.truth().motor_velocity,
          rig.torque_nm(),
          rig.current_a(),
          rig.temperature_c(),
          load_torque_nm,
          drive.status().mode};
}

}  // namespace

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> all = {
      {"slow-reversals", "sine of 0.02 rad and 0.25 Hz: friction changes its sign", of_sines({{0.02, 0.25, 0.0}})},
      {"sine", "sine of 0.2 rad and 0.5 Hz", of_sines({{0.2, 0.5, 0.0}})},
      {"trapezoid", "back and forth by 1.5 rad, with accelerations of 4 rad/s^2", trapezoid()},
      {"joint-trajectory", "three sines at once, as a robot's joint moves",
       of_sines({{0.25, 0.2, 0.0}, {0.08, 0.55, 0.3}, {0.02, 1.3, 0.1}})},
      {"constant-slow", "0.005 rad/s one way: ripple and stick-slip", constant_slow()},
  };
  return all;
}

const Scenario& scenario(std::string_view name) {
  std::string known;
  for (const Scenario& s : scenarios()) {
    if (s.name == name) return s;
    known += (known.empty() ? "" : ", ") + s.name;
  }
  throw std::invalid_argument("no scenario '" + std::string(name) + "'; there are " + known);
}

ScenarioResult run_scenario(const ScenarioPlan& plan, std::unique_ptr<Controller> controller) {
  if (plan.tick_hz < 4'000 || plan.tick_hz > 40'000 || plan.tick_hz % 1000 != 0)
    throw std::invalid_argument("a drive of " + std::to_string(plan.tick_hz) +
                                " ticks a second cannot be simulated; take a multiple of 1000 from 4000 to 40000");
  const std::uint32_t host_ticks = plan.tick_hz / 1000;
  const Scenario motion = plan.motion ? *plan.motion : scenario(plan.scenario);
  ScenarioResult result;
  result.start_turns = plan.start_turns.value_or(initial_turns(plan.seed));
  const MotionAndHold motion_and_hold(motion, plan.duration_s, kTurn * result.start_turns / plan.drive.gear_ratio);
  const effects::DriveConstants<double> constants =
      plan.packed ? plan.packed->constants : constants_of(plan.drive, plan.tick_hz);
  if (std::abs(constants.gear_ratio - plan.drive.gear_ratio) > 1e-6 * plan.drive.gear_ratio)
    throw std::runtime_error("the block was packed for a gear of " + std::to_string(constants.gear_ratio) +
                             ", the drive has one of " + std::to_string(plan.drive.gear_ratio));
  const Host host(constants, plan.compensation);
  const auto started = std::chrono::steady_clock::now();
  const Block block = plan.packed ? Block(plan.packed->bytes)
                                  : Block(parameters_of(plan.drive, setup_of(plan.drive, constants)), constants);
  VirtualDrive drive(rig_of(plan, result.start_turns), block, telemetry(), std::move(controller));
  drive.rig().set_load_torque(plan.load_torque_nm);
  const std::uint32_t begun = begin(drive, host, motion_and_hold.at(0.0), boot_ticks_of(plan));

  result.compensation = plan.compensation;
  EventScript script(plan.events);
  RunMeasures measures(plan, result);
  const auto ticks = static_cast<std::uint64_t>(std::llround((plan.duration_s + plan.hold_s) * plan.tick_hz));
  const auto inject_at = static_cast<std::uint64_t>(std::llround(plan.injection_s * plan.tick_hz));
  for (std::uint64_t k = 1; k <= ticks; ++k) {
    const double time_s = static_cast<double>(k) / plan.tick_hz;
    if (plan.injection && k == inject_at) drive.rig().inject(*plan.injection);
    if (k % host_ticks == 0) {
      const Reference set = motion_and_hold.at(time_s);
      if (!script.empty()) {
        script.apply(time_s, plan.load_torque_nm, drive.rig());
        drive.power(!script.acts(Event::Kind::power_cut, time_s));
      }
      if (!script.acts(Event::Kind::usb_unplugged, time_s))
        drive.post(script.empty() ? host.command(firmware::Command::Kind::set, set) : host.next(drive.status(), set));
      measures.add(time_s, set, drive.rig());
      if (plan.keeps_trace) result.trace.push_back(traced(time_s, set, drive, drive.rig().load_torque_nm()));
      if (result.first_fault.fault == firmware::Fault::none) result.first_fault = drive.status().fault;
    }
    drive.run(1);
  }
  measures.finish();
  result.ticks = begun + ticks;
  result.frames = drive.frame_count();
  result.telemetry_hash = drive.telemetry_hash();
  result.end = drive.status();
  result.final_temperature_c = drive.rig().temperature_c();
  if (result.first_fault.fault == firmware::Fault::none) result.first_fault = result.end.fault;
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace flexspline::board
