// Feedforward: the torque for a set point by the drive's model, and the angle by which the motor has to lead the
// output.
//
// Position, velocity and acceleration of the set point determine inertia, friction (with its memory), the load and the
// torsion: they are free of noise, known without delay, and close no loop. Measured are
// - the motor's angle, for periodic effects (ripples, kinematic errors): a set point differs by the following error,
//   k times which is the error of a ripple's phase. This closes a loop, but one of known gain: a ripple of amplitude a
//   acts as a stiffness of at most k a, which has to stay far below that of the position loop.
// - temperature and a load that the model does not know: both change slowly. Neither angle nor velocity measured enters
//   friction: friction compensated by its own sign is a negative damping, with a limit cycle.
//
// Direction is clamp(w_set / band, 1): continuous, so that a set point with noise below the band cannot make friction
// chatter, and zero at standstill, where the direction of friction depends on the load.
#pragma once

#include <cstdint>

#include "shared/control/limits.hpp"
#include "shared/effects/effect.hpp"
#include "shared/model/drive_model.hpp"

namespace flexspline::control {

// In SI units.
template <class P>
struct FeedforwardSetup {
  P direction_band{};      // rad/s of the motor: above it friction acts in full
  P torque_limit{};        // N m at the motor
  P load_limit{};          // N m at the output
  P stiffness{};           // N m/rad at the output, the largest of the transmission; zero: no lead
  P torsion_limit{};       // rad at the output
  P torsion_rate_limit{};  // rad/s, of how fast the lead may change: jumps of the acceleration would make it jump
  P output_zero_turns{};   // of the motor where the output's angle is zero, for gravity
  // Structural damping of the transmission, `damping_torque` abs(rate)^damping_exponent (report eq. 78), N m at 1
  // rad/s: it lets the spring settle slowly, and the lead has to be as slow. Zero: none.
  P damping_torque{};
  P damping_exponent{P(0.5)};
};

struct Feedforward {
  // The torsion changes little within a tick: a drive computes the lead at every second one.
  static constexpr int kLeadTicks = 2;

  template <class N>
  struct Coefficients {
    typename N::Gain per_band{};
    typename N::Gain output_velocity{};
    typename N::Gain output_acceleration{};
    typename N::Order output_angle{};
    typename N::Step to_output_zero{};
    typename N::Gain share_of_load{};  // T/N
    typename N::Value torque_limit{};
    typename N::Value load_limit{};
    bool leads = false;
    typename N::Gain compliance{};
    typename N::Value torsion_limit{};
    typename N::Value torsion_change{};
    bool damped = false;
    typename N::RatioGain per_damping{};
    typename N::Exponent rate_exponent{};
    typename N::Value most_damping{};
    typename N::Value creep{};  // bases of torsion in a step at 1 rad/s
    typename N::Gain lead{};    // turns of the motor per torsion
    typename N::StepGain lead_velocity{};
    template <class Codec>
    constexpr void fields(Codec& c) {
      c(per_band), c(output_velocity), c(output_acceleration), c(output_angle), c(to_output_zero), c(share_of_load);
      c.limit(torque_limit), c.limit(load_limit), c(leads), c(compliance), c(torsion_limit), c(torsion_change);
      c(damped), c(per_damping), c(rate_exponent), c(most_damping), c(creep), c(lead), c(lead_velocity);
    }
  };
  template <class N>
  struct State {
    typename N::Value load{};  // torque through the flexspline, at the previous tick
    typename N::Value torsion{};
    typename N::State torsion_state{};  // the torsion; its change in a tick may be below the resolution of a value
    typename N::Step lead{};
    typename N::Value lead_velocity{};
  };
  template <class N>
  struct SetPoint {
    typename N::Angle position{};  // of the motor
    typename N::Value velocity{};
    typename N::Value acceleration{};
  };
  template <class N>
  struct Measured {
    typename N::Angle angle{};  // of the motor
    typename N::Value temperature{};
    typename N::Value load{};  // that the model does not know, output side
  };
  template <class N>
  struct Output {
    typename N::Value torque{};    // motor
    typename N::Step lead{};       // to be added to the motor's set point of position
    typename N::Value velocity{};  // of the lead, to be added to that of velocity
  };

  // Host only. The model's effects are derived with the same `d`; they determine the feedforward. Errors of sensors
  // must not be in it, as they do not act on a shaft.
  template <class N, class P>
  static Coefficients<N> derive(const FeedforwardSetup<P>& s, const effects::DriveConstants<P>& d, int lead_ticks = 1) {
    constexpr double kTurn = 6.283185307179586;
    require(s.direction_band > P(0.0), "the band of the direction has to be positive");
    require(s.torque_limit <= P(2.0) * d.torque_base && s.load_limit <= P(2.0) * d.output_torque_base,
            "a limit of a feedforward is not within two bases");
    Coefficients<N> c;
    c.per_band = N::gain(d.velocity_base / s.direction_band);
    c.output_velocity = N::gain(d.velocity_base / (d.gear_ratio * d.output_velocity_base));
    c.output_acceleration = N::gain(d.acceleration_base / (d.gear_ratio * d.output_acceleration_base));
    c.output_angle = N::order(P(kTurn) / d.gear_ratio);
    c.to_output_zero = N::steps(static_cast<std::int64_t>(static_cast<double>(-s.output_zero_turns) * 0x1p32));
    c.share_of_load = N::gain(d.output_torque_base / (d.gear_ratio * d.torque_base));
    c.torque_limit = N::value(s.torque_limit / d.torque_base);
    c.load_limit = N::value(s.load_limit / d.output_torque_base);
    c.leads = s.stiffness > P(0.0);
    if (!c.leads) return c;
    require(s.torsion_limit <= P(2.0) * d.torsion_base, "a limit of a torsion is not within two bases");
    require(s.torsion_rate_limit * d.gear_ratio <= P(2.0) * d.velocity_base,
            "the lead of a feedforward may change faster than two bases of velocity");
    c.compliance = N::gain(d.output_torque_base / (s.stiffness * d.torsion_base));
    c.torsion_limit = N::value(s.torsion_limit / d.torsion_base);
    const P lead_time = P(static_cast<double>(lead_ticks)) * d.time_base;
    c.torsion_change = N::value(s.torsion_rate_limit * lead_time / d.torsion_base);
    c.damped = s.damping_torque > P(0.0);
    if (c.damped) {
      require(s.damping_exponent >= P(0.1) && s.damping_exponent <= P(1.0),
              "the exponent of a feedforward's damping is not between 0.1 and 1");
      // Limited to eight radians a second, above which creep does not matter, so that powers stay in their range.
      const P most = s.damping_torque * N::power(P(8.0), s.damping_exponent) / d.output_torque_base;
      c.per_damping = N::ratio_gain(d.output_torque_base / s.damping_torque);
      c.rate_exponent = N::exponent(P(1.0) / s.damping_exponent);
      c.most_damping = N::value(most < P(8.0) ? most : P(8.0));
      c.creep = N::value(lead_time / d.torsion_base);
    }
    c.lead = N::gain(d.gear_ratio * d.torsion_base / d.angle_base);
    c.lead_velocity = N::step_gain(d.angle_base / (d.velocity_base * lead_time));
    return c;
  }

  // One tick. The set point within two bases. `steps_lead`: in the other ticks the lead is held.
  //   T = load(set point) + measured load;  torque = motor(set point, measured angle) + T/N
  //   dq += (T - transmission(dq))/K_largest, a chord step: it converges to the torsion at which the
  //   transmission carries T, for any curve that is not stiffer than K_largest; lead = N dq. With damping a step
  //   is at most T_step (abs(T - transmission(dq))/damping_torque)^(1/damping_exponent), the transmission's rate.
  // Friction that depends on the load takes the load of the previous tick.
  template <class N, class Image>
  static constexpr Output<N> update(State<N>& s, const Coefficients<N>& c, model::DriveModel<N, Image>& model,
                                    const SetPoint<N>& set, const Measured<N>& measured, bool steps_lead = true) {
    effects::Inputs<N> in{};
    in.angle = set.position;
    in.velocity = set.velocity;
    in.acceleration = set.acceleration;
    in.direction = N::clamp(N::scaled(c.per_band, set.velocity), N::one());
    if (model.reads(effects::kOutputAngle))
      in.output_angle = N::times_order(set.position + c.to_output_zero, c.output_angle);
    if (model.reads(effects::kOutputMotion)) {
      in.output_velocity = N::scaled(c.output_velocity, set.velocity);
      in.output_acceleration = N::scaled(c.output_acceleration, set.acceleration);
    }
    in.output_direction = in.direction;
    in.torsion = s.torsion;
    in.torque = s.load;
    in.temperature = measured.temperature;
    const effects::Torques<N> torques = model.tick(in, measured.angle);
    s.load = N::clamp(N::narrow(torques.load) + N::clamp(measured.load, c.load_limit), c.load_limit);
    typename N::Sum motor = torques.motor;
    motor += c.share_of_load * s.load;
    Output<N> out;
    out.torque = N::clamp(N::narrow(motor), c.torque_limit);
    if (c.leads && steps_lead) update_lead<N>(s, c, torques.transmission);
    out.lead = s.lead;
    out.velocity = s.lead_velocity;
    return out;
  }

 private:
  template <class N>
  static constexpr void update_lead(State<N>& s, const Coefficients<N>& c, typename N::Sum transmission) {
    const auto missing = s.load - N::clamp(N::narrow(transmission), c.load_limit + c.load_limit);
    auto change = N::widen(N::clamp(N::scaled(c.compliance, missing), c.torsion_change));
    if (c.damped) {
      const auto rate = N::pow_abs(N::ratio(c.per_damping, N::clamp(missing, c.most_damping)), c.rate_exponent);
      const auto four = N::one() + N::one() + N::one() + N::one();
      change = N::clamp(change, N::times(N::widen(N::clamp(rate, four)), c.creep));
    }
    const auto before = s.lead;
    s.torsion_state = N::clamp(s.torsion_state + change, c.torsion_limit);
    s.torsion = N::narrow(s.torsion_state);
    s.lead = N::distance(c.lead, s.torsion);
    s.lead_velocity = N::narrow(N::signal(c.lead_velocity, s.lead - before));
  }
};

}  // namespace flexspline::control
