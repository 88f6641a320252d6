#include "hil/board/scenario.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "firmware/fault_texts.hpp"
#include "hil/board/drive_setup.hpp"

namespace flexspline::board {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
using firmware::Channel;
using firmware::N;

Reference sine(double amplitude, double frequency_hz, double time_s) {
  const double w = kTurn * frequency_hz;
  return {amplitude * std::sin(w * time_s), amplitude * w * std::cos(w * time_s),
          -amplitude * w * w * std::sin(w * time_s)};
}
// From rest: the first second fades the motion in by 3 x^2 - 2 x^3.
template <class Motion>
Reference faded_in(double time_s, Motion motion) {
  const Reference r = motion(time_s);
  if (time_s >= 1.0) return r;
  const double x = time_s, f = x * x * (3.0 - 2.0 * x), df = 6.0 * x * (1.0 - x), ddf = 6.0 - 12.0 * x;
  return {f * r.position, f * r.velocity + df * r.position,
          f * r.acceleration + 2.0 * df * r.velocity + ddf * r.position};
}
Reference sum(const Reference& a, const Reference& b) {
  return {a.position + b.position, a.velocity + b.velocity, a.acceleration + b.acceleration};
}

Reference slow_reversals(double time_s) {
  return faded_in(time_s, [](double t) { return sine(0.02, 0.25, t); });
}
Reference plain_sine(double time_s) {
  return faded_in(time_s, [](double t) { return sine(0.2, 0.5, t); });
}
Reference joint_trajectory(double time_s) {
  return faded_in(time_s, [](double t) {
    return sum(sine(0.25, 0.2, t), sum(sine(0.08, 0.55, t + 0.3), sine(0.02, 1.3, t + 0.1)));
  });
}
Reference constant_slow(double time_s) {
  constexpr double kSpeed = 0.005, kRampS = 0.5;
  if (time_s >= kRampS) return {kSpeed * (time_s - kRampS / 2.0), kSpeed, 0.0};
  return {kSpeed * time_s * time_s / (2.0 * kRampS), kSpeed * time_s / kRampS, kSpeed / kRampS};
}
// To and fro with constant accelerations: speed up, go, slow down, and back the same way.
Reference trapezoid(double time_s) {
  constexpr double kPeriodS = 2.0, kAcceleration = 4.0;
  constexpr std::array<std::pair<double, double>, 6> kParts{
      {{0.125, 1.0}, {0.25, 0.0}, {0.125, -1.0}, {0.125, -1.0}, {0.25, 0.0}, {0.125, 1.0}}};
  double left = std::fmod(time_s, kPeriodS);
  Reference r;
  for (const auto& [share, sign] : kParts) {
    const double t = std::min(left, share * kPeriodS);
    r.acceleration = sign * kAcceleration;
    r.position += r.velocity * t + r.acceleration * t * t / 2.0;
    r.velocity += r.acceleration * t;
    left -= t;
    if (left <= 0.0) break;
  }
  return r;
}

constexpr std::array<std::pair<std::string_view, Injection>, 12> kInjections{
    {{"motor-encoder-stale", Injection::motor_encoder_stale},
     {"output-encoder-stale", Injection::output_encoder_stale},
     {"analog-stale", Injection::analog_stale},
     {"motor-encoder-stuck", Injection::motor_encoder_stuck},
     {"motor-encoder-jump", Injection::motor_encoder_jump},
     {"current-out-of-range", Injection::current_out_of_range},
     {"torque-out-of-range", Injection::torque_out_of_range},
     {"temperature-out-of-range", Injection::temperature_out_of_range},
     {"torque-stuck", Injection::torque_stuck},
     {"amplifier-dead", Injection::amplifier_dead},
     {"current-surge", Injection::current_surge},
     {"tick-overrun", Injection::tick_overrun}}};

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
  Host(const effects::DriveConstants<double>& d, const Scenario& scenario, bool compensation)
      : d_(d), scenario_(scenario), compensation_(compensation) {}

  firmware::Command command(firmware::Command::Kind kind, double time_s) const {
    const Reference r = scenario_.at(time_s);
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

 private:
  effects::DriveConstants<double> d_;
  const Scenario& scenario_;
  bool compensation_;
};

}  // namespace

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> all = {
      {"slow-reversals", "sine of 0.02 rad and 0.25 Hz: friction changes its side", slow_reversals},
      {"sine", "sine of 0.2 rad and 0.5 Hz", plain_sine},
      {"trapezoid", "to and fro by 1.5 rad, with accelerations of 4 rad/s^2", trapezoid},
      {"joint-trajectory", "three sines at once, as a robot's joint moves", joint_trajectory},
      {"constant-slow", "0.005 rad/s one way: ripple and stick-slip", constant_slow},
  };
  return all;
}

const Scenario& scenario(std::string_view name) {
  std::string known;
  for (const Scenario& s : scenarios()) {
    if (s.name == name) return s;
    known += (known.empty() ? "" : ", ") + std::string(s.name);
  }
  throw std::invalid_argument("no scenario '" + std::string(name) + "'; there are " + known);
}

ScenarioResult run_scenario(const ScenarioPlan& plan, std::unique_ptr<Brain> brain) {
  constexpr std::uint32_t kBootTicks = 100, kHostTicks = SoftwareBoard::kTickHz / 1000;
  const Scenario& motion = scenario(plan.scenario);
  const effects::DriveConstants<double> constants = plan.packed ? plan.packed->constants : constants_of(plan.drive);
  if (std::abs(constants.gear_ratio - plan.drive.gear_ratio) > 1e-6 * plan.drive.gear_ratio)
    throw std::runtime_error("the block was packed for a gear of " + std::to_string(constants.gear_ratio) +
                             ", the drive has one of " + std::to_string(plan.drive.gear_ratio));
  const Host host(constants, motion, plan.compensation);
  const auto started = std::chrono::steady_clock::now();
  const Block block =
      plan.packed ? Block(plan.packed->bytes) : Block(parameters_of(plan.drive, setup_of(plan.drive)), constants);
  VirtualDrive drive({.drive = plan.drive, .seed = plan.seed}, block, telemetry(), std::move(brain));
  drive.run(kBootTicks);
  const firmware::Answer armed = drive.command(host.command(firmware::Command::Kind::arm, 0.0));
  if (armed.refusal != firmware::Refusal::none)
    throw std::runtime_error("the drive cannot be armed: fault " +
                             std::string(firmware::info_of(drive.status().fault.fault).name));

  ScenarioResult result;
  result.compensation = plan.compensation;
  const auto ticks = static_cast<std::uint64_t>(std::llround(plan.duration_s * SoftwareBoard::kTickHz));
  const auto inject_at = static_cast<std::uint64_t>(std::llround(plan.injection_s * SoftwareBoard::kTickHz));
  double error_squares = 0.0, current_squares = 0.0;
  std::uint64_t judged = 0;
  for (std::uint64_t k = 1; k <= ticks; ++k) {
    const double time_s = static_cast<double>(k) / SoftwareBoard::kTickHz;
    if (plan.injection && k == inject_at) drive.rig().inject(*plan.injection);
    if (k % kHostTicks == 0) drive.post(host.command(firmware::Command::Kind::set, time_s));
    const double output = drive.rig().truth().output_angle;
    drive.run(1);
    if (time_s <= 1.0) continue;
    const double error = output - motion.at(time_s).position;
    error_squares += error * error;
    result.peak_error_rad = std::max(result.peak_error_rad, std::abs(error));
    current_squares += drive.rig().current_a() * drive.rig().current_a();
    ++judged;
  }
  const double count = judged > 0 ? static_cast<double>(judged) : 1.0;
  result.rms_error_rad = std::sqrt(error_squares / count);
  result.rms_current_a = std::sqrt(current_squares / count);
  result.ticks = drive.status().tick;
  result.frames = drive.frame_count();
  result.telemetry_hash = drive.telemetry_hash();
  result.end = drive.status();
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

std::optional<Injection> injection_named(std::string_view name) {
  for (const auto& [known, injection] : kInjections)
    if (known == name) return injection;
  return {};
}
std::vector<std::string_view> injection_names() {
  std::vector<std::string_view> names;
  for (const auto& [name, injection] : kInjections) names.push_back(name);
  return names;
}

}  // namespace flexspline::board
