#include "hil/thesis_models/drive_system.hpp"

#include <algorithm>
#include <array>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <cstdint>
#include <utility>

#include "hil/thesis_models/runge_kutta.hpp"

namespace flexspline::report {
namespace {

// The root of an increasing function, from a first guess of its distance from zero.
template <class F>
double increasing_root(F&& f, double guess) {
  const double at_zero = f(0.0);
  if (at_zero == 0.0) return 0.0;
  const double direction = at_zero < 0.0 ? 1.0 : -1.0;
  double near = 0.0;
  double at_near = at_zero;
  double far = direction * std::max(std::abs(guess), 1e-9);
  double at_far = f(far);
  while (at_far * direction < 0.0) {
    near = std::exchange(far, 4.0 * far);
    at_near = std::exchange(at_far, f(far));
  }
  if (at_far == 0.0) return far;
  if (far < near) {
    std::swap(near, far);
    std::swap(at_near, at_far);
  }
  std::uintmax_t evaluations = 200;
  const auto bracket = boost::math::tools::toms748_solve(f, near, far, at_near, at_far,
                                                         boost::math::tools::eps_tolerance<double>(50), evaluations);
  return 0.5 * (bracket.first + bracket.second);
}

}  // namespace

DriveSystem::DriveSystem(DriveSystemParts parts, Load load, FrictionMethod method, double step_s)
    : parts_(std::move(parts)), implicit_(method == FrictionMethod::implicit), step_s_(step_s) {
  const LossyDrive& drive = parts_.drive;
  const Shaft input{parts_.motor.inertia, {parts_.motor.friction, drive.wave_generator, drive.teeth}};
  input_ = make_friction_block(method, input, step_s);
  if (load == Load::free)
    output_ = make_friction_block(method, {parts_.output_inertia, {drive.output_bearing}}, step_s);
}

double DriveSystem::torque(const SystemState& state) const {
  const LossyDrive& drive = parts_.drive;
  return drive.torsion_torque(drive.torsion(state.input_angle, state.output_angle),
                              drive.torsion_rate(state.input_velocity, state.output_velocity));
}

SystemState DriveSystem::runge_kutta(const SystemState& from, double time_s,
                                     const std::function<double(double)>& current_a) const {
  const auto rate = [&](double t, const std::array<double, 4>& y) {
    const SystemState state{y[0], y[1], y[2], y[3]};
    const double transmitted = torque(state);
    const double given = parts_.drive.gear.input_torque(transmitted);
    const double driving = parts_.motor.driving_torque(current_a(t), given);
    const double input_rate =
        parts_.motor.acceleration(current_a(t), given, input_->torque(state.input_velocity, driving));
    double output_rate = 0.0;
    if (output_)
      output_rate = (transmitted - output_->torque(state.output_velocity, transmitted)) / parts_.output_inertia;
    return std::array<double, 4>{state.input_velocity, input_rate, state.output_velocity, output_rate};
  };
  const auto y =
      rk4_step(rate, time_s, std::array{from.input_angle, from.input_velocity, from.output_angle, from.output_velocity},
               step_s_);
  return {y[0], y[1], y[2], y[3]};
}

// The torsion rate v at the end of the step determines the torque, the torque determines both velocities, and v must
// agree with them. The unknown is the damping torque per T_st, in which the slope stays finite for exponents below one.
SystemState DriveSystem::backward_euler(const SystemState& from, double current_a) const {
  const LossyDrive& drive = parts_.drive;
  const double twisted = drive.torsion(from.input_angle, from.output_angle);
  const double power = 1.0 / drive.damping_exponent;
  SystemState to = from;
  const auto mismatch = [&](double damping) {
    const double rate = std::copysign(std::pow(std::abs(damping), power), damping);
    const double transmitted = drive.spring.torque(twisted + step_s_ * rate) + drive.damping_torque * damping;
    const double driving = parts_.motor.driving_torque(current_a, drive.gear.input_torque(transmitted));
    to.input_velocity = input_->next_velocity(from.input_velocity, driving);
    if (output_) to.output_velocity = output_->next_velocity(from.output_velocity, transmitted);
    return rate - drive.torsion_rate(to.input_velocity, to.output_velocity);
  };
  const double rate = drive.torsion_rate(from.input_velocity, from.output_velocity);
  mismatch(increasing_root(mismatch, std::pow(std::abs(rate), drive.damping_exponent)));
  to.input_angle += step_s_ * to.input_velocity;
  to.output_angle += step_s_ * to.output_velocity;
  return to;
}

SystemState DriveSystem::step(const SystemState& from, double time_s,
                              const std::function<double(double)>& current_a) const {
  return implicit_ ? backward_euler(from, current_a(time_s + step_s_)) : runge_kutta(from, time_s, current_a);
}

SystemTrace DriveSystem::run(SystemState from, const std::function<double(double)>& current_a, std::size_t samples,
                             int steps_per_sample) const {
  SystemTrace trace;
  for (std::size_t k = 0; k < samples; ++k) {
    const auto first = static_cast<double>(k) * steps_per_sample;
    const double transmitted = torque(from);
    const double driving =
        parts_.motor.driving_torque(current_a(first * step_s_), parts_.drive.gear.input_torque(transmitted));
    trace.state.push_back(from);
    trace.torque_nm.push_back(transmitted);
    trace.input_friction_nm.push_back(input_->torque(from.input_velocity, driving));
    for (int n = 0; n < steps_per_sample; ++n) from = step(from, (first + n) * step_s_, current_a);
  }
  return trace;
}

}  // namespace flexspline::report
