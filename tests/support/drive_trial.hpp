// Drives, parameters and motions drawn at random, and what a model gives for them on a drive and in double: what tests
// of the fixed-point numbers have in common.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/model/drive_model.hpp"
#include "shared/model/proof.hpp"

namespace flexspline::tests {

using effects::DriveConstants;
using effects::Inputs;
using fixed::Checked;
using fixed::Fixed;
using fixed::Intervals;
using fixed::OverflowLog;
using numbers::Real;

inline constexpr double kTickS = 1.0 / 16000.0;

using Random = std::mt19937;
inline double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline double log_between(Random& random, double low, double high) {
  return std::exp(between(random, std::log(low), std::log(high)));
}

// A drive somewhat like the report's; bases are its rated values, angles count in turns.
inline DriveConstants<double> random_drive(Random& random) {
  DriveConstants<double> d;
  d.gear_ratio = between(random, 50.0, 160.0);
  d.rated_velocity = between(random, 100.0, 400.0);
  d.reference_temperature = between(random, 15.0, 40.0);
  d.torque_base = between(random, 0.3, 1.0);
  d.output_torque_base = between(random, 25.0, 80.0);
  d.velocity_base = d.rated_velocity;
  d.output_velocity_base = d.rated_velocity / d.gear_ratio;
  d.acceleration_base = d.torque_base / 1e-4;
  d.output_acceleration_base = d.acceleration_base / d.gear_ratio;
  d.angle_base = kTurn;
  d.torsion_base = d.output_torque_base / 6300.0;
  d.torsion_rate_base = between(random, 0.3, 1.0) * d.output_velocity_base;
  d.temperature_base = 50.0;
  d.current_base = between(random, 2.0, 10.0);
  d.torque_constant = d.torque_base / d.current_base;
  d.time_base = kTickS;
  return d;
}

// Parameters of an effect within their bounds, in the order of the catalogue: nonlinear ones up to five times their
// usual size to each side, torques a tenth of `size` usual ones up to `size` of them.
inline std::vector<double> drawn_parameters(const catalogue::Entry& entry, double size, Random& random) {
  std::vector<double> usual;
  for (const effects::ParameterInfo& p : entry.parameters) usual.push_back(p.usual);
  std::vector<double> values = catalogue::reduced(entry, usual);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const effects::ParameterInfo& p = entry.parameters[i];
    // What has no usual size takes that of its neighbour: cosine and sine.
    if (values[i] == 0.0)
      values[i] = (i > 0 && p.unit.rotary == entry.parameters[i - 1].unit.rotary) ? values[i - 1] : 0.1;
    const bool linear = p.kind == effects::Kind::linear;
    values[i] *= linear ? size * log_between(random, 0.1, 1.0) : log_between(random, 0.2, 5.0);
    if (linear && p.low < 0.0 && random() % 2 == 0) values[i] = -values[i];
    values[i] = std::clamp(values[i], p.low, p.high);
  }
  return catalogue::natural(entry, values);
}

// Signals as a drive has them after its inputs were limited, over the whole envelope: slow and fast stretches, stops,
// reversals.
class Motion {
 public:
  Motion(const DriveConstants<double>& drive, Random& random) : drive_(drive), random_(random) {
    angle_turns_ = between(random_, -500.0, 500.0);
    for (Channel& c : channels_) start(c);
  }
  // The next tick's signals on the drive.
  Inputs<Fixed> next() {
    if (left_-- == 0) {
      left_ = static_cast<int>(random_() % 200) + 20;
      for (Channel& c : channels_) start(c);
    }
    Inputs<Fixed> in;
    const double velocity = step(kVelocity);
    angle_turns_ += velocity * drive_.velocity_base * kTickS / kTurn;
    const double torsion_before = torsion_;
    torsion_ = step(kTorsion);
    const double rate = (torsion_ - torsion_before) * drive_.torsion_base / (kTickS * drive_.torsion_rate_base);
    in.angle = {std::llround(std::ldexp(angle_turns_, 32))};
    in.velocity = Fixed::value(velocity);
    in.direction = Fixed::value(sign(velocity));
    in.acceleration = Fixed::value(step(kAcceleration));
    in.output_angle = {std::llround(std::ldexp(angle_turns_ / drive_.gear_ratio, 32))};
    const double output_velocity = step(kOutputVelocity);
    in.output_velocity = Fixed::value(output_velocity);
    in.output_direction = Fixed::value(sign(output_velocity));
    in.output_acceleration = Fixed::value(step(kOutputAcceleration));
    in.torsion = Fixed::value(torsion_);
    in.torsion_rate = Fixed::value(std::clamp(rate, -2.0, 2.0));
    in.torsion_direction = Fixed::value(sign(rate));
    in.torque = Fixed::value(step(kTorque));
    in.current = Fixed::value(step(kCurrent));
    in.temperature = Fixed::value(step(kTemperature));
    return in;
  }

 private:
  enum {
    kVelocity,
    kTorsion,
    kAcceleration,
    kOutputVelocity,
    kOutputAcceleration,
    kTorque,
    kCurrent,
    kTemperature,
    kAll
  };
  struct Channel {
    double phase = 0.0;
    double rate = 0.0;
  };
  static double sign(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }
  void start(Channel& c) { c.rate = random_() % 8 == 0 ? 0.0 : log_between(random_, 1e-7, 0.02); }
  double step(int channel) {
    Channel& c = channels_[channel];
    c.phase += c.rate;
    return 2.0 * std::sin(c.phase);
  }

  const DriveConstants<double>& drive_;
  Random& random_;
  Channel channels_[kAll];
  double angle_turns_ = 0.0;
  double torsion_ = 0.0;
  int left_ = 0;
};

// The same signals in double, to the last bit; angles in radians.
inline double real(Fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
inline double real(fixed::Sum x) {
  return std::ldexp(static_cast<double>(x.raw), -fixed::kSumBits);
}
inline Inputs<Real> in_double(const Inputs<Fixed>& in) {
  Inputs<Real> out{};
  out.angle = std::ldexp(static_cast<double>(in.angle.raw), -32) * kTurn;
  out.output_angle = std::ldexp(static_cast<double>(in.output_angle.raw), -32) * kTurn;
  out.velocity = real(in.velocity);
  out.direction = real(in.direction);
  out.acceleration = real(in.acceleration);
  out.output_velocity = real(in.output_velocity);
  out.output_direction = real(in.output_direction);
  out.output_acceleration = real(in.output_acceleration);
  out.torsion = real(in.torsion);
  out.torsion_rate = real(in.torsion_rate);
  out.torsion_direction = real(in.torsion_direction);
  out.torque = real(in.torque);
  out.current = real(in.current);
  out.temperature = real(in.temperature);
  return out;
}
inline Inputs<Checked> in_checked(const Inputs<Fixed>& in) {
  Inputs<Checked> out{};
  const auto take = [](Checked::Value& to, Fixed::Value from) { to.raw = from.raw; };
  out.angle = in.angle;
  out.output_angle = in.output_angle;
  take(out.velocity, in.velocity);
  take(out.direction, in.direction);
  take(out.acceleration, in.acceleration);
  take(out.output_velocity, in.output_velocity);
  take(out.output_direction, in.output_direction);
  take(out.output_acceleration, in.output_acceleration);
  take(out.torsion, in.torsion);
  take(out.torsion_rate, in.torsion_rate);
  take(out.torsion_direction, in.torsion_direction);
  take(out.torque, in.torque);
  take(out.current, in.current);
  take(out.temperature, in.temperature);
  return out;
}

// One model in all number systems.
struct Models {
  model::DriveModel<Fixed> fixed;
  model::DriveModel<Checked> checked;
  model::DriveModel<Real> real;
  model::DriveModel<Intervals> intervals;

  // Adds an effect; false where a coefficient does not fit its format (OverflowLog says which) or there is no place
  // left.
  template <class Effect>
  bool add(const double* parameters, const DriveConstants<double>& drive) {
    OverflowLog::clear();
    DriveConstants<double> radians = drive;
    radians.angle_base = 1.0;
    const bool placed = fixed.add<Effect>(Effect::template derive<Fixed>(parameters, drive)) &&
                        checked.add<Effect>(Effect::template derive<Checked>(parameters, drive)) &&
                        intervals.add<Effect>(Effect::template derive<Intervals>(parameters, drive)) &&
                        real.add<Effect>(Effect::template derive<Real>(parameters, radians));
    return placed && OverflowLog::count() == 0;
  }
  bool add_named(std::string_view name, const std::vector<double>& parameters, const DriveConstants<double>& drive) {
    bool added = false;
    effects::for_each_effect([&]<class Effect>(std::size_t) {
      if constexpr (!Effect::kInfo.host_only)
        if (Effect::kInfo.name == name) added = add<Effect>(parameters.data(), drive);
    });
    return added;
  }
};

// The largest difference between drive and double on any of the balances, in bases, along a motion of `ticks`; and
// whether the checked numbers found something or gave other bits.
struct Trial {
  double worst = 0.0;
  double largest = 0.0;  // torque
  bool same_bits = true;
  bool within_proof = true;
  long findings = 0;
};
// Names of the effects that a drive can run.
inline std::vector<std::string> names_on_drive() {
  std::vector<std::string> names;
  for (const catalogue::Entry& entry : catalogue::all())
    if (!entry.info->host_only) names.emplace_back(entry.name());
  return names;
}

// A block with these effects, and with what shifts and modulations act on, of a size between a twentieth of rated
// torque and what the proof lets through; null where the draw is not admissible.
inline std::optional<Models> admissible_block(const std::vector<const catalogue::Entry*>& entries,
                                              const DriveConstants<double>& drive, Random& random) {
  Models models;
  const auto add_usual = [&](std::string_view name) {
    const catalogue::Entry& entry = catalogue::get(name);
    for (const catalogue::Entry* other : entries)
      if (other == &entry) return;
    std::vector<double> usual;
    for (const effects::ParameterInfo& p : entry.parameters) usual.push_back(p.usual);
    models.add_named(name, usual, drive);
  };
  bool shifts = false;
  for (const catalogue::Entry* entry : entries) {
    if (!models.add_named(entry->name(), drawn_parameters(*entry, log_between(random, 1.0, 20.0), random), drive))
      return std::nullopt;
    shifts = shifts || entry->info->phase == effects::Phase::shift;
    if (entry->info->phase == effects::Phase::modulate) add_usual(entry->info->modulates);
  }
  if (shifts) add_usual("linear_stiffness");
  if (!model::prove(models.intervals).holds) return std::nullopt;
  return models;
}

// One balance in the torques of each number system.
struct BalanceOf {
  fixed::Sum effects::Torques<Fixed>::*fixed;
  fixed::Sum effects::Torques<Checked>::*checked;
  double effects::Torques<Real>::*real;
  Intervals::Sum effects::Torques<Intervals>::*intervals;
};

// Where a law is infinitely steep at rest, as structural damping is in the rate of torsion, an error means: no rate
// within this many units of resolution gives what the drive gives. Only what changes the rate before that law sees it,
// the kinematic error, makes a difference.
inline constexpr double kUnitsOfRate = 3.0;

inline Trial run(Models& models, const DriveConstants<double>& drive, Random& random, int ticks) {
  Trial trial;
  Motion motion(drive, random);
  const model::Proof proof = model::prove(models.intervals);
  OverflowLog::clear();
  // No law with memory reads the rate, so that models at the ends of its resolution stay beside the others.
  model::DriveModel<Real> slower = models.real, faster = models.real;
  for (int k = 0; k < ticks; ++k) {
    const Inputs<Fixed> in = motion.next();
    const auto drives = models.fixed.tick(in);
    const auto checked = models.checked.tick(in_checked(in));
    Inputs<Real> plain = in_double(in);
    const auto exact = models.real.tick(plain);
    plain.torsion_rate -= std::ldexp(kUnitsOfRate, -fixed::kValueBits);
    const auto low = slower.tick(plain);
    plain.torsion_rate += std::ldexp(2.0 * kUnitsOfRate, -fixed::kValueBits);
    const auto high = faster.tick(plain);
    const auto compare = [&](auto balance) {
      const fixed::Sum given = drives.*balance.fixed;
      const double x = exact.*balance.real, a = low.*balance.real, b = high.*balance.real;
      const double error = std::max({0.0, std::min({x, a, b}) - real(given), real(given) - std::max({x, a, b})});
      trial.worst = std::max(trial.worst, error);
      trial.largest = std::max(trial.largest, std::abs(x));
      trial.same_bits = trial.same_bits && given.raw == (checked.*balance.checked).raw;
      const Intervals::Sum bounds = proof.torques.*balance.intervals;
      trial.within_proof = trial.within_proof && given.raw >= bounds.low && given.raw <= bounds.high;
    };
    compare(BalanceOf{&effects::Torques<Fixed>::motor, &effects::Torques<Checked>::motor,
                      &effects::Torques<Real>::motor, &effects::Torques<Intervals>::motor});
    compare(BalanceOf{&effects::Torques<Fixed>::transmission, &effects::Torques<Checked>::transmission,
                      &effects::Torques<Real>::transmission, &effects::Torques<Intervals>::transmission});
    compare(BalanceOf{&effects::Torques<Fixed>::load, &effects::Torques<Checked>::load, &effects::Torques<Real>::load,
                      &effects::Torques<Intervals>::load});
  }
  trial.findings = OverflowLog::count();
  return trial;
}

}  // namespace flexspline::tests
