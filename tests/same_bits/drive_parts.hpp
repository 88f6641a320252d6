// Loops, limits, feedforward, set points, excitations, sensors and the residual map under the same worst inputs as the
// effects: a hash of the bits of each, with the settings of one drive. No two draws in one call: compilers take
// arguments in orders of their own.
#pragma once

#include "shared/control/current_loop.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/control/drive_parameters_setup.hpp"
#include "tests/same_bits/adversarial.hpp"

namespace flexspline::same_bits {

using Settings = control::DriveSettings<Fixed>;

// Takes all bits of integers and of structs of values.
inline void take(Hash& hash, std::int64_t x) {
  hash.take(x);
}
template <class T>
requires requires(T x) {
  x.raw;
}
void take(Hash& hash, T x) {
  hash.take(x.raw);
}
template <class... Rest>
void take_all(Hash& hash, Rest... rest) {
  (take(hash, rest), ...);
}
constexpr Fixed::Value two() {
  return Fixed::one() + Fixed::one();
}
inline Fixed::Value value(Random& random) {
  return {{random.signal()}};
}
inline Fixed::Angle angle(Random& random) {
  return {random.angle()};
}

inline std::uint64_t hash_of_encoder_angle(const Settings& s, int ticks) {
  using observers::EncoderAngle;
  EncoderAngle::State state;
  std::uint32_t counter = 0;
  return hash_over(ticks, [&](int, Random& random, Hash& hash) {
    // Now and then a jump, else what a shaft does.
    const std::uint64_t bits = random.next();
    counter += static_cast<std::uint32_t>(static_cast<std::int32_t>(bits >> 32) >> ((bits & 7) == 0 ? 0 : 22));
    take(hash, EncoderAngle::moved(state, counter));
    take(hash, EncoderAngle::update(state, s.motor_encoder, counter));
  });
}

inline std::uint64_t hash_of_disturbance(const Settings& s, int ticks) {
  observers::DisturbanceObserver::State<Fixed> state;
  return hash_over(ticks, [&](int, Random& random, Hash& hash) {
    const auto applied = value(random), modelled = value(random), acceleration = value(random);
    take(hash, observers::DisturbanceObserver::update<Fixed>(state, s.disturbance, Fixed::clamp(applied, two()),
                                                             Fixed::clamp(modelled, two()),
                                                             Fixed::clamp(acceleration, two())));
    take(hash, state.residual);
  });
}

inline std::uint64_t hash_of_torsion(const Settings& s, int ticks) {
  observers::TorsionObserver::State<Fixed> state;
  return hash_over(ticks, [&](int k, Random& random, Hash& hash) {
    const auto torque = Fixed::clamp(value(random), two()), velocity = Fixed::clamp(value(random), two());
    const auto now = observers::TorsionObserver::update<Fixed>(state, s.torsion, torque, velocity, k % 16 != 0);
    take_all(hash, now.torsion, now.output_velocity, now.load);
  });
}

inline std::uint64_t hash_of_loops(const Settings& s, int ticks) {
  using control::Loop;
  control::Loops::State<Fixed> state;
  constexpr Loop kLoops[] = {Loop::off, Loop::torque, Loop::velocity, Loop::position};
  return hash_over(ticks, [&](int k, Random& random, Hash& hash) {
    // A mode for a while, seldom off.
    const std::uint32_t period = static_cast<std::uint32_t>(k) / 13;
    const Loop loop = kLoops[period % 19 == 0 ? 0 : 1 + period % 3];
    const control::Loops::Command<Fixed> command{loop, angle(random), value(random), value(random)};
    const auto measured = angle(random);
    const auto out = control::Loops::update<Fixed>(state, s.loops, command, measured, value(random));
    take_all(hash, out.torque, out.current, std::int64_t{out.limited}, state.integral);
  });
}

inline std::uint64_t hash_of_trajectory(const Settings& s, int ticks) {
  using control::Trajectory;
  Trajectory::State state;
  std::int64_t target = 0, speed = s.trajectory.velocity;
  return hash_over(ticks, [&](int k, Random& random, Hash& hash) {
    if (k % 50 == 0) {
      target = random.angle() >> 16;
      speed = Trajectory::speed_of<Fixed>(s.trajectory, Fixed::magnitude(value(random)));
    }
    if (k % 100 == 99) {
      const std::int64_t position = random.angle() >> 16;
      state = Trajectory::moving(s.trajectory, position, random.angle());
    }
    const auto point = Trajectory::update<Fixed>(state, s.trajectory, target, speed);
    take_all(hash, point.position, point.velocity, point.acceleration);
  });
}

inline std::uint64_t hash_of_stream(const Settings& s, int ticks) {
  using control::Stream;
  Stream::State state;
  return hash_over(ticks, [&](int k, Random& random, Hash& hash) {
    if (k % 20 == 0) {
      const auto position = angle(random);
      const auto velocity = value(random);
      state = Stream::at<Fixed>(s.stream, s.trajectory, position, velocity, value(random));
    }
    const auto point = Stream::update<Fixed>(state, s.trajectory);
    take_all(hash, point.position, point.velocity, point.acceleration);
  });
}

inline std::uint64_t hash_of_feedforward(const Settings& s, model::DriveModel<Fixed>& model, int ticks) {
  control::Feedforward::State<Fixed> state;
  return hash_over(ticks, [&](int, Random& random, Hash& hash) {
    const auto position = angle(random);
    const auto velocity = Fixed::clamp(value(random), two());
    const auto acceleration = Fixed::clamp(value(random), two());
    const auto at = angle(random);
    const auto temperature = value(random);
    const auto out = control::Feedforward::update<Fixed>(
        state, s.feedforward, model, {position, velocity, acceleration}, {at, temperature, value(random)});
    take_all(hash, out.torque, out.lead, out.velocity);
  });
}

inline std::uint64_t hash_of_excitation(control::Excitation::Coefficients<Fixed> c, int ticks) {
  using control::Shape;
  Random random;
  Hash hash;
  for (const Shape shape : {Shape::lines, Shape::asymmetric_sine, Shape::square, Shape::saw_tooth, Shape::triangle}) {
    c.shape = shape;
    control::Excitation::State<Fixed> state;
    for (int k = 0; k < ticks / 5; ++k) {
      if (k % 400 == 0) control::Excitation::start<Fixed>(state, c);
      if (k % 400 == 300) control::Excitation::stop<Fixed>(state);
      take(hash, control::Excitation::update<Fixed>(state, c, value(random)));
    }
  }
  return hash.value();
}

inline std::uint64_t hash_of_residual_map(const Settings& s, int ticks) {
  static control::ResidualMap map;
  map.reset();
  Random random;
  Hash hash;
  for (int k = 0; k < ticks; ++k) {
    const auto velocity = value(random);
    const auto at = angle(random);
    map.add(s.residual_map, velocity, at, value(random));
  }
  for (std::size_t v = 0; v < control::ResidualMap::kVelocityBins; ++v) {
    for (std::size_t a = 0; a < control::ResidualMap::kAngleBins; ++a) {
      control::ResidualMap::Bin bin;
      if (map.read(v, a, bin)) take_all(hash, bin.count, bin.sum, bin.squares);
    }
  }
  return hash.value();
}

inline std::uint64_t hash_of_current_loop(int ticks) {
  control::CurrentLoop loop;
  const control::CurrentLoopSetup setup{.proportional = 900, .integral = 450, .limit = 30'000};
  return hash_over(ticks, [&](int, Random& random, Hash& hash) {
    const auto wanted = static_cast<std::int16_t>(random.signal() >> 16);
    take(hash, loop.update(setup, wanted, static_cast<std::int16_t>(random.signal() >> 16)));
  });
}

// A drive without an encoder at its output, with a torque sensor and an excitation: all sections but the output
// encoder's, which are computed as the motor's are.
inline control::DriveSetup<double> drive_setup() {
  control::DriveSetup<double> s;
  s.tick_hz = 16'384;
  s.motor_counts = 10'000;
  s.motor_corner = 900.0;
  s.has_torque_sensor = true;
  s.has_slow_rates = false;  // as all blocks of version 1 were at first
  s.torsion = {.inertia = 1e-4,
               .output_inertia = 0.06,
               .stiffness = 6300.0,
               .torque_noise = 0.01,
               .load_walk = 1.0,
               .velocity_noise = 0.3};
  s.ripple = {.order = 2.0, .memory = 64.0, .largest_ripple = 10.0};
  s.disturbance = {.inertia = 1e-4, .time_constant_s = 0.01, .limit = 0.9};
  s.current = {.full_scale = 8.0};
  s.torque = {.full_scale = 120.0};
  s.temperature = {.full_scale = 200.0};
  s.amplifier_full_scale = 5.0;
  s.loops = {.position_gain = 60.0,
             .velocity_gain = 0.03,
             .integral_gain = 1.0,
             .velocity_limit = 200.0,
             .overspeed = 230.0,
             .torque_limit = 0.4,
             .current_limit = 4.0};
  s.trajectory = {.velocity_limit = 200.0, .acceleration_limit = 2000.0};
  s.feedforward = {.direction_band = 0.05,
                   .torque_limit = 0.9,
                   .load_limit = 70.0,
                   .stiffness = 6300.0,
                   .torsion_limit = 0.0118,
                   .torsion_rate_limit = 1.0,
                   .output_zero_turns = 0.25,
                   .damping_torque = 57.0,
                   .damping_exponent = 0.5};
  control::ExcitationSetup<double> e;
  e.amplitude = 0.2;
  e.offset = 0.03;
  e.frequency_hz = 40.0;
  e.end_frequency_hz = 90.0;
  e.negative_per_positive = 1.25;
  e.ticks = 350;
  e.fade_ticks = 60;
  e.limit = 0.4;
  e.slope_limit = 400.0;
  e.velocity_limit = 200.0;
  e.overspeed = 230.0;
  s.excitation = control::composite(e);
  s.excites_torque = true;
  s.residual_map = {.standstill_velocity = 0.5, .largest_velocity = 200.0, .largest_residual = 0.1};
  s.safety = {.overspeed = 250.0,
              .overcurrent = 5.0,
              .overtemperature = 80.0,
              .acceleration = 40'000.0,
              .stuck_torque = 0.3,
              .current_mismatch = 0.8};
  return s;
}

// Notes nothing: its numbers fit.
inline Settings settings() {
  Settings s = control::derive<Fixed>(drive_setup(), drive());
  s.motor_motion = Derived::encoder_filter();
  s.ripple = Derived::ripple_filter();
  return s;
}

// Calls print(name, hash) for each part.
template <class Coefficients, class Print>
void run_parts(const Settings& s, int ticks, Print&& print) {
  print("encoder_angle", hash_of_encoder_angle(s, ticks));
  print("disturbance_observer", hash_of_disturbance(s, ticks));
  print("torsion_observer", hash_of_torsion(s, ticks));
  print("loops", hash_of_loops(s, ticks));
  print("trajectory", hash_of_trajectory(s, ticks));
  print("stream", hash_of_stream(s, ticks));
  model::DriveModel<Fixed>& model = scratch();
  model.clear();
  add<Coefficients, effects::Inertia>(model);
  add<Coefficients, effects::ViscousFriction>(model);
  add<Coefficients, effects::CoulombFriction>(model);
  add<Coefficients, effects::LoadDependentFriction>(model);
  add<Coefficients, effects::LinearStiffness>(model);
  add<Coefficients, effects::OutputInertia>(model);
  add<Coefficients, effects::TorqueRipple>(model);
  print("feedforward", hash_of_feedforward(s, model, ticks));
  print("excitation", hash_of_excitation(s.excitation, ticks));
  print("residual_map", hash_of_residual_map(s, ticks));
  print("current_loop", hash_of_current_loop(ticks));
}

}  // namespace flexspline::same_bits
