#include "host/estimation/record_signals.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::estimation {
namespace {

using catalogue::PlainInputs;
constexpr std::size_t kMotor = 0, kTransmission = 1, kLoad = 2;

}  // namespace

std::vector<double> ScaledSignal::values() const {
  std::vector<double> result(size());
  for (std::size_t k = 0; k < result.size(); ++k) result[k] = (*this)[k];
  return result;
}

double RecordSignals::direction_of(double rate, std::size_t balance) const {
  if (at_rest) return 0.0;
  const double width = velocity_noise[balance];
  return width > 0.0 ? std::tanh(rate / width) : catalogue::Real::sign(rate);
}

void RecordSignals::slopes(const std::vector<double>& signal, std::size_t first, std::span<double> slope) const {
  std::fill(slope.begin(), slope.end(), 0.0);
  const std::size_t end = first + slope.size();
  auto s = std::upper_bound(segments.begin(), segments.end(), first,
                            [](std::size_t k, const data::Segment& segment) { return k < segment.last; });
  const double scale = 0.5 / sample_s;
  for (; s != segments.end() && s->first < end; ++s) {
    // As signals::central_derivative of the segment.
    const std::size_t n = s->last - s->first;
    if (n < 2) continue;
    const double* x = signal.data() + s->first;
    for (std::size_t k = std::max(first, s->first); k < std::min(end, s->last); ++k) {
      const std::size_t i = k - s->first;
      double& to = slope[k - first];
      if (n == 2)
        to = (x[1] - x[0]) / sample_s;
      else if (i == 0)
        to = (4.0 * (x[1] - x[0]) - (x[2] - x[0])) * scale;
      else if (i == n - 1)
        to = (4.0 * (x[n - 1] - x[n - 2]) - (x[n - 1] - x[n - 3])) * scale;
      else
        to = (x[i + 1] - x[i - 1]) * scale;
    }
  }
}

void RecordSignals::copy(std::size_t first, std::span<Inputs> to, unsigned reads) const {
  using namespace effects;
  while (to.size() > PlainInputs::kBlock) {
    copy(first, to.first(PlainInputs::kBlock), reads);
    first += PlainInputs::kBlock;
    to = to.subspan(PlainInputs::kBlock);
  }
  std::array<double, PlainInputs::kBlock> slope;
  const auto along = [&](auto set) {
    for (std::size_t i = 0; i < to.size(); ++i) set(to[i], first + i);
  };
  const auto accelerations = [&](const std::vector<double>& own, const std::vector<double>& velocities) {
    if (!own.empty())
      std::copy_n(own.begin() + static_cast<std::ptrdiff_t>(first), to.size(), slope.begin());
    else
      slopes(velocities, first, std::span(slope).first(to.size()));
  };
  const auto direction = [&](std::size_t balance, double Inputs::*what, auto rate) {
    const std::vector<double>& kept = directions[balance];
    if (!kept.empty())
      along([&](Inputs& in, std::size_t k) { in.*what = kept[k]; });
    else
      along([&](Inputs& in, std::size_t k) { in.*what = direction_of(rate(k), balance); });
  };

  along([&](Inputs& in, std::size_t) {
    in.viscous_scale = in.coulomb_scale = 1.0;
    in.elapsed = sample_s;
  });
  const bool follows = output_velocity.empty() && !locked;
  if (reads & (kMotorMotion | kMotorAngle)) {
    if (velocity.empty()) {
      along([](Inputs& in, std::size_t) { in.angle = in.velocity = in.speed = in.acceleration = 0.0; });
    } else {
      accelerations(acceleration, velocity);
      along([&](Inputs& in, std::size_t k) {
        in.angle = angle[k];
        in.velocity = velocity[k];
        in.speed = std::abs(velocity[k]);
        in.acceleration = slope[k - first];
      });
    }
    direction(kMotor, &Inputs::direction, [&](std::size_t k) { return velocity_at(k); });
  }
  if (reads & (kOutputMotion | kOutputAngle)) {
    along([&](Inputs& in, std::size_t k) {
      in.output_angle = output_angle_at(k);
      in.output_velocity = output_velocity_at(k);
      in.output_acceleration = 0.0;
    });
    const bool moves = follows ? !velocity.empty() : !output_velocity.empty();
    if (moves) {
      // Without a sensor the output follows the motor through a rigid gear.
      if (follows)
        accelerations(acceleration, velocity);
      else
        accelerations(output_acceleration, output_velocity);
      const double over = follows ? gear_ratio : 1.0;
      along([&](Inputs& in, std::size_t k) { in.output_acceleration = slope[k - first] / over; });
    }
    direction(kLoad, &Inputs::output_direction, [&](std::size_t k) { return output_velocity_at(k); });
  }
  if (reads & kTorsion) {
    along([&](Inputs& in, std::size_t k) {
      in.torsion = torsion_at(k);
      in.torsion_rate = torsion_rate_at(k);
    });
    direction(kTransmission, &Inputs::torsion_direction, [&](std::size_t k) { return torsion_rate_at(k); });
  }
  if (reads & kTorque)
    along([&](Inputs& in, std::size_t k) {
      in.torque = torque_at(k);
      in.torque_magnitude = std::abs(in.torque);
    });
  if (reads & kCurrent) along([&](Inputs& in, std::size_t k) { in.current = current.empty() ? 0.0 : current[k]; });
  if (reads & kTemperature) along([&](Inputs& in, std::size_t k) { in.temperature = temperature_at(k); });
}

RecordSignals::Inputs RecordSignals::at(std::size_t sample, unsigned reads) const {
  Inputs in;
  copy(sample, {&in, 1}, reads);
  return in;
}

PlainInputs RecordSignals::all(unsigned reads) const {
  return {this, size_, reads, [](const void* record, std::size_t first, std::span<Inputs> to, unsigned what) {
            static_cast<const RecordSignals*>(record)->copy(first, to, what);
          }};
}

RecordSignals RecordSignals::every(std::size_t step) const {
  RecordSignals few;
  few.sample_s = sample_s * static_cast<double>(step);
  few.gear_ratio = gear_ratio;
  few.reference_temperature = reference_temperature;
  few.torsion_zero = torsion_zero;
  few.locked = locked;
  few.at_rest = at_rest;
  few.velocity_noise = velocity_noise;
  const bool moves = !velocity.empty(), output_moves = !output_velocity.empty();
  std::vector<double> currents;
  const auto keep = [](bool whether, std::vector<double>& list, double value) {
    if (whether) list.push_back(value);
  };
  for (const data::Segment& s : segments) {
    const std::size_t first = few.size_;
    for (std::size_t k = s.first; k < s.last; k += step, ++few.size_) {
      const Inputs in = (*this)[k];
      keep(moves, few.angle, in.angle);
      keep(moves, few.velocity, in.velocity);
      keep(moves, few.acceleration, in.acceleration);
      keep(output_moves, few.output_angle, in.output_angle);
      keep(output_moves, few.output_velocity, in.output_velocity);
      keep(output_moves, few.output_acceleration, in.output_acceleration);
      keep(!torque.empty(), few.torque, in.torque);
      keep(!temperature.empty(), few.temperature, in.temperature);
      keep(!current.empty(), currents, in.current);
      few.directions[kMotor].push_back(in.direction);
      few.directions[kTransmission].push_back(in.torsion_direction);
      few.directions[kLoad].push_back(in.output_direction);
    }
    few.segments.push_back({first, few.size_});
  }
  if (!currents.empty()) few.current = ScaledSignal(std::move(currents));
  return few;
}

void RecordSignals::keep_directions() {
  constexpr std::size_t kMost = std::size_t{1} << 19;
  if (size_ > kMost) return;
  for (std::vector<double>& kept : directions) kept.resize(size_);
  for (std::size_t k = 0; k < size_; ++k) {
    directions[kMotor][k] = direction_of(velocity_at(k), kMotor);
    directions[kTransmission][k] = direction_of(torsion_rate_at(k), kTransmission);
    directions[kLoad][k] = direction_of(output_velocity_at(k), kLoad);
  }
}

}  // namespace flexspline::estimation
