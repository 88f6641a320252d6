#include "host/engine/planning/rehearsed_motions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/selection/add.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::planning {
namespace {

using data::Column;
using estimation::Balance;

// Noise where there are no data: as a share of the rated current, and of the rated torque.
constexpr double kCurrentNoise = 0.005;
constexpr double kTorqueNoise = 0.01;

constexpr double kShrinking = 0.75;
constexpr int kShrinkings = 8;

// The limit that a rehearsed run exceeds; empty where it stays within all.
std::string broken_limit(const Rehearsal& made, const Limits& limits) {
  if (made.diverged) return "bounds of the simulation";
  if (made.peak_velocity_rad_s > 1.02 * limits.velocity_rad_s) return "velocity limit";
  if (made.travel_rad > 1.02 * limits.travel_rad) return "travel limit";
  if (made.clipped_share > 0.01) return "current limit";
  return {};
}

double largest(const data::Dataset* dataset, Column column) {
  double most = 0.0;
  if (dataset)
    for (const data::Experiment& e : dataset->experiments)
      for (const double x : e[column])
        if (std::isfinite(x)) most = std::max(most, std::abs(x));
  return most;
}

double stated_noise(const model::Drive& drive, const estimation::PreparedData& prepared, Balance balance,
                    double sample_s) {
  const auto& c = prepared.constants;
  const double current = drive.rated_current_a.value.value_or(1.0) * c.torque_constant * kCurrentNoise;
  const double torque = drive.rated_torque_nm.value.value_or(0.0) * kTorqueNoise;
  double square = torque * torque;
  if (balance == Balance::motor)
    square =
        current * current + (prepared.output_signals.torque ? torque * torque / (c.gear_ratio * c.gear_ratio) : 0.0);
  if (!(square > 0.0)) square = current * current * c.gear_ratio * c.gear_ratio;
  return square * 2.0 * prepared.pipeline.row_cutoff_hz * sample_s;
}

// The size of a balance's signals in a record; the noise of sensors often grows with the signal.
double noise_level(const estimation::PreparedData& prepared, const estimation::Record& record, Balance balance) {
  double sum = 0.0;
  const double gear = balance == Balance::motor ? prepared.constants.gear_ratio : 1.0;
  for (std::size_t k = 0; k < record.inputs.size(); ++k) {
    const double torque = record.torque.empty() ? 0.0 : record.torque[k] / gear;
    const double effort = balance == Balance::motor && !record.effort.empty() ? record.effort[k] : 0.0;
    sum += torque * torque + effort * effort;
  }
  return std::sqrt(sum / std::max(1.0, static_cast<double>(record.inputs.size())));
}

double noise_level(const RegressionProblem& data) {
  double sum = 0.0, rows = 0.0;
  for (const estimation::RowRange& range : data.records()) {
    const double one = noise_level(data.prepared(), data.prepared().records[range.record], data.balance());
    sum += one * one * static_cast<double>(range.size());
    rows += static_cast<double>(range.size());
  }
  return std::sqrt(sum / std::max(1.0, rows));
}

bool reads_temperature(const catalogue::Entry& entry) {
  return (entry.info->reads & effects::kTemperature) != 0;
}

// The way from end to end that the data show at the output.
double largest_travel(const data::Dataset* dataset, double gear_ratio) {
  double most = 0.0;
  if (dataset)
    for (const data::Experiment& e : dataset->experiments) {
      const bool output = e.has(Column::output_position);
      const std::vector<double>& position = e[output ? Column::output_position : Column::motor_position];
      if (position.empty()) continue;
      const auto [low, high] = std::minmax_element(position.begin(), position.end());
      most = std::max(most, (*high - *low) / (output ? 1.0 : gear_ratio));
    }
  return most;
}

std::optional<double> torque_constant_of(const model::Drive& drive, const data::Dataset* dataset) {
  if (drive.torque_constant_nm_a.value || !dataset) return drive.torque_constant_nm_a.value;
  return dataset->drive.torque_constant_nm_a;
}

// The largest effort, in A or, where it is a torque, N m.
double effort_limit(const model::Drive& drive, const data::Dataset* dataset, const Sensors& sensors) {
  // A rated current says nothing of a torque without the torque constant. A motion that has been recorded before may
  // be repeated.
  if (!sensors.current) return largest(dataset, Column::motor_torque);
  if (drive.rated_current_a.value) return *drive.rated_current_a.value;
  if (const double current = largest(dataset, Column::current); current > 0.0) return current;
  return largest(dataset, Column::motor_torque) / torque_constant_of(drive, dataset).value_or(1.0);
}

bool complete(const model::Model& model) {
  for (const model::Effect& e : model.effects)
    for (const model::Parameter& p : e.parameters)
      if (const catalogue::Entry& entry = catalogue::entry_of(e);
          !p.value && entry.parameters[entry.index_of(p.name)].kind != effects::Kind::grid)
        return false;
  return true;
}

}  // namespace

Sensors sensors_of(const model::Model& model, const data::Dataset* dataset) {
  Sensors sensors;
  if (!dataset || dataset->experiments.empty()) return sensors;
  // A drive is given currents; a torque that was recorded is one where the constant is known.
  sensors.current = dataset->has(Column::current) || torque_constant_of(model.drive, dataset).has_value();
  sensors.output_position = dataset->has(Column::output_position);
  sensors.torque = dataset->has(Column::torque);
  sensors.temperature = dataset->has(Column::temperature);
  for (const data::Experiment& e : dataset->experiments) {
    if (e.encoder_counts) sensors.motor_counts = *e.encoder_counts;
    if (e.output_encoder_counts) sensors.output_counts = *e.output_encoder_counts;
  }
  if (dataset->drive.axis == data::Axis::linear) sensors.motor_counts = sensors.output_counts = 0.0;
  return sensors;
}

MotionSettings setting_of(const model::Model& model, const data::Dataset* dataset) {
  MotionSettings setting;
  const model::Drive& drive = model.drive;
  setting.gear_ratio = drive.gear_ratio.value.value_or(dataset ? dataset->drive.gear_ratio.value_or(1.0) : 1.0);
  const bool linear = drive.axis == data::Axis::linear;
  const Sensors sensors = sensors_of(model, dataset);
  setting.limits.current_a = effort_limit(drive, dataset, sensors);
  setting.limits.velocity_rad_s = drive.rated_velocity_rad_s.value.value_or(largest(dataset, Column::motor_velocity));
  setting.limits.travel_rad = linear ? largest_travel(dataset, setting.gear_ratio) : 2.0 * M_PI;
  setting.limits.duration_s = 180.0;
  // Output torque per unit of effort.
  const double holds = setting.gear_ratio * (sensors.current ? torque_constant_of(drive, dataset).value_or(1.0) : 1.0);
  const double rated = drive.rated_torque_nm.value.value_or(holds * setting.limits.current_a);
  setting.locked_current_a = std::min(setting.limits.current_a, rated / holds);
  // The drive has to move against it and friction.
  setting.limits.load_torque_nm = std::min(0.25 * rated, 0.3 * setting.limits.current_a * holds);
  if (linear) setting.limits.load_torque_nm = 0.0;
  setting.locked = setting.gear_ratio > 1.0;
  if (dataset) {
    setting.temperature = dataset->has(Column::temperature);
    const auto locked = [](const data::Experiment& e) { return e.load == data::Load::locked; };
    const std::vector<data::Experiment>& all = dataset->experiments;
    setting.free = all.empty() || !std::all_of(all.begin(), all.end(), locked);
    setting.locked = setting.locked || std::any_of(all.begin(), all.end(), locked);
  }
  return setting;
}

RehearsedMotions::RehearsedMotions(const PlanRequest& request, const std::vector<std::string_view>& effects) {
  if (request.dataset) {
    if (request.progress) request.progress("fitting the model");
    identified_ = estimation::identify(*request.dataset, *request.model, request.pipeline);
    model_ = identified_->model;
    terms_ = identified_->terms;
  } else {
    model_ = *request.model;
    if (!complete(model_))
      throw simulation::ModelIncomplete(fmt::format(
          "the model {} has parameters without a value; run flexspline identify first, or give measurements",
          model_.name));
    terms_ = estimation::terms_of(model_);
  }
  bool temperature = std::any_of(terms_.begin(), terms_.end(),
                                 [](const estimation::Term& term) { return reads_temperature(*term.entry); });
  for (const std::string_view effect : effects)
    temperature = temperature || reads_temperature(*selection::parse_effect(effect).entry);
  rehearse_all(request, temperature);
  prepare(request);
}

void RehearsedMotions::rehearse_all(const PlanRequest& request, bool temperature) {
  if (request.progress) request.progress("rehearsing motions");
  const Limits& limits = request.setting.limits;
  std::string why = "there is none";
  MotionSettings setting = request.setting;
  setting.temperature = setting.temperature && temperature;
  std::vector<Motion> list = planning::motions(setting);
  if (list.empty())
    throw PlanError("what this drive is said not to do leaves no motion; take something out of --without");
  for (Motion& motion : list) {
    std::vector<Design::Peak> peaks;
    std::vector<data::Experiment> experiments;
    for (Run& run : motion.runs) {
      Rehearsal made = rehearse(model_, run, request.sample_s, limits, request.sensors);
      // Friction and inertia may need more current than allowed although the velocity is within its limit: reduce the
      // amplitude until it fits.
      std::string breaks = broken_limit(made, limits);
      for (int shrunk = 0; !breaks.empty() && shrunk < kShrinkings && run.amplitude > 0.0; ++shrunk) {
        run.amplitude *= kShrinking;
        made = rehearse(model_, run, request.sample_s, limits, request.sensors);
        breaks = broken_limit(made, limits);
      }
      if (!breaks.empty()) {
        why = fmt::format("{} would exceed the {}", run.name, breaks);
        break;
      }
      peaks.push_back({made.peak_current_a, made.peak_velocity_rad_s, made.travel_rad});
      experiments.push_back(std::move(made.experiment));
    }
    if (peaks.size() < motion.runs.size()) continue;
    first_record_.push_back(experiments_.size());
    for (data::Experiment& e : experiments) experiments_.push_back(std::move(e));
    peaks_.push_back(std::move(peaks));
    motions_.push_back(std::move(motion));
  }
  if (motions_.empty())
    throw PlanError(
        fmt::format("no motion stays within the limits ({}); give larger --current-a, --velocity-rad-s or "
                    "--travel-rad",
                    why));
}

void RehearsedMotions::prepare(const PlanRequest& request) {
  std::vector<const data::Experiment*> list;
  for (const data::Experiment& e : experiments_) list.push_back(&e);
  prepared_ = identified_ ? estimation::prepare_with(list, model_.drive, identified_->prepared.pipeline)
                          : estimation::prepare(list, model_, request.pipeline);
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    BalanceData side;
    if (identified_) {
      for (std::size_t i = 0; i < identified_->data.size(); ++i)
        if (identified_->data[i].balance() == balance) {
          side.recorded = &identified_->data[i];
          const estimation::BalanceFit& fit = identified_->fits[i];
          side.noise = fit.rmse() * fit.rmse() * fit.autocorrelation_time;
        }
      if (!side.recorded) continue;
    }
    side.planned = std::make_unique<RegressionProblem>(prepared_, balance);
    if (side.planned->empty()) continue;
    if (balance != Balance::motor && !prepared_.output_signals.torque) continue;
    if (!identified_)
      side.noise = stated_noise(model_.drive, prepared_, balance, request.sample_s) *
                   side.planned->filter_autocorrelation_time();
    side.noise = std::max(side.noise, 1e-30);
    side.relative_noise.assign(prepared_.records.size(), 1.0);
    const double known = side.recorded ? noise_level(*side.recorded) : 0.0;
    for (std::size_t i = 0; known > 0.0 && i < prepared_.records.size(); ++i)
      side.relative_noise[i] = std::max(1.0, noise_level(prepared_, prepared_.records[i], balance) / known);
    balances_.push_back(std::move(side));
  }
}

}  // namespace flexspline::planning
