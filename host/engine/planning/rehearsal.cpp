#include "host/engine/planning/rehearsal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/simulation/dynamics.hpp"

namespace flexspline::planning {
namespace {

using data::Column;
using simulation::Coupling;
using simulation::Forcing;

constexpr double kStep_s = 1.0 / 4000.0;
// Of the velocity loop, in turns of phase a sample: a tenth of what a sampled loop could have at most.
constexpr double kBandwidth = 0.02;

double steps_of(double position, double counts) {
  const double step = 2.0 * std::numbers::pi / counts;
  return std::floor(position / step + 0.5) * step;
}

// What a current sensor reads without current: the effort that keeps the axis at rest where nothing moves or pushes.
double reading_at_rest(const simulation::Balances& balances, double temperature, double torque_constant) {
  simulation::Inputs rest{};
  rest.viscous_scale = rest.coulomb_scale = 1.0;
  rest.temperature = temperature;
  simulation::Torques sums{};
  balances.add_motor(rest, rest, sums);
  return sums.motor / torque_constant;
}

// Velocity by a loop on an inertia: proportional for its bandwidth, integral a quarter of that lower.
class VelocityLoop {
 public:
  VelocityLoop(double inertia, double torque_constant, double sample_s, double limit)
      : sample_s_(sample_s), limit_(limit) {
    const double bandwidth = 2.0 * std::numbers::pi * kBandwidth / sample_s;
    proportional_ = bandwidth * inertia / torque_constant;
    integral_ = 0.25 * bandwidth * proportional_;
  }

  double current(double wanted, double velocity) {
    const double error = wanted - velocity;
    const double next = integrated_ + integral_ * error * sample_s_;
    const double unlimited = proportional_ * error + next;
    const double current = std::clamp(unlimited, -limit_, limit_);
    if (current == unlimited || (unlimited > current) != (error > 0.0)) integrated_ = next;
    clipped_ += current != unlimited;
    return current;
  }
  std::size_t clipped() const { return clipped_; }

 private:
  double sample_s_, limit_;
  double proportional_ = 0.0, integral_ = 0.0, integrated_ = 0.0;
  std::size_t clipped_ = 0;
};

data::Experiment empty_experiment(const Run& run, double sample_s, const Sensors& sensors) {
  data::Experiment e;
  e.name = run.name;
  e.load = run.locked ? data::Load::locked : data::Load::free;
  e.current_hold_stated = true;
  e.sample_s = sample_s;
  e.motor_position_zero = e.output_position_zero = data::PositionZero::absolute;
  if (sensors.motor_counts > 0.0) e.encoder_counts = sensors.motor_counts;
  if (sensors.output_counts > 0.0) e.output_encoder_counts = sensors.output_counts;
  return e;
}

// What the sensors show of one sample.
void measure(data::Experiment& e, const Run& run, const Sensors& sensors, const Forcing& forcing, double motor_position,
             double output_position, double torque) {
  e[sensors.current ? Column::current : Column::motor_torque].push_back(forcing.current);
  e[Column::motor_position].push_back(sensors.motor_counts > 0.0 ? steps_of(motor_position, sensors.motor_counts)
                                                                 : motor_position);
  if (sensors.output_position)
    e[Column::output_position].push_back(sensors.output_counts > 0.0 ? steps_of(output_position, sensors.output_counts)
                                                                     : output_position);
  if (sensors.torque) e[Column::torque].push_back(torque);
  if (sensors.temperature) e[Column::temperature].push_back(forcing.temperature);
  if (run.load_torque_nm != 0.0) e[Column::load_torque].push_back(run.load_torque_nm);
}

}  // namespace

Rehearsal rehearse(const model::Model& model, const Run& run, double sample_s, const Limits& limits,
                   const Sensors& sensors) {
  catalogue::DriveConstants<double> constants = catalogue::constants_of(model.drive);
  if (!sensors.current) constants.torque_constant = 1.0;
  const simulation::Balances balances(model, constants);
  const double inertia = balances.motor_inertia() +
                         (run.locked ? 0.0 : balances.output_inertia() / (constants.gear_ratio * constants.gear_ratio));
  const bool two_masses = balances.has_transmission() && balances.output_inertia() > 0.0;
  const Coupling coupling = run.locked ? Coupling::locked_output : two_masses ? Coupling::two_masses : Coupling::rigid;
  Rehearsal result;
  data::Experiment& e = result.experiment;
  e = empty_experiment(run, sample_s, sensors);

  simulation::Dynamics dynamics(simulation::Balances(model, constants), constants, coupling);
  VelocityLoop loop(inertia, constants.torque_constant, sample_s, limits.current_a);
  Forcing forcing;
  forcing.temperature = run.temperature_c.value_or(constants.reference_temperature);
  forcing.load_torque = run.load_torque_nm;
  const double offset = reading_at_rest(balances, forcing.temperature, constants.torque_constant);
  const std::vector<double> wanted = set_points(run, sample_s);
  const int steps = std::max(1, static_cast<int>(std::ceil(sample_s / kStep_s - 1e-6)));
  double low = 0.0, high = 0.0;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const simulation::State& s = dynamics.state();
    // A drive that is off reads its offset; one that is on controls its biased reading.
    forcing.current = run.mode == Mode::current    ? std::clamp(wanted[k], -limits.current_a, limits.current_a)
                      : run.mode == Mode::velocity ? loop.current(wanted[k], s.motor_velocity)
                      : run.mode == Mode::off      ? offset
                                                   : 0.0;
    forcing.effort = forcing.current * constants.torque_constant;
    if (k == 0) dynamics.start({}, forcing, true, std::numeric_limits<double>::infinity(), 0.0);
    e.time_s.push_back(static_cast<double>(k) * sample_s);
    const double output = two_masses || run.locked ? s.output_position : s.motor_position / constants.gear_ratio;
    measure(e, run, sensors, forcing, s.motor_position, output, sensors.torque ? dynamics.torque() : 0.0);
    result.peak_current_a = std::max(result.peak_current_a, std::abs(forcing.current));
    result.peak_velocity_rad_s = std::max(result.peak_velocity_rad_s, std::abs(s.motor_velocity));
    low = std::min(low, output);
    high = std::max(high, output);
    for (int n = 0; n < steps; ++n) dynamics.step(forcing, forcing, sample_s / steps);
    if (!std::isfinite(dynamics.state().motor_velocity) || std::abs(dynamics.state().motor_velocity) > 1e9) {
      result.diverged = true;
      break;
    }
  }
  result.travel_rad = high - low;
  result.clipped_share =
      wanted.empty() ? 0.0 : static_cast<double>(loop.clipped()) / static_cast<double>(wanted.size());
  e.segments = {{0, e.time_s.size()}};
  e.masked.assign(e.time_s.size(), 0);
  return result;
}

}  // namespace flexspline::planning
