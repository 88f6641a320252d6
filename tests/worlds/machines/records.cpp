#include "tests/worlds/machines/records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexspline::worlds::machines {
namespace {

constexpr double kWarmUp_s = 15.0;
constexpr double kStress = 2.5;  // of the differences between records

bool is_slow(Kind kind) {
  return kind == Kind::telescope || kind == Kind::satellite;
}
bool is_cobot(Kind kind) {
  return kind == Kind::cobot_with_torque_sensors || kind == Kind::cobot_without_output_encoder;
}

std::size_t ticks(double seconds) {
  return static_cast<std::size_t>(seconds * kControlRate_hz);
}

// Of the bench's load machine: a brake, a weight on a rope, or a drive that follows a wave.
Signal bench_load(const Machine& m, const Inputs& in, double duration_s, Dice& dice) {
  const std::size_t size = in.angle_rad.size();
  const double amplitude = m.bench_torque_nm * dice.between(0.3, 1.0);
  const std::size_t type = dice.below(4);
  if (type == 0) {
    std::vector<double> levels(static_cast<std::size_t>(duration_s) + 2);
    for (double& v : levels) v = dice.between(0.0, 1.0);
    Signal level(size);
    for (std::size_t k = 0; k < size; ++k)
      level[k] = levels[static_cast<std::size_t>(static_cast<double>(k) / kControlRate_hz)];
    level = smoothed(level, ticks(0.3));
    for (std::size_t k = 0; k < size; ++k)
      level[k] *= amplitude * std::tanh(in.velocity_rad_s[k] / (0.02 * m.limits.velocity_rad_s));
    return level;
  }
  if (type == 1) return Signal(size, amplitude * dice.sign());
  Signal torque = smoothed(coloured_noise(size, kControlRate_hz, 0.4, dice), ticks(0.3));
  const double rate = kTurn_rad * dice.between(0.05, 0.4), phase = dice.angle();
  for (std::size_t k = 0; k < size; ++k)
    torque[k] = amplitude * (std::sin(rate * static_cast<double>(k) / kControlRate_hz + phase) + 0.3 * torque[k]);
  return torque;
}

void draw_load(const Machine& m, Inputs& in, double duration_s, Dice& dice) {
  const std::size_t size = in.angle_rad.size();
  in.output_torque_nm.assign(size, 0.0);
  if (m.human_torque_nm > 0.0) {
    in.output_torque_nm = smoothed(coloured_noise(size, kControlRate_hz, 0.5, dice), ticks(0.3));
    for (double& v : in.output_torque_nm) v *= m.human_torque_nm;
  }
  if (m.bench_torque_nm > 0.0) in.output_torque_nm = bench_load(m, in, duration_s, dice);
  in.known_output_torque_nm = in.output_torque_nm;
  // What the wearer does is estimated, not known.
  if (m.human_torque_nm > 0.0)
    for (double& v : in.known_output_torque_nm) v *= 0.9;
}

// Even times with jitter; the stamps either are the true times or the even ones.
void draw_samples(const Machine& m, Record& record, Dice& dice) {
  const Sensors& s = m.sensors;
  Inputs& in = record.inputs;
  const auto size =
      static_cast<std::size_t>(static_cast<double>(in.angle_rad.size() - 2) / kControlRate_hz * s.sample_hz);
  std::vector<double> even(size);
  for (std::size_t k = 0; k < size; ++k) {
    even[k] = (static_cast<double>(k) + 0.3) / s.sample_hz;
    const double off = std::clamp(s.jitter * dice.normal(), -0.35, 0.35) / s.sample_hz;
    auto step = static_cast<std::size_t>(std::max(0.0, even[k] + off) / m.plant.step_s + 0.5);
    if (k > 0) step = std::max(step, in.sample_step.back() + 1);
    in.sample_step.push_back(step);
  }
  for (std::size_t k = 0; k < size; ++k) {
    const double since = static_cast<double>(in.sample_step[k] - in.sample_step[0]) * m.plant.step_s;
    record.stamp_s.push_back(s.stamps_are_true ? since : even[k] - even[0]);
  }
}

Record draw_record(const Machine& m, Motion motion, double start_temperature_c, Dice& dice) {
  Record record;
  record.motion = motion;
  record.start_temperature_c = start_temperature_c;
  const double duration_s = is_slow(m.kind) ? dice.between(25, 40) : dice.between(10, 25);
  const MotionLimits limits = {m.limits.velocity_rad_s * dice.between(0.5, 1.0),
                               m.limits.acceleration_rad_s2 * dice.between(0.5, 1.0),
                               m.limits.range_rad * dice.between(0.5, 1.0)};
  Reference r = draw_reference(motion, duration_s, limits, dice);
  // Arms work around different poses, so that gravity differs.
  const double pose = is_cobot(m.kind) ? 0.6 * m.plant.gear.ratio * dice.between(-0.5, 0.5) : 0.0;
  for (double& v : r.angle_rad) v += pose;
  Inputs& in = record.inputs;
  in.angle_rad = std::move(r.angle_rad);
  in.velocity_rad_s = std::move(r.velocity_rad_s);
  in.acceleration_rad_s2 = std::move(r.acceleration_rad_s2);
  draw_load(m, in, duration_s, dice);
  const double rise_c = dice.between(0.1, 1.2);
  for (std::size_t k = 0; k < in.angle_rad.size(); ++k) {
    const double time_s = static_cast<double>(k) / kControlRate_hz;
    in.temperature_c.push_back(start_temperature_c + rise_c * (1.0 - std::exp(-time_s / kWarmUp_s)));
    in.encoder_noise.push_back(dice.normal());
  }
  draw_samples(m, record, dice);
  const double stress = m.stress ? kStress : 1.0;
  in.viscous_factor = 1.0 + 0.01 * stress * dice.normal();
  in.coulomb_factor = 1.0 + 0.007 * stress * dice.normal();
  record.noise_seed = dice.word();
  return record;
}

}  // namespace

void draw_records(Machine& machine, Dice& dice) {
  std::vector<std::size_t> counts = {3, 4, 4, 5, 6};
  std::size_t count = counts[dice.below(counts.size())];
  const bool satellite = machine.kind == Kind::satellite;
  const double coldest_c = satellite ? dice.between(5, 25) : dice.between(20, 32);
  double spread_c = satellite ? dice.between(10, 25) : dice.between(4, 10);
  // An effect of the temperature needs records at several.
  if (machine.hidden && machine.hidden->effect.starts_with("temperature_")) {
    spread_c *= 1.3;
    count = std::max<std::size_t>(count, 4);
  }
  machine.plant.friction.reference_temperature_c = coldest_c + 0.5 * spread_c;
  std::vector<Motion> motions(kMotions.begin(), kMotions.end());
  dice.shuffle(motions);
  while (motions.size() < count) motions.push_back(kMotions[dice.below(kMotions.size())]);
  for (std::size_t k = 0; k < count; ++k) {
    const double temperature_c = coldest_c + spread_c * static_cast<double>(k) / static_cast<double>(count - 1);
    machine.fit.push_back(draw_record(machine, motions[k], temperature_c, dice));
    machine.fit.back().name = fmt::format("{}-{}", name_of(motions[k]), k + 1);
  }
  const std::size_t held_out = 1 + dice.below(2);
  for (std::size_t k = 0; k < held_out; ++k) {
    const Motion motion = kMotions[dice.below(kMotions.size())];
    const double temperature_c = coldest_c + spread_c * dice.between(0.0, 1.0);
    machine.holdout.push_back(draw_record(machine, motion, temperature_c, dice));
    machine.holdout.back().name = fmt::format("holdout-{}-{}", name_of(motion), k + 1);
  }
}

}  // namespace flexspline::worlds::machines
