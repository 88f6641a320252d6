// Equations of motion of a model, integrated step by step.
//
// Method: a two-stage diagonally implicit Runge-Kutta scheme of second order, stiffly accurate and L-stable (gamma = 1
// - 1/sqrt(2)), so that damping however stiff dies out. Friction is set-valued: a shaft moves forward, backward or
// rests, and the one that agrees with the resulting velocity is taken. A shaft that comes to rest or reverses within a
// step has the step divided there, which keeps the order and makes standstill exact.
#pragma once

#include "host/physics/simulation/balances.hpp"

namespace flexspline::simulation {

// What makes motor and output move as one or as two.
enum class Coupling { two_masses, locked_output, rigid };

struct State {
  double motor_position = 0.0;
  double motor_velocity = 0.0;
  double output_position = 0.0;
  double output_velocity = 0.0;
};

// What acts from outside.
struct Forcing {
  double effort = 0.0;   // torque (force) at the motor as measured
  double current = 0.0;  // what effects see as current
  double load_torque = 0.0;
  double temperature = 0.0;
};

class Dynamics {
 public:
  struct Accelerations {
    double first = 0.0;  // at the beginning of the step
    double last = 0.0;   // at its end
  };

  // `constants` as the balances were made with.
  Dynamics(Balances balances, const catalogue::DriveConstants<double>& constants, Coupling coupling);

  // Begins at `state`. Where `torsion_known` is false, or the torque by the positions' difference exceeds
  // `torque_limit` (output side, positive), the zero of the torsion is put where the transmission carries
  // `resting_torque`.
  void start(const State& state, const Forcing& forcing, bool torsion_known, double torque_limit,
             double resting_torque);
  // The torque that the load takes in steady motion (N m), for `start`.
  double steady_load_torque(const State& state, const Forcing& forcing);

  // One step of `duration` seconds; forcing is linear between its ends. Returns motor accelerations.
  Accelerations step(const Forcing& begin, const Forcing& end, double duration);

  const State& state() const { return state_; }
  double torque() const { return torque_; }

 private:
  // +1 or -1 holds a shaft's friction to that direction through zero; 0 leaves it free.
  struct HeldDirections {
    int motor = 0;
    int output = 0;
  };
  // An implicit stage: velocity = base + theta * acceleration, position = base + theta * velocity.
  struct Stage {
    double theta = 0.0;
    double elapsed = 0.0;  // since the step began
    State base;
    Forcing forcing;
    HeldDirections held;
  };
  struct Solution {
    State state;
    double motor_acceleration = 0.0;
    double output_acceleration = 0.0;
    double torque = 0.0;
    double torsion_rate = 0.0;
    int motor_direction = 0;
    int output_direction = 0;
  };
  struct StepAttempt {
    Solution middle;
    Solution end;
    double duration = 0.0;
  };
  struct SolvedVelocity {
    double velocity = 0.0;
    int direction = 0;
  };

  StepAttempt attempt(const Forcing& begin, const Forcing& end, double duration, HeldDirections held);
  // Moves on to the first standstill of a held shaft, at most `duration`. Returns the time that took.
  double advance_to_standstill(const Forcing& begin, const Forcing& end, double duration, HeldDirections held,
                               StepAttempt attempted);
  void accept(const StepAttempt& attempted, const Forcing& forcing);

  Solution solve(const Stage& stage);
  void solve_coupled(Solution& solution);
  void solve_rigid(Solution& solution);
  SolvedVelocity solve_motor(double torque);
  SolvedVelocity solve_load(double torque);
  template <class Residual>
  SolvedVelocity solve_set_valued(Residual&& residual, double guess, double slope, double tolerance, int held,
                                  int last) const;

  SolvedVelocity solve_piecewise_linear(const PiecewiseLinear& c, double base, double driving, double guess,
                                        double limit, int held, int last) const;

  void set_motor(double velocity, int direction);
  void set_output(double velocity, int direction);
  void set_torque(double torque);
  Torques sum(Balance balance);
  // The inputs under work, with shifts and modulations.
  Inputs seen_by_effects() const;
  double transmission_torque(double torsion_rate);
  double torque_at_rest(double torsion);
  double steepness_at_rest();
  void set_forcing(const Forcing& forcing);
  void fill(const Solution& solution);

  Balances balances_;
  Coupling coupling_;
  double gear_ratio_;
  double motor_inertia_;
  double output_inertia_;
  // The torsion rate is searched for as sign(x) abs(x)^power, which makes a damping that is steep at rest linear.
  double power_ = 1.0;
  double torsion_zero_ = 0.0;

  State state_;
  double torque_ = 0.0;
  Inputs before_{};  // at state_, as effects see it
  Inputs now_{};     // under work
  Stage stage_;
  double tolerance_ = 0.0;  // of its velocities at the output
  // What effects of one balance add to another, from when they were last summed.
  double motor_share_ = 0.0;
  double load_share_ = 0.0;
  // First guesses, from the last solution.
  Solution last_;
  double rate_root_ = 0.0;
  double rate_slope_ = 1.0;
  double guess_torque_ = 0.0;
  double guess_motor_ = 0.0;
  double guess_output_ = 0.0;
};

}  // namespace flexspline::simulation
