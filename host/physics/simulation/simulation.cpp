#include "host/physics/simulation/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "host/physics/simulation/dynamics.hpp"
#include "host/physics/simulation/initial_motion.hpp"

namespace flexspline::simulation {
namespace {

using data::Column;

// No drive in whatever unit is this fast; a model with negative friction may be.
constexpr double kDiverged = 1e12;
// As in the check of the time's unit.
constexpr double kLongestSample_s = 0.5;

// What the model is driven by, at any time of a segment; time counts in samples.
class RecordInputs {
 public:
  RecordInputs(const data::Experiment& experiment, const data::Segment& segment, Column effort,
               double torque_per_effort, double temperature, double shift)
      : experiment_(experiment),
        segment_(segment),
        effort_(experiment[effort]),
        torque_per_effort_(torque_per_effort),
        temperature_(temperature),
        shift_(shift) {}

  // Over an integration step: held efforts have the step's mean at both ends, so that their impulse is exact wherever
  // the drive changes them.
  void over(double from, double to, Forcing& begin, Forcing& end) const {
    double first = 0.0;
    double last = 0.0;
    if (experiment_.current_hold == data::CurrentHold::zoh) {
      first = last = held_mean(from - shift_, to - shift_);
    } else {
      first = at(effort_, from - shift_);
      last = at(effort_, to - shift_);
    }
    begin = forcing(first, from);
    end = forcing(last, to);
  }

 private:
  std::size_t clamped(double sample) const {
    const auto last = static_cast<double>(segment_.last - 1);
    return static_cast<std::size_t>(std::clamp(sample, static_cast<double>(segment_.first), last));
  }
  double held_mean(double from, double to) const {
    const double boundary = std::floor(from) + 1.0;
    const double before = effort_[clamped(std::floor(from))];
    if (to <= boundary) return before;
    const double after = effort_[clamped(boundary)];
    return (before * (boundary - from) + after * (to - boundary)) / (to - from);
  }
  double at(const std::vector<double>& column, double time) const {
    const double below = std::floor(time);
    const double a = column[clamped(below)];
    return a + (column[clamped(below + 1.0)] - a) * (time - below);
  }
  Forcing forcing(double effort, double time) const {
    Forcing now;
    now.current = effort;
    now.effort = effort * torque_per_effort_;
    now.temperature = experiment_.has(Column::temperature) ? at(experiment_[Column::temperature], time) : temperature_;
    now.load_torque = experiment_.has(Column::load_torque) ? at(experiment_[Column::load_torque], time) : 0.0;
    return now;
  }

  const data::Experiment& experiment_;
  data::Segment segment_;
  const std::vector<double>& effort_;
  double torque_per_effort_;
  double temperature_;
  double shift_;
};

// Names of parameters that have no value: "viscous_friction.coefficient".
std::vector<std::string> missing_values(const model::Model& model) {
  std::vector<std::string> missing;
  for (const model::Effect& effect : model.effects) {
    for (const std::string& name : catalogue::missing_values(effect)) missing.push_back(effect.id + "." + name);
  }
  return missing;
}

void require_complete(const model::Model& model, bool by_current) {
  std::vector<std::string> missing = missing_values(model);
  if (by_current && !model.drive.torque_constant_nm_a.value) missing.emplace_back("drive.torque_constant_nm_a");
  const auto beyond_motor = [](const model::Effect& effect) {
    return catalogue::entry_of(effect).info->balance != catalogue::Balance::motor;
  };
  if (!model.drive.gear_ratio.value && std::any_of(model.effects.begin(), model.effects.end(), beyond_motor))
    missing.emplace_back("drive.gear_ratio");
  if (missing.empty()) return;
  std::string names;
  for (const std::string& name : missing) names += (names.empty() ? "" : ", ") + name;
  throw ModelIncomplete("model \"" + model.name + "\" cannot be simulated: no value for " + names +
                        ". Run `flexspline identify` first, or write the values into the model file.");
}

Column effort_column(const model::Model& model, const data::Experiment& experiment) {
  const bool current = experiment.has(Column::current);
  const bool torque = experiment.has(Column::motor_torque);
  if (!current && !torque)
    throw std::invalid_argument(
        "experiment \"" + experiment.name +
        "\" cannot be simulated: it has neither current_a nor motor_torque_nm. Map one of them in "
        "its dataset.toml.");
  return current && (model.drive.torque_constant_nm_a.value || !torque) ? Column::current : Column::motor_torque;
}

// The largest torque that positions may imply: a gear carries no more than a few times its rating.
double plausible_torque(const model::Model& model, const data::Experiment& experiment) {
  constexpr double kMargin = 4.0;
  double largest = model.drive.rated_torque_nm.value.value_or(0.0);
  if (experiment.has(Column::torque))
    for (const double torque : experiment[Column::torque]) largest = std::max(largest, std::abs(torque));
  return largest > 0.0 ? kMargin * largest : std::numeric_limits<double>::infinity();
}

void start(Dynamics& dynamics, const model::Model& model, const data::Experiment& experiment,
           const data::Segment& segment, const Forcing& forcing, Coupling coupling, const Options& options,
           double gear_ratio) {
  const auto motor = initial_motion(experiment, segment, Column::motor_position, Column::motor_velocity);
  const auto output = initial_motion(experiment, segment, Column::output_position, Column::output_velocity);
  State state;
  if (motor) {
    state.motor_position = motor->position;
    state.motor_velocity = motor->velocity;
  } else if (output) {
    state.motor_position = gear_ratio * output->position;
    state.motor_velocity = gear_ratio * output->velocity;
  }
  if (options.initial_motor_velocity) state.motor_velocity = *options.initial_motor_velocity;
  const bool output_position = experiment.has(Column::output_position);
  const bool motor_position = experiment.has(Column::motor_position);
  if (coupling != Coupling::locked_output) {
    state.output_position = output_position ? output->position : state.motor_position / gear_ratio;
    state.output_velocity = state.motor_velocity / gear_ratio;
    if (coupling == Coupling::two_masses) {
      if (output) state.output_velocity = output->velocity;
      if (options.initial_output_velocity) state.output_velocity = *options.initial_output_velocity;
    }
  }
  double resting_torque = 0.0;
  if (coupling == Coupling::two_masses) resting_torque = dynamics.steady_load_torque(state, forcing);
  if (experiment.has(Column::torque)) resting_torque = experiment[Column::torque][segment.first];
  const bool torsion_known = motor_position && (coupling == Coupling::locked_output || output_position);
  dynamics.start(state, forcing, torsion_known, plausible_torque(model, experiment), resting_torque);
}

void require_sample_time(const data::Experiment& experiment) {
  if (!(experiment.sample_s > 0.0))
    throw std::invalid_argument("experiment \"" + experiment.name +
                                "\" cannot be simulated: it has no time between samples (sample_s)");
  // At its own step the simulation would run for hours, and no drive is controlled at this rate.
  if (experiment.sample_s >= kLongestSample_s)
    throw std::invalid_argument(fmt::format(
        "experiment \"{}\" cannot be simulated: a sample lasts {:.4g} s, the longest is {:g} s. Is time_s in another "
        "unit? Then write it as unit under [columns.time_s] in dataset.toml.",
        experiment.name, experiment.sample_s, kLongestSample_s));
}

// From a segment's first sample to its last, or to where the model diverges.
void run_segment(Dynamics& dynamics, const RecordInputs& inputs, const data::Segment& segment, double sample_s,
                 int steps, FreeRun& result) {
  const double duration = sample_s / steps;
  Forcing begin, end;
  double arriving = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = segment.first; k < segment.last; ++k) {
    const State& state = dynamics.state();
    const double fastest = std::max(std::abs(state.motor_velocity), std::abs(state.output_velocity));
    if (!(fastest < kDiverged)) break;
    result.motor_position[k] = state.motor_position;
    result.motor_velocity[k] = state.motor_velocity;
    result.output_position[k] = state.output_position;
    result.output_velocity[k] = state.output_velocity;
    result.torque[k] = dynamics.torque();
    result.motor_acceleration[k] = arriving;
    if (k + 1 == segment.last) break;
    for (int n = 0; n < steps; ++n) {
      const auto time = [&](int at) { return static_cast<double>(k) + static_cast<double>(at) / steps; };
      inputs.over(time(n), time(n + 1), begin, end);
      const Dynamics::Accelerations accelerations = dynamics.step(begin, end, duration);
      if (n == 0)
        result.motor_acceleration[k] =
            k == segment.first ? accelerations.first : 0.5 * (arriving + accelerations.first);
      arriving = accelerations.last;
    }
  }
  if (segment.last - segment.first == 1) result.motor_acceleration[segment.first] = 0.0;
}

}  // namespace

FreeRun run(const model::Model& model, const data::Experiment& experiment, const Options& options) {
  if (!(options.step_s > 0.0)) throw std::invalid_argument("the step of a simulation must be positive (seconds)");
  const Column effort = effort_column(model, experiment);
  require_complete(model, effort == Column::current);
  require_sample_time(experiment);
  catalogue::DriveConstants<double> constants = catalogue::constants_of(model.drive);
  if (effort == Column::motor_torque) constants.torque_constant = 1.0;
  const Balances balances(model, constants);
  if (!(balances.motor_inertia() > 0.0))
    throw ModelIncomplete(
        "model \"" + model.name +
        "\" cannot be simulated: it has no inertia on the motor balance. Add the effect `inertia` with a "
        "positive value.");
  const bool locked = experiment.load == data::Load::locked;
  if (locked && !balances.has_transmission()) return {};
  const bool two_masses = balances.has_transmission() && balances.output_inertia() > 0.0;
  const Coupling coupling = locked ? Coupling::locked_output : two_masses ? Coupling::two_masses : Coupling::rigid;

  FreeRun result;
  result.effort = effort;
  const auto signals = {&result.motor_position,  &result.motor_velocity,  &result.motor_acceleration,
                        &result.output_position, &result.output_velocity, &result.torque};
  for (auto* signal : signals) signal->assign(experiment.size(), std::numeric_limits<double>::quiet_NaN());

  std::vector<data::Segment> segments = experiment.segments;
  if (segments.empty()) segments.push_back({0, experiment.size()});
  const int steps = std::max(1, static_cast<int>(std::ceil(experiment.sample_s / options.step_s - 1e-6)));
  for (const data::Segment& segment : segments) {
    if (segment.last <= segment.first) continue;
    Dynamics dynamics(Balances(model, constants), constants, coupling);
    const RecordInputs inputs(experiment, segment, effort, constants.torque_constant, constants.reference_temperature,
                              options.effort_shift_samples);
    Forcing begin, end;
    const auto first_time = static_cast<double>(segment.first);
    inputs.over(first_time, first_time + 1.0 / steps, begin, end);
    start(dynamics, model, experiment, segment, begin, coupling, options, constants.gear_ratio);
    run_segment(dynamics, inputs, segment, experiment.sample_s, steps, result);
  }
  return result;
}

}  // namespace flexspline::simulation
