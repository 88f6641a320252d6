// What the drive's numbers give for ticks of the worst inputs: ends of the range, jumps, far more than a drive would
// let through. A hash of the bits for each effect, for the observers, and for all effects together.
#pragma once

#include <cstdint>
#include <string_view>

#include "shared/fixed/system.hpp"
#include "shared/model/drive_model.hpp"
#include "shared/observers/encoder_kalman.hpp"
#include "shared/observers/ripple_filter.hpp"

namespace flexspline::same_bits {

using fixed::Fixed;

// Marsaglia's xorshift: the same numbers everywhere.
class Random {
 public:
  std::uint64_t next() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    return state_;
  }
  // Often at the ends of the range, at zero or next to it.
  std::int32_t signal() {
    const std::uint64_t bits = next();
    switch (bits & 15) {
      case 0:
        return INT32_MIN;
      case 1:
        return INT32_MAX;
      case 2:
        return 0;
      case 3:
        return static_cast<std::int32_t>((bits >> 8) % 3) - 1;
      case 4:
      case 5:
      case 6:
        return static_cast<std::int32_t>(bits >> 32);
      default:
        return static_cast<std::int32_t>(bits >> 32) >> ((bits >> 8) & 31);
    }
  }
  std::int64_t angle() {
    const std::uint64_t bits = next();
    return static_cast<std::int64_t>(bits) >> ((next() >> 8) & 63);
  }
  // To another sequence.
  void skip(std::uint64_t seed) {
    state_ ^= 0x9E3779B97F4A7C15U * seed;
    next();
  }

 private:
  std::uint64_t state_ = 88172645463325252;
};

class Hash {  // FNV-1a, by words
 public:
  void take(std::int64_t x) { value_ = (value_ ^ static_cast<std::uint64_t>(x)) * 1099511628211U; }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037U;
};

inline effects::Inputs<Fixed> adversarial(Random& random) {
  effects::Inputs<Fixed> in;
  in.angle.raw = random.angle();
  in.output_angle.raw = random.angle();
  for (Fixed::Value* signal : {&in.velocity, &in.direction, &in.acceleration, &in.output_velocity, &in.output_direction,
                               &in.output_acceleration, &in.torsion, &in.torsion_rate, &in.torsion_direction,
                               &in.torque, &in.current, &in.temperature})
    signal->raw = random.signal();
  return in;
}

inline effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.gear_ratio = 100.0;
  d.torque_constant = 0.125;
  d.rated_velocity = d.velocity_base = 200.0;
  d.torque_base = 0.5;
  d.output_torque_base = 40.0;
  d.output_velocity_base = 2.0;
  d.acceleration_base = 4000.0;
  d.output_acceleration_base = 40.0;
  d.angle_base = 6.25;
  d.torsion_base = 0.00625;
  d.torsion_rate_base = 1.0;
  d.temperature_base = 64.0;
  d.current_base = 4.0;
  d.time_base = 1.0 / 16384.0;
  return d;
}

// Coefficients as the host derives them.
struct Derived {
  template <class Effect>
  static typename Effect::template Coefficients<Fixed> effect() {
    double parameters[sizeof(Effect::kParameters) / sizeof(Effect::kParameters[0])];
    double* next = parameters;
    for (const effects::ParameterInfo& p : Effect::kParameters) *next++ = p.usual != 0.0 ? p.usual : 0.0625;
    return Effect::template derive<Fixed>(parameters, drive());
  }
  // Gains that need no rounding.
  static observers::EncoderKalman::Coefficients<Fixed> encoder_filter() {
    return observers::EncoderKalman::coefficients<Fixed>(
        observers::KalmanGains<double>{1.0 / 64.0, 1.0 / 32.0, 1.0 / 32.0, 1.0 / 64.0}, drive());
  }
  static observers::RippleFilter::Coefficients<Fixed> ripple_filter() {
    return observers::RippleFilter::derive<Fixed>(
        observers::RippleSetup<double>{.order = 2.0, .memory = 64.0, .largest_ripple = 10.0}, drive());
  }
};

// For one use after the other, and not on the stack: the smallest machine has 16 KB in all.
inline model::DriveModel<Fixed>& scratch() {
  static model::DriveModel<Fixed> model;
  return model;
}

template <class Coefficients, class Effect>
void add(model::DriveModel<Fixed>& model) {
  model.add<Effect>(Coefficients::template effect<Effect>());
}

// What tick(k, random, hash) takes, over so many of them.
template <class Tick>
std::uint64_t hash_over(int ticks, Tick tick, Random random = {}) {
  Hash hash;
  for (int k = 0; k < ticks; ++k) tick(k, random, hash);
  return hash.value();
}

inline std::uint64_t hash_of(model::DriveModel<Fixed>& model, int ticks, const Random& inputs = {}) {
  const auto tick = [&](int, Random& random, Hash& hash) {
    const auto torques = model.tick(adversarial(random));
    hash.take(torques.motor.raw);
    hash.take(torques.transmission.raw);
    hash.take(torques.load.raw);
  };
  return hash_over(ticks, tick, inputs);
}

inline std::uint64_t hash_of_encoder_kalman(const observers::EncoderKalman::Coefficients<Fixed>& c, int ticks) {
  using observers::EncoderKalman;
  EncoderKalman::State<Fixed> state;
  return hash_over(ticks, [&](int, Random& random, Hash& hash) {
    const auto now = EncoderKalman::update<Fixed>(state, c, {random.angle()});
    hash.take(now.velocity.raw);
    hash.take(now.acceleration.raw);
    hash.take(state.position_error.raw);
  });
}

inline std::uint64_t hash_of_ripple_filter(const observers::RippleFilter::Coefficients<Fixed>& c, int ticks) {
  using observers::RippleFilter;
  RippleFilter::State<Fixed> state;
  return hash_over(ticks, [&](int, Random& random, Hash& hash) {
    const fixed::Angle angle{random.angle()};
    hash.take(RippleFilter::update<Fixed>(state, c, angle, {{random.signal()}}).raw);
    hash.take(state.cosine.raw);
    hash.take(state.sine.raw);
  });
}

// Coefficients as the host derives them from parameters between a half and three halves of the usual ones.
struct Drawn {
  static inline Random random;
  template <class Effect>
  static typename Effect::template Coefficients<Fixed> effect() {
    double parameters[sizeof(Effect::kParameters) / sizeof(Effect::kParameters[0])];
    double* next = parameters;
    for (const effects::ParameterInfo& p : Effect::kParameters) {
      const double usual = p.usual != 0.0 ? p.usual : 0.0625;
      const double drawn = usual * (0.5 + static_cast<double>(random.next() >> 40) * 0x1p-24);
      *next++ = drawn < p.low || drawn > p.high ? usual : drawn;
    }
    const auto coefficients = Effect::template derive<Fixed>(parameters, drive());
    if (fixed::OverflowLog::count() == 0) return coefficients;
    fixed::OverflowLog::clear();  // these do not fit a drive
    return Derived::effect<Effect>();
  }
};

// All effects, with other coefficients in each of so many blocks.
inline std::uint64_t hash_of_drawn_blocks(int blocks, int ticks) {
  Hash hash;
  for (int k = 0; k < blocks; ++k) {
    model::DriveModel<Fixed>& model = scratch();
    model.clear();
    effects::for_each_effect([&]<class Effect>(std::size_t) {
      if constexpr (!Effect::kInfo.host_only) add<Drawn, Effect>(model);
    });
    hash.take(static_cast<std::int64_t>(hash_of(model, ticks, Drawn::random)));
  }
  return hash.value();
}

// Calls print(name, hash) for each; `ticks` of an effect alone, `many` of the others.
template <class Coefficients, class Print>
void run(int ticks, int many, Print&& print) {
  model::DriveModel<Fixed>& one = scratch();
  effects::for_each_effect([&]<class Effect>(std::size_t) {
    if constexpr (!Effect::kInfo.host_only) {
      one.clear();
      add<Coefficients, Effect>(one);
      // What changes a signal shows in what reads it.
      if constexpr (Effect::kInfo.phase == effects::Phase::shift) add<Coefficients, effects::LinearStiffness>(one);
      if constexpr (Effect::kInfo.phase == effects::Phase::modulate) {
        add<Coefficients, effects::ViscousFriction>(one);
        add<Coefficients, effects::CoulombFriction>(one);
      }
      print(Effect::kInfo.name, hash_of(one, ticks));
    }
  });
  print("encoder_kalman", hash_of_encoder_kalman(Coefficients::encoder_filter(), many));
  print("ripple_filter", hash_of_ripple_filter(Coefficients::ripple_filter(), many));
  model::DriveModel<Fixed>& all = scratch();
  all.clear();
  effects::for_each_effect([&]<class Effect>(std::size_t) {
    if constexpr (!Effect::kInfo.host_only) add<Coefficients, Effect>(all);
  });
  print("all", hash_of(all, many));
}

}  // namespace flexspline::same_bits
