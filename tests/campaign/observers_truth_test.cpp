// Estimates of the drive from its sensors, compared with the true state of the plant and with estimates without an
// observer: in closed loop, with the sensors' noise and counts, in the drive's own numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "hil/board/drive_setup.hpp"
#include "hil/board/scenario.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests::observers_truth_test {
namespace {

using board::SoftwareBoard;
using firmware::Channel;
using firmware::N;

constexpr std::uint32_t kTickHz = SoftwareBoard::kTickHz;
constexpr double kTickS = 1.0 / kTickHz;

// At one tick: what is so, what the drive says, and the readings that it has.
struct Sight {
  double velocity = 0.0, acceleration = 0.0;  // of the motor
  double torsion = 0.0, output = 0.0, torque = 0.0;
  double load = 0.0;  // on the output; what the drive says of it is at the motor
  double motor = 0.0;
};
struct Seen {
  std::vector<Sight> truth, drive;
  std::vector<double> counts_rad;  // the motor's encoder
  double gear_ratio = 1.0;
};

struct Bench {
  std::string scenario = "sine";
  double seconds = 4.0;
  bool output_encoder = true;
  std::vector<std::string> with{};
  double load_amplitude_nm = 0.0, load_hz = 1.0;  // unknown to the drive
};

double value(std::uint32_t word, double base) {
  return std::ldexp(static_cast<double>(static_cast<std::int32_t>(word)), -fixed::kValueBits) * base;
}
double turns(std::uint32_t whole, std::uint32_t part) {
  return static_cast<double>(static_cast<std::int32_t>(whole)) + std::ldexp(static_cast<double>(part), -32);
}

Seen look(const Bench& bench) {
  plant::Drive drive = plant::demo_plant().drive;
  for (const std::string& effect : bench.with) plant::with(drive, effect);
  const auto d = board::constants_of(drive);
  auto setup = board::setup_of(drive);
  if (!bench.output_encoder) setup.output_counts = 0;
  const firmware::TelemetrySetup telemetry{
      .every = 1,
      .count = 7,
      .channels = {Channel::velocity, Channel::acceleration, Channel::torsion, Channel::output_turns,
                   Channel::output_fraction, Channel::torque, Channel::disturbance}};
  const double start = board::initial_turns(7801);
  board::VirtualDrive twin({.drive = drive, .seed = 7801, .start_turns = start},
                           board::Block(board::parameters_of(drive, setup), d), telemetry);
  twin.keep_frames(true);
  twin.run(100);
  const board::Scenario& motion = board::scenario(bench.scenario);
  const auto command = [&](firmware::Command::Kind kind, double time_s) {
    const board::Reference r = motion.at(time_s);
    firmware::Command c;
    c.kind = kind;
    c.mode = firmware::Mode::position;
    c.compensate = c.stream = true;
    c.position = {std::llround(std::ldexp(r.position * d.gear_ratio / kTurn + start, 32))};
    c.velocity = N::value(r.velocity * d.gear_ratio / d.velocity_base);
    c.acceleration = N::value(r.acceleration * d.gear_ratio / d.acceleration_base);
    return c;
  };
  EXPECT_EQ(twin.command(command(firmware::Command::Kind::arm, 0.0)).refusal, firmware::Refusal::none);
  Seen seen;
  seen.gear_ratio = d.gear_ratio;
  double before = 0.0;
  for (std::uint32_t k = 1; k <= static_cast<std::uint32_t>(bench.seconds * kTickHz); ++k) {
    const double time_s = k * kTickS;
    twin.rig().set_load_torque(bench.load_amplitude_nm * std::sin(kTurn * bench.load_hz * time_s));
    if (k % (kTickHz / 1000) == 0) twin.post(command(firmware::Command::Kind::set, time_s));
    // The sensors are read at the beginning of a tick.
    const plant::State& state = twin.rig().truth();
    Sight truth;
    truth.velocity = state.motor_velocity;
    truth.acceleration = (state.motor_velocity - before) / kTickS;
    truth.motor = state.motor_angle;
    truth.output = state.output_angle;
    truth.torsion = state.motor_angle / d.gear_ratio - state.output_angle;
    truth.torque = twin.rig().torque_nm();
    truth.load = twin.rig().load_torque_nm();
    before = state.motor_velocity;
    const double counts = drive.sensors.motor_counts;
    const double reading = std::round(state.motor_angle / kTurn * counts) / counts * kTurn;
    twin.run(1);
    if (time_s < 1.0 || twin.frames().empty()) continue;
    const auto& words = twin.frames().back().values;
    seen.truth.push_back(truth);
    seen.counts_rad.push_back(reading);
    seen.drive.push_back({.velocity = value(words[0], d.velocity_base),
                          .acceleration = value(words[1], d.acceleration_base),
                          .torsion = value(words[2], d.torsion_base),
                          .output = turns(words[3], words[4]) * kTurn,
                          .torque = value(words[5], d.output_torque_base),
                          .load = value(words[6], d.torque_base)});
  }
  EXPECT_EQ(twin.status().mode, firmware::Mode::position);
  return seen;
}

double rms(std::size_t from, std::size_t to, const std::function<double(std::size_t)>& error) {
  double sum = 0.0;
  for (std::size_t k = from; k < to; ++k) sum += error(k) * error(k);
  return std::sqrt(sum / static_cast<double>(to - from));
}
double rms_of(const Seen& seen, double Sight::*what) {
  return rms(2, seen.truth.size(), [&](std::size_t k) { return seen.drive[k].*what - seen.truth[k].*what; });
}

// One row of the table in shared/observers/README.md.
void expect_row(const char* what, const char* unit, double observer, double without, double least, double most) {
  std::printf("%-34s %-8s observer %.3g, without %.3g, share %.3g\n", what, unit, observer, without,
              observer / without);
  EXPECT_LT(observer / without, most) << what;
  EXPECT_GT(observer / without, least) << what;
}

TEST(ObserversAndTruth, VelocityAndAccelerationFromCounts) {
  for (const auto& [scenario, velocity_most, acceleration_most] :
       {std::tuple{"sine", 0.015, 3e-4}, {"slow-reversals", 0.015, 3e-4}, {"trapezoid", 0.03, 8e-4}}) {
    const Seen seen = look({.scenario = scenario});
    const auto difference = [&](std::size_t k) { return (seen.counts_rad[k] - seen.counts_rad[k - 1]) / kTickS; };
    const double plain =
        rms(2, seen.truth.size(), [&](std::size_t k) { return difference(k) - seen.truth[k].velocity; });
    const double second = rms(2, seen.truth.size(), [&](std::size_t k) {
      return (difference(k) - difference(k - 1)) / kTickS - seen.truth[k].acceleration;
    });
    expect_row((std::string("velocity, ") + scenario).c_str(), "rad/s", rms_of(seen, &Sight::velocity), plain, 3e-3,
               velocity_most);
    expect_row((std::string("acceleration, ") + scenario).c_str(), "rad/s^2", rms_of(seen, &Sight::acceleration),
               second, 5e-5, acceleration_most);
  }
}

// Without an encoder at the output a stiff gear is the plain guess: its error is the torsion itself.
TEST(ObserversAndTruth, TorsionAndOutputWithoutAnEncoderThere) {
  const Seen seen = look({.scenario = "sine",
                          .seconds = 8.0,
                          .output_encoder = false,
                          .with = {"gravity"},
                          .load_amplitude_nm = 4.0,
                          .load_hz = 0.5});
  const double stiff = rms(0, seen.truth.size(),
                           [&](std::size_t k) { return seen.truth[k].motor / seen.gear_ratio - seen.truth[k].output; });
  expect_row("torsion, no output encoder", "rad", rms_of(seen, &Sight::torsion), stiff, 0.2, 0.6);
  expect_row("output, no output encoder", "rad", rms_of(seen, &Sight::output), stiff, 0.2, 0.6);
}

TEST(ObserversAndTruth, TorqueWithoutTheSensorsRipple) {
  const Seen with = look({.scenario = "sine", .seconds = 12.0, .with = {"torque_sensor_ripple"}});
  const std::size_t half = with.truth.size() / 2;
  const plant::Drive demo = plant::demo_plant().drive;
  double cosine = 0.0, sine = 0.0, order = 0.0;
  for (const plant::Effect& effect : demo.effects)
    if (effect.type == "torque_sensor_ripple") {
      cosine = effect.value("cosine");
      sine = effect.value("sine");
      order = effect.value("order");
    }
  ASSERT_GT(std::hypot(cosine, sine), 0.0);
  // The filter passes the noise of the sensor; the ripple alone is tested, so both are taken at its frequency.
  const auto share = [&](const std::function<double(std::size_t)>& error) {
    double c = 0.0, s = 0.0;
    for (std::size_t k = half; k < with.truth.size(); ++k) {
      c += error(k) * std::cos(order * with.truth[k].motor);
      s += error(k) * std::sin(order * with.truth[k].motor);
    }
    return std::numbers::sqrt2 * std::hypot(c, s) / static_cast<double>(with.truth.size() - half);
  };
  expect_row("ripple of the torque sensor", "N*m",
             share([&](std::size_t k) { return with.drive[k].torque - with.truth[k].torque; }),
             std::hypot(cosine, sine) / std::numbers::sqrt2, 0.02, 0.15);
}

// A torque on the output that stands in no model, at the motor a hundredth of it: without an observer it is not known.
TEST(ObserversAndTruth, DisturbanceThatNoModelKnows) {
  const Seen seen = look({.scenario = "sine", .seconds = 6.0, .load_amplitude_nm = 4.0, .load_hz = 1.0});
  const double none = rms(0, seen.truth.size(), [&](std::size_t k) { return seen.truth[k].load / seen.gear_ratio; });
  const double observer = rms(0, seen.truth.size(),
                              [&](std::size_t k) { return seen.drive[k].load - seen.truth[k].load / seen.gear_ratio; });
  expect_row("disturbance, at the motor", "N*m", observer, none, 0.02, 0.12);
}

}  // namespace
}  // namespace flexspline::tests::observers_truth_test
