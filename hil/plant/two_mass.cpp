#include "hil/plant/two_mass.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace flexspline::plant {
namespace {

// The L-stable, stiffly accurate SDIRK pair of order two (Alexander 1977): the last stage is the step.
constexpr double kGamma = 1.0 - std::numbers::sqrt2 / 2.0;
constexpr double kCarry = (1.0 - kGamma) / kGamma;

constexpr int kNewtonLimit = 40;
constexpr int kEventLimit = 24;
constexpr int kLocateLimit = 60;
constexpr double kMotorStopTolerance = 1e-12;   // rad/s
constexpr double kOutputStopTolerance = 1e-14;  // rad/s
constexpr double kBreakTolerance = 1e-12;       // N m

}  // namespace

TwoMass::TwoMass(Physics physics, bool locked, State initial)
    : physics_(std::move(physics)),
      locked_(locked),
      has_loops_(!physics_.transmission.loops.empty()),
      has_plain_spring_(physics_.transmission.is_polynomial() && !has_loops_),
      has_plain_friction_(physics_.friction.is_plain()),
      has_gravity_(physics_.gravity_cosine != 0.0 || physics_.gravity_sine != 0.0),
      has_root_damping_(physics_.damping_exponent == 0.5),
      is_linear_(has_plain_spring_ && physics_.transmission.quadratic_stiffness == 0.0 &&
                 physics_.transmission.cubic_stiffness == 0.0 && has_plain_friction_ &&
                 physics_.friction.quadratic == 0.0 && !has_gravity_ &&
                 (physics_.damping_torque == 0.0 || has_root_damping_ || physics_.damping_exponent == 1.0)),
      has_fast_path_(is_linear_ && has_root_damping_ && physics_.damping_torque > 0.0 && !locked_),
      per_gear_(1.0 / physics_.gear_ratio),
      state_(initial) {
  const bool usable = physics_.motor_inertia > 0.0 && physics_.transmission.has_spring() && physics_.gear_ratio > 0.0 &&
                      physics_.damping_exponent > 0.0 && (locked_ || physics_.output_inertia > 0.0);
  if (!usable) {
    throw std::invalid_argument(
        "plant: inertias, stiffness, gear ratio and damping exponent must be positive; check the plant's effects");
  }
  if (locked_) {
    state_.output_angle = 0.0;
    state_.output_velocity = 0.0;
  }
  const auto direction = [](double velocity) { return velocity > 0.0 ? 1 : (velocity < 0.0 ? -1 : 0); };
  state_.motor_direction = direction(state_.motor_velocity);
  state_.output_direction = direction(state_.output_velocity);
  state_.damping = damping_of(state_.motor_velocity * ratio(state_.motor_angle) - state_.output_velocity);
  state_.loops = physics_.transmission.loops.at_rest();
  state_.loops.torsion = torsion(state_);
}

TorqueSlope TwoMass::elastic_with_loops(const State& s) const {
  const double x = torsion(s);
  const TorqueSlope sum = physics_.transmission.spring(x);
  if (!has_loops_) return sum;
  const Loops& loops = physics_.transmission.loops;
  const TorqueSlope more = loops.torque(loops.ahead(s.loops, x, false), x >= s.loops.torsion ? 1.0 : -1.0);
  return {sum.torque + more.torque, sum.slope + more.slope};
}

double TwoMass::drive_torque(const Inputs& inputs) const {
  const double limit = physics_.current_limit_a;
  const double i = limit > 0.0 ? std::clamp(inputs.current_a, -limit, limit) : inputs.current_a;
  return physics_.torque_constant * (i - physics_.torque_saturation * i * i * i);
}

double TwoMass::rate_of(double damping) const {
  const double magnitude = std::abs(damping);
  if (has_root_damping_) return damping * magnitude;
  return std::copysign(std::pow(magnitude, 1.0 / physics_.damping_exponent), damping);
}

double TwoMass::damping_of(double rate) const {
  return std::copysign(std::pow(std::abs(rate), physics_.damping_exponent), rate);
}

double TwoMass::gravity(double angle) const {
  if (!has_gravity_) return 0.0;
  return physics_.gravity_cosine * std::cos(angle) + physics_.gravity_sine * std::sin(angle);
}

FrictionPoint TwoMass::friction_point(const State& s, double direction) const {
  return {s, direction, s.motor_velocity, torque(s), s.motor_angle, s.motor_angle, s.motor_velocity};
}

TwoMass::Response TwoMass::motor_response(const Stage& stage, const State& start, const State& s, double torque,
                                          double ratio) const {
  const double g = stage.weight;
  const auto direction = static_cast<double>(s.motor_direction);
  const FrictionTorque f = has_plain_friction_
                               ? physics_.friction.evaluate_plain(direction, s.motor_velocity, viscous_)
                               : physics_.friction.evaluate({start, direction, s.motor_velocity, torque, s.motor_angle,
                                                             start.motor_angle, start.motor_velocity},
                                                            viscous_);
  const double residual = physics_.motor_inertia * (s.motor_velocity - stage.motor_velocity) -
                          g * (motor_drive_ - f.torque - torque * ratio);
  const double slope = physics_.motor_inertia + g * (f.by_velocity + g * f.by_angle);
  return {-residual / slope, g * (ratio + f.by_torque) / slope};
}

TwoMass::Response TwoMass::output_response(const Stage& stage, const State& s, double torque) const {
  const double g = stage.weight;
  const double coulomb = s.output_direction * physics_.output_coulomb;
  const double residual = physics_.output_inertia * (s.output_velocity - stage.output_velocity) -
                          g * (torque - physics_.output_viscous * s.output_velocity - coulomb -
                               gravity(s.output_angle) - inputs_.load_torque_nm);
  const double gravity_slope = has_gravity_ ? physics_.gravity_sine * std::cos(s.output_angle) -
                                                  physics_.gravity_cosine * std::sin(s.output_angle)
                                            : 0.0;
  const double slope = physics_.output_inertia + g * (physics_.output_viscous + g * gravity_slope);
  return {-residual / slope, g / slope};
}

TwoMass::TorqueStep TwoMass::torque_step(const TorsionRate& rate, double damping) const {
  const double c = physics_.damping_torque;
  const double ks = rate.spring_slope;
  if (!(c > 0.0)) return {ks * rate.free / (1.0 + rate.gain * ks), 0.0};
  if (has_root_damping_ && rate.gain >= 0.0 && ks >= 0.0) {
    // Of the new power u, whose rate is u|u|, (1 + gain ks) u|u| + gain c u is known: a square root.
    const double by_rate = 1.0 + rate.gain * ks, by_power = rate.gain * c;
    const double known = by_rate * rate.value + rate.free + by_power * damping;
    const double size = std::abs(known);
    const double root = std::sqrt(by_power * by_power + 4.0 * by_rate * size);
    const double power = root > 0.0 ? 2.0 * known / (by_power + root) : 0.0;
    const double step = power - damping;
    return {ks * (rate_of(power) - rate.value) + c * step, step};
  }
  const double inverse_exponent = 1.0 / physics_.damping_exponent;
  const double mismatch = rate.value - rate_of(damping);
  const double magnitude = std::abs(damping);
  const double slope = has_root_damping_
                           ? 2.0 * magnitude
                           : inverse_exponent * std::pow(std::max(magnitude, 1e-12), inverse_exponent - 1.0);
  const double step = (rate.free + mismatch * (1.0 + rate.gain * ks)) / (slope + rate.gain * (ks * slope + c));
  return {ks * (slope * step - mismatch) + c * step, step};
}

// Newton's method on motor velocity, output velocity and signed damping power. Using the power as the unknown keeps the
// equations smooth where |v|^alpha has an infinite slope, and well scaled where the torsion rate is next to nothing. A
// square root is solved exactly in each step: without other nonlinearities the first step is the solution.
bool TwoMass::solve_stage(const Stage& stage, const State& start, State& s) const {
  const double g = stage.weight;
  const bool motor_moves = s.motor_direction != 0;
  const bool output_moves = !locked_ && s.output_direction != 0;
  if (!motor_moves) s.motor_velocity = 0.0;
  if (!output_moves) s.output_velocity = 0.0;
  s.motor_angle = stage.motor_angle + g * s.motor_velocity;
  s.output_angle = stage.output_angle + g * s.output_velocity;
  if (!motor_moves && !output_moves) {
    s.damping = 0.0;
    return true;
  }
  const double c = physics_.damping_torque;
  if (!(c > 0.0)) s.damping = 0.0;
  for (int iteration = 0; iteration < kNewtonLimit; ++iteration) {
    s.motor_angle = stage.motor_angle + g * s.motor_velocity;
    s.output_angle = stage.output_angle + g * s.output_velocity;
    const TorqueSlope spring = elastic(s);
    const double t = spring.torque + c * s.damping;
    const double n = ratio(s.motor_angle);
    // dw = motor.free - motor.gain dT, dwo = output.free + output.gain dT, dT = ks dv + c du.
    const Response motor = motor_moves ? motor_response(stage, start, s, t, n) : Response{};
    const Response output = output_moves ? output_response(stage, s, t) : Response{};
    const TorqueStep step = torque_step({s.motor_velocity * n - s.output_velocity, motor.free * n - output.free,
                                         motor.gain * n + output.gain, spring.slope * g},
                                        s.damping);
    const double motor_step = motor.free - motor.gain * step.torque;
    const double output_step = output.free + output.gain * step.torque;
    s.motor_velocity += motor_step;
    s.output_velocity += output_step;
    s.damping += step.damping;
    if (!std::isfinite(s.motor_velocity + s.output_velocity + s.damping)) return false;
    if (is_linear_ || (std::abs(motor_step) <= 1e-8 * (1.0 + 1e-3 * std::abs(s.motor_velocity)) &&
                       std::abs(output_step) <= 1e-10 && std::abs(step.damping) <= 1e-8)) {
      s.motor_angle = stage.motor_angle + g * s.motor_velocity;
      s.output_angle = stage.output_angle + g * s.output_velocity;
      return true;
    }
  }
  return false;
}

const TwoMass::FastPath& TwoMass::fast_path(double weight) {
  FastPath& k = fast_path_;
  if (k.weight == weight && k.viscous == viscous_ && k.motor_direction == state_.motor_direction) return k;
  const MotorFriction& friction = physics_.friction;
  k.weight = weight;
  k.viscous = viscous_;
  k.motor_direction = state_.motor_direction;
  k.motor_slope =
      physics_.motor_inertia + weight * friction.evaluate_plain(k.motor_direction, 0.0, viscous_).by_velocity;
  k.output_slope = physics_.output_inertia + weight * physics_.output_viscous;
  k.motor_gain = weight * per_gear_ / k.motor_slope;
  k.output_gain = weight / k.output_slope;
  const double rate_gain = k.motor_gain * per_gear_ + k.output_gain;
  k.by_torsion = physics_.transmission.stiffness * weight;
  k.by_rate = 1.0 + rate_gain * k.by_torsion;
  k.by_power = rate_gain * physics_.damping_torque;
  k.discriminant = k.by_power * k.by_power;
  k.four_by_rate = 4.0 * k.by_rate;
  k.has_closed_form = rate_gain >= 0.0 && k.by_torsion >= 0.0;
  return k;
}

// solve_stage() for a linear drive while both of its shafts turn, to the bit: its first step of Newton's method,
// without the terms that are zero. Quotients that both stages share are not computed again.
[[gnu::always_inline]] inline Shafts TwoMass::solve_fast_path(const FastPath& k, const Stage& stage,
                                                              const Shafts& start) const {
  Shafts s = start;
  const double g = k.weight, c = physics_.damping_torque;
  const auto direction = static_cast<double>(k.motor_direction);
  const double coulomb = s.output_direction * physics_.output_coulomb;
  const double twist =
      (stage.motor_angle + g * s.motor_velocity) / physics_.gear_ratio - (stage.output_angle + g * s.output_velocity);
  const double t = twist * physics_.transmission.stiffness + c * s.damping;
  const double friction = physics_.friction.evaluate_plain(direction, s.motor_velocity, viscous_).torque;
  const double motor_residual = physics_.motor_inertia * (s.motor_velocity - stage.motor_velocity) -
                                g * (motor_drive_ - friction - t * per_gear_);
  const double output_residual =
      physics_.output_inertia * (s.output_velocity - stage.output_velocity) -
      g * (t - physics_.output_viscous * s.output_velocity - coulomb - inputs_.load_torque_nm);
  const double motor_free = -motor_residual / k.motor_slope;
  const double output_free = -output_residual / k.output_slope;
  const double rate = s.motor_velocity * per_gear_ - s.output_velocity;
  const double known = k.by_rate * rate + (motor_free * per_gear_ - output_free) + k.by_power * s.damping;
  const double root = std::sqrt(k.discriminant + k.four_by_rate * std::abs(known));
  const double power = root > 0.0 ? 2.0 * known / (k.by_power + root) : 0.0;
  const double damping_step = power - s.damping;
  const double torque_step = k.by_torsion * (power * std::abs(power) - rate) + c * damping_step;
  s.motor_velocity += motor_free - k.motor_gain * torque_step;
  s.output_velocity += output_free + k.output_gain * torque_step;
  s.damping += damping_step;
  s.motor_angle = stage.motor_angle + g * s.motor_velocity;
  s.output_angle = stage.output_angle + g * s.output_velocity;
  return s;
}

// A step in which both shafts keep their direction. Returns false, and does nothing, otherwise.
bool TwoMass::take_fast_step(double h) {
  if (state_.motor_velocity == 0.0 || state_.output_velocity == 0.0 || state_.motor_direction == 0 ||
      state_.output_direction == 0)
    return false;
  const Shafts from = state_;
  const FastPath& known = fast_path(kGamma * h);
  if (!known.has_closed_form) return false;
  const Shafts middle = solve_fast_path(
      known, {from.motor_angle, from.motor_velocity, from.output_angle, from.output_velocity, known.weight}, from);
  const Shafts to = solve_fast_path(known, second_stage(from, middle, known.weight), middle);
  const bool goes_on = to.motor_direction * to.motor_velocity >= 0.0 && to.output_direction * to.output_velocity >= 0.0;
  if (!goes_on || !std::isfinite(to.motor_velocity + to.output_velocity + to.damping)) return false;
  static_cast<Shafts&>(state_) = to;
  return true;
}

TwoMass::Stage TwoMass::second_stage(const Shafts& before, const Shafts& after, double weight) {
  const auto carry = [](double from, double to) { return from + kCarry * (to - from); };
  return {carry(before.motor_angle, after.motor_angle), carry(before.motor_velocity, after.motor_velocity),
          carry(before.output_angle, after.output_angle), carry(before.output_velocity, after.output_velocity), weight};
}

bool TwoMass::try_step(const State& from, double h, State& to) const {
  const double g = kGamma * h;
  copy(from, to);
  const Stage first{from.motor_angle, from.motor_velocity, from.output_angle, from.output_velocity, g};
  if (!solve_stage(first, from, to)) return false;
  if (!solve_stage(second_stage(from, to, g), from, to)) return false;
  if (to.motor_direction != 0 && !has_plain_friction_) {
    FrictionPoint at = friction_point(to, to.motor_direction);
    at.anchor = from.motor_angle;
    at.anchor_velocity = from.motor_velocity;
    static_cast<FrictionMemory&>(at) = from;
    static_cast<FrictionMemory&>(to) = physics_.friction.remember(at);
  }
  if (has_loops_) {
    to.loops = physics_.transmission.loops.ahead(from.loops, torsion(to), true);
    to.loops.total_torque = torque(to);
  }
  return true;
}

// The margin of a state to the event: negative after it.
double TwoMass::margin(Event event, const State& s) const {
  switch (event) {
    case Event::motor_stop:
      return s.motor_direction == 0 ? 1.0 : s.motor_direction * s.motor_velocity;
    case Event::output_stop:
      return s.output_direction == 0 ? 1.0 : s.output_direction * s.output_velocity;
    case Event::motor_break: {
      if (s.motor_direction != 0) return 1.0;
      const double need = motor_drive_ - torque(s) * ratio(s.motor_angle);
      return std::min(physics_.friction.evaluate(friction_point(s, 1.0), viscous_).torque - need,
                      need - physics_.friction.evaluate(friction_point(s, -1.0), viscous_).torque);
    }
    case Event::output_break: {
      if (locked_ || s.output_direction != 0) return 1.0;
      return physics_.output_coulomb - std::abs(torque(s) - gravity(s.output_angle) - inputs_.load_torque_nm);
    }
    case Event::none:
      break;
  }
  return 1.0;
}

int TwoMass::choose_motor_direction(const State& s) const {
  const double need = motor_drive_ - torque(s) * ratio(s.motor_angle);
  const double forward = physics_.friction.evaluate(friction_point(s, 1.0), viscous_).torque;
  const double backward = physics_.friction.evaluate(friction_point(s, -1.0), viscous_).torque;
  if (forward > backward) return need > forward ? 1 : (need < backward ? -1 : 0);
  // No static friction (the bristle models it): the shaft never sticks, it only reverses.
  return need >= 0.5 * (forward + backward) ? 1 : -1;
}

int TwoMass::choose_output_direction(const State& s) const {
  if (locked_) return 0;
  const double need = torque(s) - gravity(s.output_angle) - inputs_.load_torque_nm;
  if (physics_.output_coulomb > 0.0)
    return need > physics_.output_coulomb ? 1 : (need < -physics_.output_coulomb ? -1 : 0);
  return need >= 0.0 ? 1 : -1;
}

// A shaft at rest takes the branch of its torques.
void TwoMass::choose_resting_branches(State& s) const {
  if (s.motor_velocity == 0.0) s.motor_direction = choose_motor_direction(s);
  if (s.output_velocity == 0.0) s.output_direction = choose_output_direction(s);
}

// A shaft released at the start of a step may end up moving against its branch, where a stiff torque decays within the
// step. Then it sticks for this step if friction can hold it at the end, otherwise it moves in the other direction.
void TwoMass::resolve_resting(State& s, double h) const {
  if (s.motor_velocity != 0.0 && s.output_velocity != 0.0) return;
  State end;
  const auto retry = [&](int State::*direction, double State::*velocity, Event stop, Event breaks) {
    if (s.*velocity != 0.0 || s.*direction == 0) return;
    if (!try_step(s, h, end) || margin(stop, end) >= 0.0) return;
    const int before = s.*direction;
    s.*direction = 0;
    if (try_step(s, h, end) && margin(breaks, end) < 0.0) s.*direction = -before;
  };
  retry(&State::motor_direction, &State::motor_velocity, Event::motor_stop, Event::motor_break);
  retry(&State::output_direction, &State::output_velocity, Event::output_stop, Event::output_break);
}

// Time at which the margin of an event passes zero between 0 and h: regula falsi with the Illinois modification.
double TwoMass::locate(Event event, const State& from, double h, const State& at_h) const {
  double low = 0.0, high = h;
  double low_margin = std::max(margin(event, from), 0.0);
  double high_margin = margin(event, at_h);
  const bool stop = event == Event::motor_stop || event == Event::output_stop;
  const double tolerance =
      !stop ? kBreakTolerance : (event == Event::motor_stop ? kMotorStopTolerance : kOutputStopTolerance);
  int side = 0;
  State trial;
  double missed = high_margin;
  for (int i = 0; i < kLocateLimit && missed < -tolerance && high - low > 1e-15; ++i) {
    double middle = low + (high - low) * low_margin / (low_margin - high_margin);
    if (i > 20 || !(middle > low && middle < high)) middle = 0.5 * (low + high);
    if (!try_step(from, middle, trial)) middle = 0.5 * (low + high);
    const double value = margin(event, trial);
    if (value < 0.0) {
      high = middle;
      high_margin = missed = value;
      if (side == -1) low_margin *= 0.5;
      side = -1;
    } else {
      low = middle;
      low_margin = value;
      if (side == 1) high_margin *= 0.5;
      side = 1;
      // A shaft that has almost stopped may be stopped here; to end sticking, the torque must be past its limit.
      if (stop && value <= tolerance) return low;
    }
  }
  return high;
}

TwoMass::Event TwoMass::first_event(const State& from, double h, State& to, double& taken) const {
  constexpr Event kEvents[] = {Event::motor_stop, Event::output_stop, Event::motor_break, Event::output_break};
  taken = h;
  // Most steps: both shafts keep their direction.
  if (to.motor_direction != 0 && to.motor_direction * to.motor_velocity >= 0.0 &&
      (locked_ || (to.output_direction != 0 && to.output_direction * to.output_velocity >= 0.0)))
    return Event::none;
  Event first = Event::none;
  for (const Event event : kEvents) {
    if (event == first || margin(event, to) >= 0.0) continue;
    const double at = locate(event, from, taken, to);
    if (!try_step(from, at, to)) throw std::runtime_error("plant: a step to an event did not converge");
    taken = at;
    first = event;
  }
  return first;
}

void TwoMass::take_step(double h) {
  if (has_fast_path_ && take_fast_step(h)) return;
  double remaining = h;
  double piece = h;
  for (int events = 0; remaining > 1e-13; ++events) {
    choose_resting_branches(state_);
    piece = std::min(piece, remaining);
    resolve_resting(state_, piece);
    State& to = next_;
    if (!try_step(state_, piece, to)) {
      piece *= 0.25;
      if (piece < 1e-12 * h) {
        throw std::runtime_error("plant: the implicit step does not converge; check the effects' parameters");
      }
      continue;
    }
    if (events > kEventLimit) {
      // Events accumulate: stop the shafts that reversed and continue at the end of the segment.
      if (margin(Event::motor_stop, to) < 0.0) to.motor_velocity = 0.0;
      if (margin(Event::output_stop, to) < 0.0) to.output_velocity = 0.0;
      copy(to, state_);
      remaining -= piece;
      piece = remaining;
      continue;
    }
    double taken = piece;
    const Event event = first_event(state_, piece, to, taken);
    copy(to, state_);
    if (event == Event::motor_stop || event == Event::output_stop) {
      (event == Event::motor_stop ? state_.motor_velocity : state_.output_velocity) = 0.0;
      state_.damping = damping_of(state_.motor_velocity * ratio(state_.motor_angle) - state_.output_velocity);
    } else if (event == Event::motor_break || event == Event::output_break) {
      choose_resting_branches(state_);
    }
    remaining -= taken;
    piece = remaining;
  }
}

void TwoMass::advance(const Inputs& inputs, double duration_s, int steps) {
  inputs_ = inputs;
  motor_drive_ = drive_torque(inputs);
  viscous_ = physics_.friction.viscous * physics_.friction.viscous_factor(inputs.temperature_c);
  physics_.friction.dry_share = physics_.friction.coulomb_factor(inputs.temperature_c);
  const double h = duration_s / steps;
  for (int i = 0; i < steps; ++i) take_step(h);
}

double TwoMass::motor_acceleration(const Inputs& inputs) const {
  const double drive = drive_torque(inputs) - torque() * ratio(state_.motor_angle);
  const double viscous = physics_.friction.viscous * physics_.friction.viscous_factor(inputs.temperature_c);
  int direction = state_.motor_direction;
  if (direction == 0) {
    const double forward = physics_.friction.evaluate(friction_point(state_, 1.0), viscous).torque;
    const double backward = physics_.friction.evaluate(friction_point(state_, -1.0), viscous).torque;
    direction = drive > forward ? 1 : (drive < backward ? -1 : 0);
    if (direction == 0) return 0.0;
  }
  return (drive - physics_.friction.evaluate(friction_point(state_, direction), viscous).torque) /
         physics_.motor_inertia;
}

double TwoMass::energy() const {
  return 0.5 * physics_.motor_inertia * state_.motor_velocity * state_.motor_velocity +
         0.5 * physics_.output_inertia * state_.output_velocity * state_.output_velocity +
         physics_.transmission.energy(torsion(state_)) + physics_.gravity_cosine * std::sin(state_.output_angle) -
         physics_.gravity_sine * std::cos(state_.output_angle);
}

}  // namespace flexspline::plant
