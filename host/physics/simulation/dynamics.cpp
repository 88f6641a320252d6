#include "host/physics/simulation/dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/physics/simulation/root.hpp"

namespace flexspline::simulation {
namespace {

constexpr double kGamma = 1.0 - 1.0 / std::numbers::sqrt2;
// Velocities at the output are solved to this, those at the motor to the gear ratio times as much; far below what any
// sensor resolves and far above rounding.
constexpr double kVelocityTolerance = 1e-10;
// A shorter stage has a larger inertia per time, and so a larger torque for the same velocity.
constexpr double kUsualStage = 2e-5;

int sign_of(double x) {
  return x > 0.0 ? 1 : x < 0.0 ? -1 : 0;
}

Forcing between(const Forcing& begin, const Forcing& end, double share) {
  const auto mix = [&](double a, double b) { return a + (b - a) * share; };
  return {mix(begin.effort, end.effort), mix(begin.current, end.current), mix(begin.load_torque, end.load_torque),
          mix(begin.temperature, end.temperature)};
}

double tolerance_of(double theta) {
  return kVelocityTolerance * std::clamp(theta / kUsualStage, 1e-5, 1.0);
}

}  // namespace

Dynamics::Dynamics(Balances balances, const catalogue::DriveConstants<double>& constants, Coupling coupling)
    : balances_(std::move(balances)),
      coupling_(coupling),
      gear_ratio_(constants.gear_ratio),
      motor_inertia_(balances_.motor_inertia()),
      output_inertia_(balances_.output_inertia()) {
  now_.viscous_scale = now_.coulomb_scale = 1.0;
  now_.temperature = constants.reference_temperature;
  before_ = now_;
  if (coupling_ != Coupling::rigid) power_ = steepness_at_rest();
}

void Dynamics::set_motor(double velocity, int direction) {
  now_.velocity = velocity;
  now_.speed = std::abs(velocity);
  now_.direction = direction;
  now_.angle = stage_.base.motor_position + stage_.theta * velocity;
  now_.acceleration = (velocity - stage_.base.motor_velocity) / stage_.theta;
}

void Dynamics::set_output(double velocity, int direction) {
  now_.output_velocity = velocity;
  now_.output_direction = direction;
  now_.output_angle = stage_.base.output_position + stage_.theta * velocity;
  now_.output_acceleration = (velocity - stage_.base.output_velocity) / stage_.theta;
}

void Dynamics::set_torque(double torque) {
  now_.torque = torque;
  now_.torque_magnitude = std::abs(torque);
}

void Dynamics::set_forcing(const Forcing& forcing) {
  now_.current = forcing.current;
  now_.temperature = forcing.temperature;
}

Torques Dynamics::sum(Balance balance) {
  const auto add = [&](const Inputs& inputs) {
    Torques sums;
    switch (balance) {
      case Balance::motor:
        balances_.add_motor(inputs, before_, sums);
        break;
      case Balance::transmission:
        balances_.add_transmission(inputs, before_, sums);
        break;
      case Balance::load:
        balances_.add_load(inputs, before_, sums);
        break;
    }
    return sums;
  };
  return balances_.changes_inputs() ? add(seen_by_effects()) : add(now_);
}

Inputs Dynamics::seen_by_effects() const {
  Inputs seen = now_;
  if (!balances_.changes_inputs()) return seen;
  balances_.change(seen);
  // A shift that turns with the motor changes the torsion's rate, and with it its direction.
  if (seen.torsion_rate != now_.torsion_rate) seen.torsion_direction = sign_of(seen.torsion_rate);
  return seen;
}

double Dynamics::transmission_torque(double torsion_rate) {
  const double base = stage_.base.motor_position / gear_ratio_ - stage_.base.output_position - torsion_zero_;
  now_.torsion = base + stage_.theta * torsion_rate;
  now_.torsion_rate = torsion_rate;
  now_.torsion_direction = sign_of(torsion_rate);
  Torques sums = sum(Balance::transmission);
  // Effects that read the torque which they are part of: their share is small, so a few rounds settle it.
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds && balances_.transmission_reads_torque(); ++round) {
    set_torque(sums.transmission);
    sums = sum(Balance::transmission);
  }
  motor_share_ = sums.motor;
  load_share_ = sums.load;
  return sums.transmission;
}

// Damping like abs(v)^alpha with alpha < 1 has an infinite slope at rest; the answer is 1/alpha, from the torque at two
// tiny rates.
double Dynamics::steepness_at_rest() {
  constexpr double kTiny = 1e-12;
  stage_ = {};
  const double rest = transmission_torque(0.0);
  const double one = transmission_torque(kTiny) - rest;
  const double two = transmission_torque(2.0 * kTiny) - rest;
  if (!(one > 0.0 && two > one)) return 1.0;
  const double power = std::clamp(1.0 / std::log2(two / one), 1.0, 10.0);
  // A whole power, which costs far less to compute, comes out with rounding.
  return std::abs(power - std::round(power)) < 1e-9 ? std::round(power) : power;
}

template <class Residual>
Dynamics::SolvedVelocity Dynamics::solve_set_valued(Residual&& residual, double guess, double slope, double tolerance,
                                                    int held, int last) const {
  const double limit = tolerance * slope;
  const auto moving = [&](int direction, double from, double low, double high) {
    return find_root([&](double velocity) { return residual(velocity, direction); }, from, slope, limit, low, high).x;
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (held != 0) return {moving(held, guess, -kInfinity, kInfinity), held};
  const int expected = sign_of(guess);
  if (expected != 0) {
    const double velocity = moving(expected, guess, -kInfinity, kInfinity);
    if (sign_of(velocity) == expected) return {velocity, expected};
  }
  // What is left over at rest, by the direction in which the shaft would start.
  const double forward = residual(0.0, 1);
  const double backward = residual(0.0, -1);
  const bool starts_forward = forward < -limit;
  const bool starts_backward = backward > limit;
  if (starts_forward && !(starts_backward && last < 0)) return {moving(1, -forward / slope, 0.0, kInfinity), 1};
  if (starts_backward) return {moving(-1, -backward / slope, -kInfinity, 0.0), -1};
  return {0.0, 0};
}

// As solve_set_valued, in closed form.
Dynamics::SolvedVelocity Dynamics::solve_piecewise_linear(const PiecewiseLinear& c, double base, double driving,
                                                          double guess, double limit, int held, int last) const {
  const auto in = [&](int direction) {
    return SolvedVelocity{c.velocity_in(direction, base, stage_.theta, driving), direction};
  };
  if (held != 0) return in(held);
  const int expected = sign_of(guess);
  if (expected != 0) {
    const SolvedVelocity moving = in(expected);
    if (sign_of(moving.velocity) == expected) return moving;
  }
  const bool starts_forward = c.left_at_rest(1.0, base, stage_.theta, driving) < -limit;
  const bool starts_backward = c.left_at_rest(-1.0, base, stage_.theta, driving) > limit;
  if (starts_forward && !(starts_backward && last < 0)) return in(1);
  if (starts_backward) return in(-1);
  return {0.0, 0};
}

Dynamics::SolvedVelocity Dynamics::solve_motor(double torque) {
  const double slope = motor_inertia_ / stage_.theta;
  const double guess = guess_motor_ - (torque - guess_torque_) / (gear_ratio_ * slope);
  set_torque(torque);
  const double driving = stage_.forcing.effort - torque / gear_ratio_ - motor_share_;
  const double tolerance = 0.1 * gear_ratio_ * tolerance_;
  if (const PiecewiseLinear* all = balances_.all_of_motor())
    return solve_piecewise_linear(*all, stage_.base.motor_velocity, driving, guess, tolerance * slope,
                                  stage_.held.motor, last_.motor_direction);
  return solve_set_valued(
      [&](double velocity, int direction) {
        set_motor(velocity, direction);
        const Torques sums = sum(Balance::motor);
        return sums.motor - driving;
      },
      guess, slope, tolerance, stage_.held.motor, last_.motor_direction);
}

Dynamics::SolvedVelocity Dynamics::solve_load(double torque) {
  if (coupling_ == Coupling::locked_output) return {};
  const double slope = output_inertia_ / stage_.theta;
  const double guess = guess_output_ + (torque - guess_torque_) / slope;
  set_torque(torque);
  const double driving = torque - stage_.forcing.load_torque - load_share_;
  const double tolerance = 0.1 * tolerance_;
  if (const PiecewiseLinear* all = balances_.all_of_load())
    return solve_piecewise_linear(*all, stage_.base.output_velocity, driving, guess, tolerance * slope,
                                  stage_.held.output, last_.output_direction);
  return solve_set_valued(
      [&](double velocity, int direction) {
        set_output(velocity, direction);
        const Torques sums = sum(Balance::load);
        return sums.load - driving;
      },
      guess, slope, tolerance, stage_.held.output, last_.output_direction);
}

// The torsion rate v decides all: the transmission's torque grows with it, so the motor is slower and the output
// faster, and v - (w/N - wo) grows with a slope of one or more.
void Dynamics::solve_coupled(Solution& solution) {
  SolvedVelocity motor;
  SolvedVelocity output;
  double torque = 0.0;
  const auto solve_shafts = [&](double at) {
    torque = at;
    motor = solve_motor(torque);
    set_motor(motor.velocity, motor.direction);
    output = solve_load(torque);
    set_output(output.velocity, output.direction);
    guess_torque_ = torque;
    guess_motor_ = motor.velocity;
    guess_output_ = output.velocity;
  };
  const auto rate_of = [&](double x) {
    if (power_ <= 1.0) return x;
    return power_ == 2.0 ? x * std::abs(x) : std::copysign(std::pow(std::abs(x), power_), x);
  };
  const auto mismatch = [&](double x) {
    const double rate = rate_of(x);
    solve_shafts(transmission_torque(rate));
    return rate - motor.velocity / gear_ratio_ + output.velocity;
  };
  const Root root = find_root(mismatch, rate_root_, rate_slope_, tolerance_);
  if (root.jump) {
    // The torque itself is set-valued there: take the one between that makes the velocities fit.
    const double low = mismatch(root.low);
    const double torque_low = torque;
    const double high = mismatch(root.high);
    solve_shafts(torque_low + (torque - torque_low) * std::clamp(-low / (high - low), 0.0, 1.0));
  }
  rate_root_ = root.x;
  rate_slope_ = root.slope;
  solution.torque = torque;
  solution.torsion_rate = motor.velocity / gear_ratio_ - output.velocity;
  solution.state.motor_velocity = motor.velocity;
  solution.motor_direction = motor.direction;
  solution.state.output_velocity = output.velocity;
  solution.output_direction = output.direction;
}

void Dynamics::solve_rigid(Solution& solution) {
  const double slope = (motor_inertia_ + output_inertia_ / (gear_ratio_ * gear_ratio_)) / stage_.theta;
  const auto residual = [&](double velocity, int direction) {
    set_motor(velocity, direction);
    set_output(velocity / gear_ratio_, direction);
    const Torques load = sum(Balance::load);
    set_torque(load.load + stage_.forcing.load_torque);
    const Torques motor = sum(Balance::motor);
    return motor.motor + now_.torque / gear_ratio_ - stage_.forcing.effort;
  };
  const SolvedVelocity motor = solve_set_valued(residual, guess_motor_, slope, 0.1 * gear_ratio_ * tolerance_,
                                                stage_.held.motor, last_.motor_direction);
  // The last evaluation was within the tolerance of the solution, unless it was that of another direction.
  if (now_.direction != motor.direction) residual(motor.velocity, motor.direction);
  solution.torque = now_.torque;
  solution.state.motor_velocity = motor.velocity;
  solution.state.output_velocity = motor.velocity / gear_ratio_;
  solution.motor_direction = solution.output_direction = motor.direction;
}

Dynamics::Solution Dynamics::solve(const Stage& stage) {
  stage_ = stage;
  tolerance_ = tolerance_of(stage.theta);
  set_forcing(stage.forcing);
  now_.elapsed = stage.elapsed;
  guess_motor_ = stage.base.motor_velocity + stage.theta * last_.motor_acceleration;
  guess_output_ = stage.base.output_velocity + stage.theta * last_.output_acceleration;
  guess_torque_ = last_.torque;
  set_motor(guess_motor_, sign_of(guess_motor_));
  set_output(guess_output_, sign_of(guess_output_));
  set_torque(last_.torque);
  Solution solution;
  if (coupling_ == Coupling::rigid)
    solve_rigid(solution);
  else
    solve_coupled(solution);
  State& end = solution.state;
  end.motor_position = stage.base.motor_position + stage.theta * end.motor_velocity;
  end.output_position = stage.base.output_position + stage.theta * end.output_velocity;
  solution.motor_acceleration = (end.motor_velocity - stage.base.motor_velocity) / stage.theta;
  solution.output_acceleration = (end.output_velocity - stage.base.output_velocity) / stage.theta;
  last_ = solution;
  return solution;
}

Dynamics::StepAttempt Dynamics::attempt(const Forcing& begin, const Forcing& end, double duration,
                                        HeldDirections held) {
  const double theta = kGamma * duration;
  const double rest = duration - theta;
  StepAttempt attempted;
  attempted.middle = solve({theta, theta, state_, between(begin, end, kGamma), held});
  attempted.duration = duration;
  const Solution& m = attempted.middle;
  const State base{
      state_.motor_position + rest * m.state.motor_velocity, state_.motor_velocity + rest * m.motor_acceleration,
      state_.output_position + rest * m.state.output_velocity, state_.output_velocity + rest * m.output_acceleration};
  attempted.end = solve({theta, duration, base, end, held});
  return attempted;
}

double Dynamics::advance_to_standstill(const Forcing& begin, const Forcing& end, double duration, HeldDirections held,
                                       StepAttempt attempted) {
  constexpr double kNegligible = 1e-6;  // of the step
  double time = duration;
  Forcing until = end;
  for (int refinement = 0; refinement < 4; ++refinement) {
    // The velocity is all but linear within a step.
    double share = 1.0;
    const auto consider = [&](int direction, double from, double to) {
      if (direction != 0 && to * direction < 0.0) share = std::min(share, from / (from - to));
    };
    consider(held.motor, state_.motor_velocity, attempted.end.state.motor_velocity);
    consider(held.output, state_.output_velocity, attempted.end.state.output_velocity);
    if (share > 1.0 - 1e-4) break;
    time *= share;
    if (time < kNegligible * duration) break;
    until = between(begin, end, time / duration);
    attempted = attempt(begin, until, time, held);
  }
  const State from = state_;
  if (time >= kNegligible * duration)
    accept(attempted, until);
  else
    time = 0.0;
  // What has all but stopped has stopped.
  constexpr double kStopped = 1e-3;
  const auto stop = [](int direction, double started, double& velocity) {
    const bool stopped = direction != 0 && velocity * direction < kStopped * std::abs(started);
    if (stopped) velocity = 0.0;
    return stopped;
  };
  if (time == 0.0) {
    if (held.motor != 0 &&
        (held.output == 0 || std::abs(state_.motor_velocity) <= gear_ratio_ * std::abs(state_.output_velocity)))
      state_.motor_velocity = 0.0;
    else
      state_.output_velocity = 0.0;
  } else {
    stop(held.motor, from.motor_velocity, state_.motor_velocity);
    stop(held.output, from.output_velocity, state_.output_velocity);
  }
  if (coupling_ == Coupling::rigid && state_.motor_velocity == 0.0) state_.output_velocity = 0.0;
  return time;
}

void Dynamics::fill(const Solution& solution) {
  now_.velocity = solution.state.motor_velocity;
  now_.speed = std::abs(now_.velocity);
  now_.direction = solution.motor_direction;
  now_.angle = solution.state.motor_position;
  now_.acceleration = solution.motor_acceleration;
  now_.output_velocity = solution.state.output_velocity;
  now_.output_direction = solution.output_direction;
  now_.output_angle = solution.state.output_position;
  now_.output_acceleration = solution.output_acceleration;
  now_.torsion = now_.angle / gear_ratio_ - now_.output_angle - torsion_zero_;
  now_.torsion_rate = solution.torsion_rate;
  now_.torsion_direction = sign_of(solution.torsion_rate);
  set_torque(solution.torque);
}

void Dynamics::accept(const StepAttempt& attempted, const Forcing& forcing) {
  state_ = attempted.end.state;
  torque_ = attempted.end.torque;
  if (!balances_.has_state()) return;
  set_forcing(forcing);
  fill(attempted.end);
  now_.elapsed = attempted.duration;
  const Inputs seen = seen_by_effects();
  balances_.advance(seen, before_);
  before_ = seen;
}

Dynamics::Accelerations Dynamics::step(const Forcing& begin, const Forcing& end, double duration) {
  Accelerations accelerations;
  Forcing from = begin;
  double left = duration;
  // Each shaft can come to rest once; what starts from rest within a step is not divided again.
  constexpr int kMostEvents = 4;
  for (int piece = 0;; ++piece) {
    StepAttempt attempted = attempt(from, end, left, {});
    if (piece == 0) accelerations.first = attempted.middle.motor_acceleration;
    const auto turned = [](double velocity, int middle, int last) {
      const int direction = sign_of(velocity);
      return middle == direction && last == direction ? 0 : direction;
    };
    HeldDirections held{turned(state_.motor_velocity, attempted.middle.motor_direction, attempted.end.motor_direction),
                        0};
    if (coupling_ == Coupling::two_masses)
      held.output = turned(state_.output_velocity, attempted.middle.output_direction, attempted.end.output_direction);
    if (piece == kMostEvents || (held.motor == 0 && held.output == 0)) {
      accept(attempted, end);
      accelerations.last = attempted.end.motor_acceleration;
      return accelerations;
    }
    attempted = attempt(from, end, left, held);
    const double time = advance_to_standstill(from, end, left, held, attempted);
    accelerations.last = last_.motor_acceleration;
    if (time > left * (1.0 - 1e-6)) return accelerations;
    from = between(from, end, time / left);
    left -= time;
  }
}

double Dynamics::torque_at_rest(double torsion) {
  stage_ = {};
  stage_.theta = 1.0;
  now_.torsion = torsion;
  now_.torsion_rate = now_.torsion_direction = 0.0;
  return sum(Balance::transmission).transmission;
}

double Dynamics::steady_load_torque(const State& state, const Forcing& forcing) {
  set_forcing(forcing);
  Solution steady;
  steady.state = state;
  steady.motor_direction = sign_of(state.motor_velocity);
  steady.output_direction = sign_of(state.output_velocity);
  fill(steady);
  return sum(Balance::load).load + forcing.load_torque;
}

void Dynamics::start(const State& state, const Forcing& forcing, bool torsion_known, double torque_limit,
                     double resting_torque) {
  torsion_zero_ = 0.0;
  Solution begin;
  begin.state = state;
  begin.motor_direction = sign_of(state.motor_velocity);
  begin.output_direction = sign_of(state.output_velocity);
  begin.torsion_rate = state.motor_velocity / gear_ratio_ - state.output_velocity;
  begin.torque = resting_torque;
  set_forcing(forcing);
  if (coupling_ != Coupling::rigid) {
    fill(begin);
    const double apparent = now_.torsion;
    const bool plausible = torsion_known && std::abs(torque_at_rest(apparent)) <= torque_limit;
    if (!plausible) {
      constexpr double kProbe = 1e-6;
      const double slope = (torque_at_rest(kProbe) - torque_at_rest(0.0)) / kProbe;
      const double tolerance = 1e-9 * std::max(1.0, std::abs(resting_torque));
      const Root root = find_root([&](double torsion) { return torque_at_rest(torsion) - resting_torque; }, 0.0,
                                  slope > 0.0 ? slope : 1.0, tolerance);
      // Without a spring, a torque at rest has no torsion.
      const double resting = root.converged || root.jump ? root.x : 0.0;
      if (!torsion_known && coupling_ == Coupling::two_masses)
        begin.state.output_position += apparent - resting;
      else
        torsion_zero_ = apparent - resting;
    }
    fill(begin);
    stage_ = {};
    begin.torque = sum(Balance::transmission).transmission;
    rate_root_ = power_ <= 1.0
                     ? begin.torsion_rate
                     : std::copysign(std::pow(std::abs(begin.torsion_rate), 1.0 / power_), begin.torsion_rate);
    rate_slope_ = 1.0;
  }
  fill(begin);
  state_ = begin.state;
  torque_ = begin.torque;
  before_ = now_;
  balances_.change(before_);
  last_ = begin;
}

}  // namespace flexspline::simulation
