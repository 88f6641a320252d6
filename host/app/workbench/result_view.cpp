#include "host/app/workbench/result_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/app/workbench/window.hpp"
#include "host/engine/comparison/free_run.hpp"
#include "host/engine/comparison/full_rate.hpp"
#include "host/engine/comparison/sample_variables.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/report/parts.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;
using output::json_number;

constexpr std::size_t kCachedCurves = 12;
// More points than a screen has columns.
constexpr std::size_t kMostPoints = 20000;

const char* role_name(data::Role role) {
  return role == data::Role::holdout ? "holdout" : "fit";
}

report::Subject subject_of(const data::Dataset& dataset, const model::Model& model,
                           const estimation::PipelineOptions& pipeline, std::vector<estimation::Estimate> estimates) {
  report::Subject subject;
  subject.dataset = &dataset;
  subject.model = model;
  subject.pipeline = pipeline;
  subject.estimates = std::move(estimates);
  // Runs of all records take longer than all else; one that is shown is computed then. Regions are seen in maps; the
  // error over frequency is not shown.
  subject.extent = {.free_runs = false, .regions_and_gains = false};
  return subject;
}

struct Pool {
  double squares = 0.0, floor_squares = 0.0, samples = 0.0;
  bool floor_known = true;
  void add(const comparison::SignalResult& s) {
    const auto n = static_cast<double>(s.samples);
    samples += n;
    squares += s.rmse * s.rmse * n;
    floor_known = floor_known && s.noise_floor;
    floor_squares += s.noise_floor.value_or(0.0) * s.noise_floor.value_or(0.0) * n;
  }
  json error() const { return samples > 0.0 ? json_number(std::sqrt(squares / samples)) : json(nullptr); }
  json floor() const {
    return samples > 0.0 && floor_known ? json_number(std::sqrt(floor_squares / samples)) : json(nullptr);
  }
};

json signal_json(const std::string& signal, const std::string& unit) {
  return {{"signal", signal},       {"unit", unit},      {"rmse", nullptr}, {"nrmse", nullptr},
          {"noise_floor", nullptr}, {"excess", nullptr}, {"free_run", true}};
}

}  // namespace

ResultView::ResultView(std::shared_ptr<const data::Dataset> dataset, const model::Model& model,
                       const estimation::PipelineOptions& pipeline, std::vector<estimation::Estimate> estimates)
    : dataset_(std::move(dataset)),
      subject_(subject_of(*dataset_, model, pipeline, std::move(estimates))),
      view_(subject_) {}

json ResultView::errors() const {
  json experiments = json::array(), balances = json::array();
  for (std::size_t i = 0; i < view_.comparison.experiments.size(); ++i) {
    const comparison::ExperimentResult& result = view_.comparison.experiments[i];
    const data::Experiment& e = dataset_->experiments[i];
    json signals = json::array();
    for (const comparison::SignalResult& s : result.signals) {
      json one = signal_json(s.signal, s.unit);
      one["rmse"] = json_number(s.rmse);
      one["nrmse"] = json_number(s.nrmse);
      one["noise_floor"] = json_number(s.noise_floor);
      one["excess"] = json_number(s.excess());
      one["free_run"] = false;
      signals.push_back(std::move(one));
    }
    const bool runs = e.has(data::Column::current) || e.has(data::Column::motor_torque);
    const auto offer = [&](data::Column column, const char* signal, bool measured) {
      if (runs && measured) signals.push_back(signal_json(signal, view_.unit_of(column)));
    };
    offer(data::Column::motor_velocity, "motor_velocity", view_.prepared.records[i].has_motor_motion);
    offer(data::Column::motor_position, "motor_position", e.has(data::Column::motor_position));
    offer(data::Column::output_position, "output_position",
          e.has(data::Column::output_position) && e.load != data::Load::locked);
    offer(data::Column::torque, "torque", e.has(data::Column::torque));
    experiments.push_back({{"name", result.name},
                           {"role", role_name(result.role)},
                           {"load", e.load == data::Load::locked ? "locked" : "free"},
                           {"samples", e.size()},
                           {"begin_s", e.time_s.front()},
                           {"end_s", e.time_s.back()},
                           {"signals", std::move(signals)}});
  }
  for (const report::BalanceView& balance : view_.balances) {
    Pool fit, holdout;
    std::string from = "none";
    for (std::size_t i = 0; i < view_.comparison.experiments.size(); ++i)
      if (const comparison::SignalResult* s = view_.result(i, balance.signal)) {
        (view_.comparison.experiments[i].role == data::Role::holdout ? holdout : fit).add(*s);
        if (s->noise_floor) from = s->noise_floor_from;
      }
    balances.push_back({{"signal", balance.signal},
                        {"unit", balance.unit},
                        {"fit", fit.error()},
                        {"holdout", holdout.error()},
                        {"noise_floor_fit", fit.floor()},
                        {"noise_floor_holdout", holdout.floor()},
                        {"noise_floor_from", from}});
  }
  return {{"experiments", std::move(experiments)},
          {"balances", std::move(balances)},
          {"warnings", view_.comparison.warnings}};
}

json ResultView::parameters() const {
  return report::parameters(subject_, view_);
}

std::size_t ResultView::record_of(const std::string& experiment) const {
  for (std::size_t i = 0; i < view_.prepared.records.size(); ++i)
    if (view_.prepared.records[i].name == experiment) return i;
  throw UnknownNameError(fmt::format("there is no experiment \"{}\"", experiment));
}

const report::BalanceView* ResultView::balance_of(const std::string& signal) const {
  for (const report::BalanceView& balance : view_.balances)
    if (balance.signal == signal) return &balance;
  return nullptr;
}

ResultView::Curves ResultView::balance_curves(std::size_t record, const report::BalanceView& balance) {
  const auto full =
      comparison::full_rate(view_.prepared, view_.prepared.records[record], balance.data->balance(), view_.terms);
  if (!full)
    throw UnknownNameError(
        fmt::format("{} lacks what the {} needs", view_.prepared.records[record].name, balance.signal));
  Curves c{
      view_.prepared.records[record].name, balance.signal, balance.unit, full->target, {}, full->residual, full->valid};
  c.model.resize(c.measured.size());
  for (std::size_t k = 0; k < c.model.size(); ++k) c.model[k] = full->target[k] - full->residual[k];
  return c;
}

ResultView::Curves ResultView::free_run_curves(std::size_t record, const std::string& signal) {
  const data::Experiment& e = dataset_->experiments[record];
  try {
    for (comparison::FreeRunSignal& s :
         comparison::free_run_signals(view_.prepared, record, simulation::run(view_.model, e))) {
      if (s.name != signal) continue;
      Curves c{e.name, signal, view_.unit_of(s.column), std::move(s.measured), std::move(s.simulated), {}, {}};
      c.residual.resize(c.measured.size());
      for (std::size_t k = 0; k < c.residual.size(); ++k) c.residual[k] = c.measured[k] - c.model[k];
      return c;
    }
  } catch (const simulation::ModelIncomplete& incomplete) {
    throw UnknownNameError(fmt::format("no free run: {}", incomplete.what()));
  } catch (const std::invalid_argument& unusable) {
    throw UnknownNameError(fmt::format("no free run: {}", unusable.what()));
  }
  throw UnknownNameError(fmt::format("{} has no {} to show", e.name, signal));
}

const ResultView::Curves& ResultView::curves(std::size_t record, const std::string& signal) {
  const std::string& name = view_.prepared.records[record].name;
  const auto found = std::find_if(cache_.begin(), cache_.end(),
                                  [&](const Curves& c) { return c.experiment == name && c.signal == signal; });
  if (found != cache_.end()) {
    cache_.splice(cache_.begin(), cache_, found);
  } else {
    const report::BalanceView* balance = balance_of(signal);
    cache_.push_front(balance ? balance_curves(record, *balance) : free_run_curves(record, signal));
    if (cache_.size() > kCachedCurves) cache_.pop_back();
  }
  return cache_.front();
}

json ResultView::trace(const TraceRequest& request) {
  const std::lock_guard lock(mutex_);
  const std::size_t record = record_of(request.experiment);
  const Curves& c = curves(record, request.signal);
  json answer = window(view_.prepared.records[record].segments, dataset_->experiments[record].time_s, request.from_s,
                       request.to_s, std::clamp<std::size_t>(request.points, 10, kMostPoints),
                       {{"measured", c.measured}, {"model", c.model}, {"residual", c.residual, c.valid}});
  answer["unit"] = c.unit;
  answer["noise_floor"] = nullptr;
  answer["rmse"] = nullptr;
  if (const comparison::SignalResult* s = view_.result(record, request.signal)) {
    answer["noise_floor"] = json_number(s->noise_floor);
    answer["rmse"] = json_number(s->rmse);
  }
  return answer;
}

json ResultView::maps() {
  const std::lock_guard lock(mutex_);
  if (!maps_) maps_ = std::make_unique<json>(report::residual_maps(view_));
  return *maps_;
}

json ResultView::loops() {
  const std::lock_guard lock(mutex_);
  if (!loops_) loops_ = std::make_unique<json>(report::hysteresis_loops(view_));
  return *loops_;
}

json ResultView::intervals_of(const std::string& signal, const std::string& variable, double low, double high) {
  const std::lock_guard lock(mutex_);
  const report::BalanceView* balance = balance_of(signal);
  if (!balance) throw UnknownNameError(fmt::format("there is no balance \"{}\"", signal));
  json list = json::array();
  const auto variables = comparison::sample_variables(*balance->data, view_.axis());
  const auto found =
      std::find_if(variables.begin(), variables.end(), [&](const auto& v) { return v.name == variable; });
  if (found == variables.end()) throw UnknownNameError(fmt::format("there is no map over \"{}\"", variable));
  for (const estimation::RowRange& range : balance->data->records()) {
    const estimation::Record& record = view_.prepared.records[range.record];
    const std::vector<double>& time = dataset_->experiments[range.record].time_s;
    std::vector<double> times;
    for (Eigen::Index k = range.first; k < range.last; ++k)
      if (found->values[k] >= low && found->values[k] <= high)
        times.push_back(time[balance->data->sample_of(range, k)]);
    if (times.empty()) continue;
    const double row_s = record.sample_s * static_cast<double>(record.decimation);
    list.push_back({{"experiment", record.name}, {"rows", times.size()}, {"stretches", intervals(times, 1.5 * row_s)}});
  }
  return list;
}

}  // namespace flexspline::workbench
