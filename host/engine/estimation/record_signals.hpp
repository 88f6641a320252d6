// The signals of a record that effects read: one array each, and only those that do not follow from another one.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::estimation {

// Measured numbers times a factor. What needs no change is not copied: the experiment outlives its record.
class ScaledSignal {
 public:
  ScaledSignal() = default;
  explicit ScaledSignal(const std::vector<double>& measured) : numbers_(std::shared_ptr<void>(), &measured) {}
  explicit ScaledSignal(std::vector<double>&& own)
      : numbers_(std::make_shared<const std::vector<double>>(std::move(own))) {}

  bool empty() const { return !numbers_ || numbers_->empty(); }
  std::size_t size() const { return numbers_ ? numbers_->size() : 0; }
  double operator[](std::size_t sample) const { return scale_ * (*numbers_)[sample]; }
  ScaledSignal times(double factor) const {
    ScaledSignal result = *this;
    result.scale_ *= factor;
    return result;
  }
  std::vector<double> values() const;

 private:
  std::shared_ptr<const std::vector<double>> numbers_;
  double scale_ = 1.0;
};

class RecordSignals {
 public:
  using Inputs = effects::Inputs<catalogue::Real>;
  // With the bits of effects::Signals: the modelled current where there is one.
  static constexpr unsigned kModelledCurrent = 1U << 31;
  static constexpr unsigned kAll = ~kModelledCurrent;

  // Empty: not measured, and zero, unless it follows from others. Accelerations that are empty are slopes of the
  // velocities, directions that are empty are made of velocities and their noise.
  std::vector<double> angle, velocity, acceleration;
  std::vector<double> output_angle, output_velocity, output_acceleration;
  std::vector<double> torque;  // filtered as positions are
  std::vector<double> temperature;
  ScaledSignal current;
  // The current that a model makes of the motion, for effects with a memory of the current, or nonlinear in it: with a
  // measured one they explain the noise of the effort by its own noise. Empty: they read the measured one.
  std::vector<double> modelled_current;
  std::array<std::vector<double>, 3> directions;  // by balance: of velocity, torsion rate, output velocity

  std::vector<data::Segment> segments;
  double sample_s = 0.0;
  double gear_ratio = 1.0;
  double reference_temperature = 0.0;
  double torsion_zero = 0.0;  // is added to the torsion
  bool locked = false;
  bool at_rest = false;  // has no direction
  std::array<double, 3> velocity_noise{};

  void resize(std::size_t samples) { size_ = samples; }
  std::size_t size() const { return size_; }

  // Signals of a sample, all or at least those that `reads` names: for single samples; `copy` costs less along many.
  Inputs operator[](std::size_t sample) const { return at(sample, kAll); }
  Inputs at(std::size_t sample, unsigned reads) const;
  // Signals of the samples from `first` on; at least those that `reads` (bits of effects::Signals) names.
  void copy(std::size_t first, std::span<Inputs> to, unsigned reads = kAll) const;
  // The same for what takes inputs a block at a time. It must not outlive this.
  catalogue::PlainInputs all(unsigned reads = kAll) const;

  double angle_at(std::size_t k) const { return angle.empty() ? 0.0 : angle[k]; }
  double velocity_at(std::size_t k) const { return velocity.empty() ? 0.0 : velocity[k]; }
  double output_angle_at(std::size_t k) const {
    return !output_angle.empty() ? output_angle[k] : locked ? 0.0 : angle_at(k) / gear_ratio;
  }
  double output_velocity_at(std::size_t k) const {
    return !output_velocity.empty() ? output_velocity[k] : locked ? 0.0 : velocity_at(k) / gear_ratio;
  }
  double torsion_at(std::size_t k) const { return angle_at(k) / gear_ratio - output_angle_at(k) + torsion_zero; }
  double torsion_rate_at(std::size_t k) const { return velocity_at(k) / gear_ratio - output_velocity_at(k); }
  double torque_at(std::size_t k) const { return torque.empty() ? 0.0 : torque[k]; }
  double temperature_at(std::size_t k) const { return temperature.empty() ? reference_temperature : temperature[k]; }

  // Every so many samples of each segment, with derivatives and directions as they are here.
  RecordSignals every(std::size_t step) const;

  // Keeps the directions, which cost more to make than to read, where their memory is small.
  void keep_directions();

 private:
  double direction_of(double rate, std::size_t balance) const;
  // Slopes of samples [first, first + slope.size()) of a signal, by segments.
  void slopes(const std::vector<double>& signal, std::size_t first, std::span<double> slope) const;
  std::size_t size_ = 0;
};

}  // namespace flexspline::estimation
