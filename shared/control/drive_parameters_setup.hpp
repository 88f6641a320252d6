// Host only: the parameters of a drive's tick from SI units.
#pragma once

#include "shared/control/drive_parameters.hpp"

namespace flexspline::control {

// The signal at a full-scale reading of an analogue input, and its offset.
template <class P>
struct AnalogSetup {
  P full_scale{};
  P at_zero{};                // in the unit of the signal: value = full_scale share - at_zero
  P lowest_share{P(-0.999)};  // beyond: a broken wire
  P highest_share{P(0.999)};
};

template <class P>
struct SafetySetup {
  P overspeed{};             // rad/s
  P overcurrent{};           // A
  P overtemperature{};       // degrees Celsius
  P acceleration{};          // rad/s^2
  P stuck_torque{};          // N m
  P stuck_s{P(0.05)};        // s
  P current_mismatch{};      // A
  P mismatch_s{P(0.005)};    // s
  P torque_same_s{P(0.01)};  // s
  P standstill{P(1.0)};      // rad/s
  P host_s{P(0.1)};          // s
  P stop_s{P(1.0)};          // s
  P following_error{};       // rad of the motor, mode position; zero: none of these is watched
  P following_velocity{};    // rad/s, mode velocity
  P following_s{P(0.02)};    // s
  P output_stuck{};          // rad of the output, more than torsion and backlash
};

template <class P>
struct DriveSetup {
  std::uint32_t tick_hz = 20'000;
  std::uint32_t motor_counts = 0;
  std::uint32_t output_counts = 0;  // zero: no encoder at the output
  P motor_corner{};                 // rad/s, of the motor's Kalman filter
  P output_corner{};
  bool has_slow_rates = true;            // observers that no loop needs, and the lead, not at every tick
  observers::TorsionSetup<P> torsion{};  // used without an encoder at the output
  bool has_torque_sensor = false;
  observers::RippleSetup<P> ripple{};  // of the torque sensor
  observers::DisturbanceSetup<P> disturbance{};
  AnalogSetup<P> current{};      // A
  AnalogSetup<P> torque{};       // N m
  AnalogSetup<P> temperature{};  // degrees Celsius
  P amplifier_full_scale{};      // A
  LoopSetup<P> loops{};
  TrajectorySetup<P> trajectory{};
  FeedforwardSetup<P> feedforward{};
  ExcitationSetup<P> excitation{};
  bool excites_torque = true;  // else the excitation is a velocity
  SafetySetup<P> safety{};
  ResidualMapSetup<P> residual_map{};
};

namespace detail {
template <class N, class P>
AnalogScale<N> analog_scale(const AnalogSetup<P>& s, const P& base) {
  const auto share = [](const P& x) { return static_cast<std::int16_t>(static_cast<double>(x) * 32767.0); };
  return {N::gain(s.full_scale / base), N::value(s.at_zero / base), share(s.lowest_share), share(s.highest_share)};
}
template <class P>
std::uint32_t ticks_of(const P& seconds, const P& tick_s) {
  return static_cast<std::uint32_t>(static_cast<double>(seconds / tick_s) + 0.5);
}
template <class N, class P>
SafetyLimits<N> safety_limits(const SafetySetup<P>& s, std::uint32_t counts, const effects::DriveConstants<P>& d) {
  SafetyLimits<N> limits;
  limits.overspeed = N::value(s.overspeed / d.velocity_base);
  limits.overcurrent = N::value(s.overcurrent / d.current_base);
  limits.overtemperature = N::value(s.overtemperature / d.temperature_base);
  limits.acceleration = N::value(s.acceleration / d.acceleration_base);
  limits.stuck_torque = N::value(s.stuck_torque / d.torque_base);
  limits.current_mismatch = N::value(s.current_mismatch / d.current_base);
  limits.standstill = N::value(s.standstill / d.velocity_base);
  // Twice the overspeed: a faster motion is not real.
  const P most = P(2.0) * s.overspeed * d.time_base / d.angle_base * P(static_cast<double>(counts));
  limits.counts_a_tick = static_cast<std::int32_t>(static_cast<double>(most)) + 2;
  limits.host_ticks = ticks_of(s.host_s, d.time_base);
  limits.stop_ticks = ticks_of(s.stop_s, d.time_base);
  limits.stuck_ticks = static_cast<std::uint16_t>(ticks_of(s.stuck_s, d.time_base));
  limits.mismatch_ticks = static_cast<std::uint16_t>(ticks_of(s.mismatch_s, d.time_base));
  limits.torque_same_ticks = static_cast<std::uint16_t>(ticks_of(s.torque_same_s, d.time_base));
  require(s.overspeed > P(0.0) && s.overcurrent > P(0.0), "limits of velocity and current have to be positive");
  require(P(2.0) * s.overspeed * d.time_base < d.angle_base / P(2.0),
          "at twice the overspeed the motor turns by half a turn a tick");
  return limits;
}
template <class N, class P>
FollowingLimits<N> following_limits(const SafetySetup<P>& s, std::uint32_t motor_counts, std::uint32_t output_counts,
                                    const effects::DriveConstants<P>& d) {
  FollowingLimits<N> limits;
  const auto whole = [](const P& x) { return static_cast<std::int64_t>(static_cast<double>(x) + 0.5); };
  if (!(s.following_error > P(0.0))) return limits;
  const P error = s.following_error / d.angle_base * P(0x1p32);
  const std::uint32_t ticks = ticks_of(s.following_s, d.time_base);
  const bool fits = error >= P(1.0) && error < P(0x1p47) && ticks >= 1 && ticks <= UINT16_MAX;
  require(fits, "a following error is at most 32768 turns of the motor, for at least a tick and at most 65535");
  require(s.following_velocity > P(0.0), "the following error of the velocity has to be positive");
  if (!fits) return limits;
  limits.position = whole(error);
  limits.velocity = N::value(s.following_velocity / d.velocity_base);
  limits.ticks = static_cast<std::uint16_t>(ticks);
  if (output_counts != 0 && s.output_stuck > P(0.0)) {
    const P turns = s.output_stuck / d.angle_base;
    const P motor = turns * d.gear_ratio * P(static_cast<double>(motor_counts));
    // Part of the motor's motion becomes torsion; a part of the rest has to be measurable.
    const P output = turns * P(0.25) * P(static_cast<double>(output_counts));
    const bool in_counts = motor >= P(2.0) && motor < P(0x1p30) && output >= P(2.0) && output < P(0x1p30);
    require(in_counts, "a stuck output's angle is at least 8 counts of the output's encoder and 2 of the motor's");
    if (!in_counts) return limits;
    limits.motor_counts = static_cast<std::int32_t>(whole(motor));
    limits.output_counts = static_cast<std::int32_t>(whole(output));
  }
  return limits;
}
}  // namespace detail

// Records values that do not fit in OverflowLog. The caller fills the model: `parameters.model.add<Effect>(...)` with
// the same `d`. The bases of `d` hold for all of it; its time base is the tick.
template <class N, class P>
DriveParameters<N> derive(const DriveSetup<P>& s, const effects::DriveConstants<P>& d) {
  DriveParameters<N> p;
  p.tick_hz = s.tick_hz;
  p.has_slow_rates = s.has_slow_rates;
  const effects::DriveConstants<P> seldom = s.has_slow_rates ? slow(d) : d;
  p.has_output_encoder = s.output_counts != 0;
  p.has_torque_sensor = s.has_torque_sensor;
  p.excites_torque = s.excites_torque;
  p.motor_encoder = observers::EncoderAngle::derive(s.motor_counts);
  p.motor_motion = observers::EncoderKalman::derive<N>(
      observers::setup_for_corner(P(static_cast<double>(s.motor_counts)), s.motor_corner, d), d);
  if (p.has_output_encoder) {
    // The output's own bases, in the same filter.
    effects::DriveConstants<P> output = seldom;
    output.velocity_base = d.output_velocity_base;
    output.acceleration_base = d.output_acceleration_base;
    p.output_encoder = observers::EncoderAngle::derive(s.output_counts);
    p.output_motion = observers::EncoderKalman::derive<N>(
        observers::setup_for_corner(P(static_cast<double>(s.output_counts)), s.output_corner, output), output);
  }
  if (!p.has_output_encoder) {
    p.torsion = observers::TorsionObserver::derive<N>(s.torsion, d);
    p.output_angle = N::order(P(6.283185307179586) / d.gear_ratio);
    p.torsion_turns = N::gain(d.torsion_base / d.angle_base);
    p.output_of_velocity = N::gain(d.velocity_base / (d.gear_ratio * d.output_velocity_base));
  }
  p.disturbance = observers::DisturbanceObserver::derive<N>(s.disturbance, seldom);
  p.current = detail::analog_scale<N>(s.current, d.current_base);
  if (p.has_torque_sensor) {
    p.torque = detail::analog_scale<N>(s.torque, d.output_torque_base);
    p.ripple = observers::RippleFilter::derive<N>(s.ripple, d);
  }
  p.temperature = detail::analog_scale<N>(s.temperature, d.temperature_base);
  p.torque_of_current = N::gain(d.torque_constant * d.current_base / d.torque_base);
  p.amplifier = N::gain(d.current_base / s.amplifier_full_scale);
  require(s.loops.current_limit <= s.amplifier_full_scale, "the amplifier cannot give the current limit");
  p.loops = Loops::derive<N>(s.loops, d);
  p.trajectory = Trajectory::derive<N>(s.trajectory, d);
  p.stream = Stream::derive(d);
  p.feedforward = Feedforward::derive<N>(s.feedforward, d, s.has_slow_rates ? Feedforward::kLeadTicks : 1);
  if (s.excitation.ticks > 0)
    p.excitation = Excitation::derive<N>(s.excitation, s.excites_torque ? d.torque_base : d.velocity_base, d);
  p.residual_map = ResidualMap::derive<N>(s.residual_map, d);
  p.safety = detail::safety_limits<N>(s.safety, s.motor_counts, d);
  p.following = detail::following_limits<N>(s.safety, s.motor_counts, s.output_counts, d);
  return p;
}

}  // namespace flexspline::control
