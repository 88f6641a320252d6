#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/engine/comparison/free_run.hpp"
#include "host/engine/comparison/full_rate.hpp"
#include "host/input/data/record_time.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/report/parts.hpp"
#include "host/output/report/trace.hpp"

namespace flexspline::report {
namespace {

using nlohmann::json;
using output::json_number;

// The page stays small with any number of experiments.
constexpr std::size_t kPointsInAll = 32000;
constexpr std::size_t kMostPoints = 2000;
constexpr std::size_t kFewestPoints = 400;

// By more than a refit of what was not touched makes.
bool differs(const std::vector<double>& a, const std::vector<double>& b) {
  double difference = 0.0, size = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    difference += (a[k] - b[k]) * (a[k] - b[k]);
    size += b[k] * b[k];
  }
  return difference > 1e-6 * size;
}

// As messages have them.
std::vector<double> times_of(const data::Experiment& experiment, const Thinning& thinning) {
  std::vector<double> times = thinning.times(experiment.time_s);
  for (double& t : times) t -= data::start_of_times(experiment);
  return times;
}

json balance_trace(const View& view, const BalanceView& balance, std::size_t record_at, std::size_t points) {
  const estimation::Record& record = view.prepared.records[record_at];
  const auto full = comparison::full_rate(view.prepared, record, balance.data->balance(), view.terms);
  if (!full) return nullptr;
  const Thinning thinning(record.segments, points);
  std::vector<double> modelled(full->target.size());
  for (std::size_t k = 0; k < modelled.size(); ++k) modelled[k] = full->target[k] - full->residual[k];
  json trace{{"signal", balance.signal},
             {"unit", balance.unit},
             {"time", packed(times_of(*record.experiment, thinning))},
             {"measured", packed(thinning.values(full->target))},
             {"model", packed(thinning.values(modelled))},
             {"residual", packed(thinning.values(full->residual, full->valid))},
             {"noise_floor", nullptr},
             {"before", nullptr}};
  if (const auto* result = view.result(record_at, balance.signal))
    trace["noise_floor"] = json_number(result->noise_floor);
  if (view.terms_before)
    if (const auto before = comparison::full_rate(view.prepared, record, balance.data->balance(), *view.terms_before);
        before && differs(before->residual, full->residual))
      trace["before"] = packed(thinning.values(before->residual, before->valid));
  return trace;
}

json free_run_traces(const View& view, std::size_t record_at, std::size_t points) {
  json traces = json::array();
  const data::Experiment& e = view.dataset.experiments[record_at];
  // What the comparison could not run is not run here either.
  const auto& compared = view.comparison.experiments[record_at].signals;
  if (std::all_of(compared.begin(), compared.end(), [](const auto& s) { return s.signal.ends_with("_balance"); }))
    return traces;
  const Thinning thinning(view.prepared.records[record_at].segments, points);
  for (const comparison::FreeRunSignal& signal :
       comparison::free_run_signals(view.prepared, record_at, simulation::run(view.model, e))) {
    if (!view.result(record_at, signal.name)) continue;
    traces.push_back({{"signal", signal.name},
                      {"unit", view.unit_of(signal.column)},
                      {"time", packed(times_of(e, thinning))},
                      {"measured", packed(thinning.values(signal.measured))},
                      {"model", packed(thinning.values(signal.simulated))}});
  }
  return traces;
}

}  // namespace

json traces(View& view) {
  const std::size_t count = std::max<std::size_t>(1, view.prepared.records.size());
  const std::size_t points = std::clamp(kPointsInAll / count, kFewestPoints, kMostPoints);
  json list = json::array();
  for (std::size_t i = 0; i < view.prepared.records.size(); ++i) {
    json balances = json::array();
    for (const BalanceView& balance : view.balances)
      if (view.result(i, balance.signal))
        if (json trace = balance_trace(view, balance, i, points); !trace.is_null())
          balances.push_back(std::move(trace));
    list.push_back({{"experiment", view.prepared.records[i].name},
                    {"balances", std::move(balances)},
                    {"free_runs", free_run_traces(view, i, points / 2)}});
  }
  return list;
}

}  // namespace flexspline::report
