// A record that shows every effect, and what an effect makes of it: shared by the tests of the catalogue's equations.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests {

using catalogue::Balance;
using catalogue::Dual;
using catalogue::Entry;
using catalogue::Kind;
using catalogue::Phase;
using catalogue::Real;
using effects::DriveConstants;
using effects::Inputs;
using numbers::Jet;

inline constexpr std::size_t kSamples = 1000;
inline constexpr double kSample = 1e-3;  // s
inline constexpr double kGearRatio = 100.0;
inline constexpr double kTorqueConstant = 0.0543;
inline constexpr double kRatedVelocity = 180.0;
inline constexpr double kReferenceTemperature = 25.0;

// What a sensor would say of one instant, SI, names as in the catalogue of effects.
struct Instant {
  double w, q, a, qo, wo, ao, dq, v, T, i, temp;
};
using Record = std::vector<Instant>;

inline double s(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

// A path of the motor with stops and reversals; other signals vary on their own so that no two terms look alike.
inline Record random_record(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Record record;
  double angle = 40.0 * unit(random);
  // Laws with memory follow the torsion and the current from sample to sample, so these are smooth; they reverse often,
  // stop now and then, and begin at zero.
  const double cycles = 0.8 + 0.2 * unit(random);
  std::size_t moved = 0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double phase = 2.0 * std::numbers::pi * cycles * static_cast<double>(moved) / kSamples;
    const double wave = (std::sin(phase) + 0.6 * std::sin(3.7 * phase)) / 1.6;
    if (k % 50 < 45) ++moved;
    const bool rest = k % 11 == 0;
    const bool slow = k % 3 == 0;
    const double velocity = rest ? 0.0 : (slow ? 6.0 : 200.0) * unit(random);
    angle += kSample * velocity;
    const double output_velocity = k % 7 == 0 ? 0.0 : 2.0 * unit(random);
    record.push_back({velocity, angle, 2000.0 * unit(random), 3.0 * unit(random), output_velocity, 20.0 * unit(random),
                      3e-3 * wave, k % 5 == 0 ? 0.0 : 0.1 * unit(random), 40.0 * unit(random), 8.0 * wave,
                      30.0 + 25.0 * unit(random)});
  }
  return record;
}

inline DriveConstants<double> si_drive() {
  DriveConstants<double> drive;
  drive.gear_ratio = kGearRatio;
  drive.torque_constant = kTorqueConstant;
  drive.rated_velocity = kRatedVelocity;
  drive.reference_temperature = kReferenceTemperature;
  return drive;
}

template <class N>
DriveConstants<typename N::Parameter> in_numbers(const DriveConstants<double>& d) {
  using P = typename N::Parameter;
  return {P(d.gear_ratio),
          P(d.torque_constant),
          P(d.rated_velocity),
          P(d.reference_temperature),
          P(d.turn_angle_scale),
          P(d.torque_base),
          P(d.output_torque_base),
          P(d.velocity_base),
          P(d.output_velocity_base),
          P(d.acceleration_base),
          P(d.output_acceleration_base),
          P(d.angle_base),
          P(d.torsion_base),
          P(d.torsion_rate_base),
          P(d.temperature_base),
          P(d.current_base),
          P(d.time_base)};
}

template <class N>
std::vector<Inputs<N>> inputs_of(const Record& record, const DriveConstants<double>& d) {
  using V = typename N::Value;
  std::vector<Inputs<N>> inputs;
  for (const Instant& x : record) {
    Inputs<N> in;
    in.angle = V(x.q / d.angle_base);
    in.velocity = V(x.w / d.velocity_base);
    in.speed = V(std::abs(x.w) / d.velocity_base);
    in.direction = V(s(x.w));
    in.acceleration = V(x.a / d.acceleration_base);
    in.output_angle = V(x.qo);
    in.output_velocity = V(x.wo / d.output_velocity_base);
    in.output_direction = V(s(x.wo));
    in.output_acceleration = V(x.ao / d.output_acceleration_base);
    in.torsion = V(x.dq / d.torsion_base);
    in.torsion_rate = V(x.v / d.torsion_rate_base);
    in.torsion_direction = V(s(x.v));
    in.torque = V(x.T / d.output_torque_base);
    in.torque_magnitude = V(std::abs(x.T) / d.output_torque_base);
    in.current = V(x.i / d.current_base);
    in.temperature = V(x.temp / d.temperature_base);
    in.viscous_scale = V(1.0);
    in.coulomb_scale = V(1.0);
    in.elapsed = V(kSample / d.time_base);
    inputs.push_back(in);
  }
  return inputs;
}

template <class N>
const catalogue::BlockFunctions<N>& along(const Entry& entry) {
  if constexpr (std::is_same_v<N, Dual>)
    return entry.dual;
  else
    return entry.real;
}

// What an effect does along a record: its torque on its own balance, or for a shift the torsion after it, or for a
// modulation the factor.
template <class N>
std::vector<typename N::Value> response(const Entry& entry, const std::vector<typename N::Parameter>& parameters,
                                        const Record& record, const DriveConstants<double>& drive = si_drive()) {
  std::vector<Inputs<N>> inputs = inputs_of<N>(record, drive);
  std::vector<typename N::Value> result(record.size(), typename N::Value(0.0));
  if (entry.info->phase == Phase::source) {
    along<N>(entry).torque(parameters.data(), in_numbers<N>(drive), entry.info->balance, inputs, result.data());
  } else {
    along<N>(entry).change(parameters.data(), in_numbers<N>(drive), inputs);
    for (std::size_t k = 0; k < inputs.size(); ++k)
      result[k] =
          entry.info->phase == Phase::shift ? inputs[k].torsion : inputs[k].viscous_scale * inputs[k].coulomb_scale;
  }
  return result;
}

}  // namespace flexspline::tests
