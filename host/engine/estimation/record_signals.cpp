#include "host/engine/estimation/record_signals.hpp"

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

namespace {

// One block of samples, from `first` on. `slopes` and `direction_of` are those of the signals.
template <class Slopes, class Direction>
class InputBlock {
 public:
  using Inputs = RecordSignals::Inputs;

  InputBlock(const RecordSignals& signals, std::size_t first, std::span<Inputs> to, Slopes slopes,
             Direction direction_of)
      : s_(signals), first_(first), to_(to), slopes_(slopes), direction_of_(direction_of) {}

  void copy_motor() {
    if (s_.velocity.empty()) {
      along([](Inputs& in, std::size_t) { in.angle = in.velocity = in.speed = in.acceleration = 0.0; });
    } else {
      find_slope(s_.acceleration, s_.velocity);
      along([&](Inputs& in, std::size_t k) {
        in.angle = s_.angle[k];
        in.velocity = s_.velocity[k];
        in.speed = std::abs(s_.velocity[k]);
        in.acceleration = slope_[k - first_];
      });
    }
  }
  void copy_motor_direction() {
    copy_direction(kMotor, &Inputs::direction, [&](std::size_t k) { return s_.velocity_at(k); });
  }

  void copy_output() {
    along([&](Inputs& in, std::size_t k) {
      in.output_angle = s_.output_angle_at(k);
      in.output_velocity = s_.output_velocity_at(k);
      in.output_acceleration = 0.0;
    });
    // Without a sensor the output follows the motor through a rigid gear.
    const bool follows = s_.output_velocity.empty() && !s_.locked;
    const bool moves = follows ? !s_.velocity.empty() : !s_.output_velocity.empty();
    if (moves) {
      if (follows)
        find_slope(s_.acceleration, s_.velocity);
      else
        find_slope(s_.output_acceleration, s_.output_velocity);
      const double over = follows ? s_.gear_ratio : 1.0;
      along([&](Inputs& in, std::size_t k) { in.output_acceleration = slope_[k - first_] / over; });
    }
    copy_direction(kLoad, &Inputs::output_direction, [&](std::size_t k) { return s_.output_velocity_at(k); });
  }

  void copy_torsion() {
    along([&](Inputs& in, std::size_t k) {
      in.torsion = s_.torsion_at(k);
      in.torsion_rate = s_.torsion_rate_at(k);
    });
    copy_direction(kTransmission, &Inputs::torsion_direction, [&](std::size_t k) { return s_.torsion_rate_at(k); });
  }

  // Calls set(inputs, sample) for each sample.
  template <class Set>
  void along(const Set& set) const {
    for (std::size_t i = 0; i < to_.size(); ++i) set(to_[i], first_ + i);
  }

 private:
  // Of the accelerations that are known, else of the velocities.
  void find_slope(const std::vector<double>& own, const std::vector<double>& velocities) {
    if (!own.empty())
      std::copy_n(own.begin() + static_cast<std::ptrdiff_t>(first_), to_.size(), slope_.begin());
    else
      slopes_(velocities, first_, std::span(slope_).first(to_.size()));
  }

  template <class Rate>
  void copy_direction(std::size_t balance, double Inputs::*what, const Rate& rate) const {
    const std::vector<double>& kept = s_.directions[balance];
    if (!kept.empty())
      along([&](Inputs& in, std::size_t k) { in.*what = kept[k]; });
    else
      along([&](Inputs& in, std::size_t k) { in.*what = direction_of_(rate(k), balance); });
  }

  const RecordSignals& s_;
  const std::size_t first_;
  const std::span<Inputs> to_;
  const Slopes slopes_;
  const Direction direction_of_;
  std::array<double, PlainInputs::kBlock> slope_;
};

}  // namespace

void RecordSignals::copy(std::size_t first, std::span<Inputs> to, unsigned reads) const {
  using namespace effects;
  while (to.size() > PlainInputs::kBlock) {
    copy(first, to.first(PlainInputs::kBlock), reads);
    first += PlainInputs::kBlock;
    to = to.subspan(PlainInputs::kBlock);
  }
  InputBlock block(
      *this, first, to,
      [this](const std::vector<double>& signal, std::size_t at, std::span<double> slope) { slopes(signal, at, slope); },
      [this](double rate, std::size_t balance) { return direction_of(rate, balance); });
  block.along([&](Inputs& in, std::size_t) {
    in.viscous_scale = in.coulomb_scale = 1.0;
    in.elapsed = sample_s;
  });
  if (reads & (kMotorMotion | kMotorAngle)) block.copy_motor();
  if (reads & kDirection) block.copy_motor_direction();
  if (reads & (kOutputMotion | kOutputAngle)) block.copy_output();
  if (reads & kTorsion) block.copy_torsion();
  if (reads & kTorque)
    block.along([&](Inputs& in, std::size_t k) {
      in.torque = torque_at(k);
      in.torque_magnitude = std::abs(in.torque);
    });
  if (reads & kCurrent)
    block.along([&, is_modelled = (reads & kModelledCurrent) && !modelled_current.empty()](Inputs& in, std::size_t k) {
      in.current = is_modelled ? modelled_current[k] : current.empty() ? 0.0 : current[k];
    });
  if (reads & kTemperature) block.along([&](Inputs& in, std::size_t k) { in.temperature = temperature_at(k); });
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
      if (!modelled_current.empty()) few.modelled_current.push_back(modelled_current[k]);
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
