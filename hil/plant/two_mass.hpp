#pragma once

#include "hil/plant/transmission.hpp"

namespace flexspline::plant {

/// The numbers of the two-mass drive (model 3 of the report), in SI units. Effects that are absent are zero.
struct Physics {
  double gear_ratio = 100.0;
  double torque_constant = 0.0;
  double motor_inertia = 0.0;
  MotorFriction friction;
  /// The motor's torque is Km (i - saturation i^3); the amplifier gives at most `current_limit_a`.
  double torque_saturation = 0.0;
  double current_limit_a = 0.0;  ///< zero: none
  Transmission transmission;
  double damping_torque = 0.0;  ///< at a torsion rate of 1 rad/s
  double damping_exponent = 1.0;
  double output_inertia = 0.0;
  double output_viscous = 0.0;
  double output_coulomb = 0.0;
  double gravity_cosine = 0.0;
  double gravity_sine = 0.0;
};

/// Positions and velocities of both shafts. `damping` is the signed power |v|^alpha s(v) of the torsion rate; it is a
/// state because it keeps its precision where v itself is too small.
struct Shafts : FrictionMemory {
  double motor_angle = 0.0;
  double motor_velocity = 0.0;
  double output_angle = 0.0;
  double output_velocity = 0.0;
  double damping = 0.0;
  int motor_direction = 0;  ///< branch of the friction: +1, -1, or 0 for exact sticking
  int output_direction = 0;
};
struct State : Shafts {
  LoopState loops;
};

struct Inputs {
  double current_a = 0.0;  ///< true motor current, constant over the call
  double temperature_c = 30.0;
  double load_torque_nm = 0.0;  ///< on the output, positive resists
};

/// Motor, flexspline and load. Each step is an L-stable, second-order, two-stage implicit Runge-Kutta step on fixed
/// branches of both frictions; where a velocity changes its sign or sticking ends inside it, the step is split there.
class TwoMass {
 public:
  /// Only angles, velocities and the memory of the friction count in `initial`; the rest follows from them. Throws
  /// std::invalid_argument for inertias, stiffness, gear ratio or damping exponent that are not positive.
  TwoMass(Physics physics, bool locked, State initial = {});

  /// Advances by `duration_s` in `steps` equal steps.
  void advance(const Inputs& inputs, double duration_s, int steps);

  const State& state() const { return state_; }
  const Physics& physics() const { return physics_; }
  /// Torque through the flexspline, output side, N m.
  double torque() const { return torque(state_); }
  /// Motor acceleration at the present state with these inputs, rad/s^2.
  double motor_acceleration(const Inputs& inputs) const;
  /// Kinetic and spring energy with gravity's potential, J; the energy of a bristle is not in it.
  double energy() const;

 private:
  /// Known parts of one implicit stage: state = base + weight * rate(state).
  struct Stage {
    double motor_angle, motor_velocity, output_angle, output_velocity, weight;
  };
  /// Values common to both stages of a step of a linear drive with both shafts turning.
  struct FastPath {
    double weight = 0.0;  ///< zero: not made yet
    double viscous = 0.0;
    int motor_direction = 0;
    double motor_slope = 0.0, output_slope = 0.0;  ///< of the residuals over the velocities
    double motor_gain = 0.0, output_gain = 0.0;    ///< of the velocities over the torque
    double by_torsion = 0.0;                       ///< torque over the rate of torsion, of the spring
    double by_rate = 0.0, by_power = 0.0;          ///< of the equation for the damping's power
    double discriminant = 0.0, four_by_rate = 0.0;
    bool has_closed_form = false;
  };
  enum class Event { none, motor_stop, output_stop, motor_break, output_break };

  double torsion(const State& s) const {
    const double twist = s.motor_angle / physics_.gear_ratio - s.output_angle;
    return has_plain_spring_ ? twist : twist + physics_.transmission.error(s.motor_angle);
  }
  /// Spring and loops at the torsion of `s`, from the loops' present state.
  TorqueSlope elastic(const State& s) const {
    return has_plain_spring_ ? physics_.transmission.polynomial(torsion(s)) : elastic_with_loops(s);
  }
  TorqueSlope elastic_with_loops(const State& s) const;
  double torque(const State& s) const { return elastic(s).torque + physics_.damping_torque * s.damping; }
  /// The state of a drive without loops is that of its shafts: the rest, which is large, is not copied at each step.
  void copy(const State& from, State& to) const {
    if (has_loops_) {
      to = from;
    } else {
      static_cast<Shafts&>(to) = from;
    }
  }
  /// How much faster the spring twists than the output, for each rad/s of the motor.
  double ratio(double motor_angle) const {
    return has_plain_spring_ ? per_gear_ : per_gear_ + physics_.transmission.error_slope(motor_angle);
  }
  double drive_torque(const Inputs& inputs) const;
  double rate_of(double damping) const;
  double damping_of(double rate) const;
  FrictionPoint friction_point(const State& s, double direction) const;
  double gravity(double angle) const;
  /// Newton's step of a velocity is free - gain * (step of the torque).
  struct Response {
    double free = 0.0, gain = 0.0;
  };
  Response motor_response(const Stage& stage, const State& start, const State& s, double torque, double ratio) const;
  Response output_response(const Stage& stage, const State& s, double torque) const;
  /// Of the torsion rate: its residual, and what it makes of the torque.
  struct TorsionRate {
    double value = 0.0, free = 0.0, gain = 0.0, spring_slope = 0.0;
  };
  struct TorqueStep {
    double torque = 0.0, damping = 0.0;
  };
  TorqueStep torque_step(const TorsionRate& rate, double damping) const;
  bool solve_stage(const Stage& stage, const State& start, State& s) const;
  const FastPath& fast_path(double weight);
  Shafts solve_fast_path(const FastPath& known, const Stage& stage, const Shafts& start) const;
  bool take_fast_step(double h);
  static Stage second_stage(const Shafts& before, const Shafts& after, double weight);  ///< the second of a step
  bool try_step(const State& from, double h, State& to) const;
  void take_step(double h);
  double margin(Event event, const State& s) const;
  Event first_event(const State& from, double h, State& to, double& taken) const;
  double locate(Event event, const State& from, double h, const State& at_h) const;
  void choose_resting_branches(State& s) const;
  int choose_motor_direction(const State& s) const;
  int choose_output_direction(const State& s) const;
  void resolve_resting(State& s, double h) const;
  bool consistent(const State& from, const State& to) const;

  Physics physics_;
  bool locked_;
  // Effects that the drive does not have take no time in a step.
  bool has_loops_;
  bool has_plain_spring_;  ///< a polynomial of the torsion, and no error of the gear
  bool has_plain_friction_;
  bool has_gravity_;
  bool has_root_damping_;  ///< of exponent 0.5
  bool is_linear_;         ///< except for that and the signs
  bool has_fast_path_;     ///< is linear, with that damping, and free
  double per_gear_;        ///< of the gear's ratio
  State state_;
  State next_;  ///< at the end of the step that is being taken
  Inputs inputs_;
  double motor_drive_ = 0.0;  // Km i
  double viscous_ = 0.0;
  FastPath fast_path_;
};

}  // namespace flexspline::plant
