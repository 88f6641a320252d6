// Torsion and output of a gear whose output has no encoder: a Kalman filter in its steady state on two masses and a
// spring, of which only the motor's velocity is measured,
//   J w' = t - K dq/N,   dq' = w/N - wo,   Jo wo' = K dq - l,   l an unknown load, as a random walk.
// All variables are differences from a nominal motion: t is the applied less the modelled torque, w the measured
// velocity less the set point's, and so the estimates are to be added to the model's torsion and to the set point over
// N. So friction, gravity and a nonlinear spring are in the model, and the remainder is linear. Without a model the
// nominal motion is standstill, and friction counts as torsion.
//
// A limit of this method: a constant error of friction looks like a torque through the gear, b at the motor as N b/K of
// torsion. No observer distinguishes them from the motor's side alone.
//
// Each tick takes the velocities first and the torsion with the new ones (symplectic Euler), which neither damps nor
// excites the resonance; the gains are those of the Riccati equation for exactly this step.
#pragma once

#include "shared/control/limits.hpp"
#include "shared/effects/effect.hpp"
#include "shared/observers/riccati.hpp"

namespace flexspline::observers {

// In SI units.
template <class P>
struct TorsionSetup {
  P inertia{};         // kg m^2, motor
  P output_inertia{};  // kg m^2
  P stiffness{};       // N m/rad at the output, where the gear usually works
  P torque_noise{};    // N m at the motor, std of the unmodelled torque, from tick to tick
  P load_walk{};       // N m per root second at the output: how fast an unknown load changes
  P velocity_noise{};  // rad/s, std of the measured velocity
};

struct TorsionObserver {
  template <class N>
  struct Coefficients {
    typename N::Share by_torque{};    // of the motor's velocity
    typename N::Share by_torsion{};   // the same
    typename N::Share output{};       // of the output's velocity, by torsion
    typename N::Share by_load{};      // the same, by the load
    typename N::Share from_motor{};   // of the torsion, by the motor's velocity
    typename N::Share from_output{};  // and by the output's
    typename N::Gain velocity{};      // of each state, by the innovation
    typename N::Gain torsion{};
    typename N::Gain output_velocity{};
    typename N::Gain load{};
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(by_torque), c(by_torsion), c(output), c(by_load), c(from_motor), c(from_output);
      c(velocity), c(torsion), c(output_velocity), c(load);
    }
  };
  template <class N>
  struct State {
    typename N::State velocity{};  // all in their bases
    typename N::State torsion{};
    typename N::State output_velocity{};
    typename N::State load{};
  };
  template <class N>
  struct Estimate {
    typename N::Value torsion{};          // of torsion_base
    typename N::Value output_velocity{};  // of output_velocity_base
    typename N::Value load{};             // of output_torque_base; positive resists
  };

  // Host only. Notes a tick that is too long for the resonance.
  template <class N, class P>
  static Coefficients<N> derive(const TorsionSetup<P>& s, const effects::DriveConstants<P>& d) {
    const P tick = d.time_base;
    const P by_torque = tick * d.torque_base / (s.inertia * d.velocity_base);
    const P by_torsion = tick * s.stiffness * d.torsion_base / (d.gear_ratio * s.inertia * d.velocity_base);
    const P output = tick * s.stiffness * d.torsion_base / (s.output_inertia * d.output_velocity_base);
    const P by_load = tick * d.output_torque_base / (s.output_inertia * d.output_velocity_base);
    const P from_motor = tick * d.velocity_base / (d.gear_ratio * d.torsion_base);
    const P from_output = tick * d.output_velocity_base / d.torsion_base;
    // A state within four bases, corrected by one, then stays within eight in all intermediate results.
    constexpr double kMost = 0.3;
    for (const P& x : {by_torque, by_torsion, output, by_load, from_motor, from_output})
      control::require(x > P(0.0) && x < P(kMost), "a tick of the torsion observer is too long for the resonance");
    const P one(1.0), none(0.0);
    const Matrix<P, 4> model{
        {{one, -by_torsion, none, none},
         {from_motor, one - from_motor * by_torsion - from_output * output, -from_output, from_output * by_load},
         {none, output, one, -by_load},
         {none, none, none, one}}};
    const P q_motor = by_torque * s.torque_noise / d.torque_base;
    const P q_load = s.load_walk * N::power(tick, P(0.5)) / d.output_torque_base;
    const P on_motor[] = {q_motor, from_motor * q_motor, none, none};
    const P on_load[] = {none, none, none, q_load};
    const Matrix<P, 4> noise = detail::filled<P, 4>(
        [&](std::size_t i, std::size_t j) { return on_motor[i] * on_motor[j] + on_load[i] * on_load[j]; });
    const P velocity_noise = s.velocity_noise / d.velocity_base;
    const P variance = velocity_noise * velocity_noise;
    const auto gain = steady_gain(steady_covariance(model, noise, variance), variance);
    return {N::share(by_torque),   N::share(by_torsion), N::share(output), N::share(by_load), N::share(from_motor),
            N::share(from_output), N::gain(gain[0]),     N::gain(gain[1]), N::gain(gain[2]),  N::gain(gain[3])};
  }
  // One tick: the torque that acted since the previous tick, and the motor's velocity now; both are differences from
  // the nominal motion, in bases and within two. Where they are not reliable, as where friction changes its sign at an
  // unknown tick, the model runs without a correction.
  template <class N>
  static constexpr Estimate<N> update(State<N>& s, const Coefficients<N>& c, typename N::Value torque,
                                      typename N::Value velocity, bool trusted = true) {
    const auto motor = s.velocity + N::times(N::widen(trusted ? torque : typename N::Value{}), c.by_torque) -
                       N::times(s.torsion, c.by_torsion);
    const auto output = s.output_velocity + N::times(s.torsion, c.output) - N::times(s.load, c.by_load);
    const auto torsion = s.torsion + N::times(motor, c.from_motor) - N::times(output, c.from_output);
    const auto innovation = trusted ? velocity - N::narrow(motor) : typename N::Value{};
    // Bounded, so that permanently wrong inputs cannot make the sums leave their range.
    s.velocity = N::bounded(motor + corrected<N>(innovation, c.velocity));
    s.torsion = N::bounded(torsion + corrected<N>(innovation, c.torsion));
    s.output_velocity = N::bounded(output + corrected<N>(innovation, c.output_velocity));
    s.load = N::bounded(s.load + corrected<N>(innovation, c.load));
    return {N::narrow(s.torsion), N::narrow(s.output_velocity), N::narrow(s.load)};
  }

 private:
  template <class N>
  static constexpr typename N::State corrected(typename N::Value innovation, typename N::Gain gain) {
    return N::widen(N::clamp(N::scaled(gain, innovation), N::one()));
  }
};

}  // namespace flexspline::observers
