// The results of one model on one data set: curves over time, maps, loops. Computed once for a step, its parts at their
// first request.
#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/output/report/view.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::workbench {

// An unknown name in a request: which, and the known ones.
class UnknownNameError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct TraceRequest {
  std::string experiment;
  std::string signal;  // "motor_balance", ..., or a free run: "motor_velocity", ...
  double from_s = 0.0, to_s = 0.0;
  std::size_t points = 1000;
};

// Safe to use from several threads.
class ResultView {
 public:
  // The model needs values. Throws what comparison::compare throws.
  ResultView(std::shared_ptr<const data::Dataset> dataset, const model::Model& model,
             const estimation::PipelineOptions& pipeline, std::vector<estimation::Estimate> estimates);

  // {"experiments": [{"name", "role", "load", "duration_s", "samples", "begin_s", "signals": [{"signal", "unit",
  // "rmse", "nrmse", "noise_floor", "excess", "free_run"}]}], "balances": [{"signal", "unit", "fit", "holdout",
  // "noise_floor_fit", "noise_floor_holdout", "noise_floor_from"}], "warnings"}; errors of free runs are null.
  nlohmann::json errors() const;
  nlohmann::json parameters() const;
  // Curves "measured", "model", "residual" of window.hpp with "unit", "noise_floor", "rmse". Throws UnknownNameError.
  nlohmann::json trace(const TraceRequest& request);
  // As the report's maps and loops (host/output/report/README.md).
  nlohmann::json maps();
  nlohmann::json loops();
  // Where in time the samples are whose variable is in [low, high]: [{"experiment", "stretches": [[from_s, to_s],
  // ...]}].
  nlohmann::json intervals_of(const std::string& signal, const std::string& variable, double low, double high);

 private:
  struct Curves {
    std::string experiment, signal, unit;
    std::vector<double> measured, model, residual;
    std::vector<std::uint8_t> valid;
  };
  const Curves& curves(std::size_t record, const std::string& signal);
  Curves balance_curves(std::size_t record, const report::BalanceView& balance);
  Curves free_run_curves(std::size_t record, const std::string& signal);
  std::size_t record_of(const std::string& experiment) const;
  const report::BalanceView* balance_of(const std::string& signal) const;

  std::shared_ptr<const data::Dataset> dataset_;
  report::Subject subject_;
  report::View view_;
  mutable std::mutex mutex_;
  std::list<Curves> cache_;  // latest first
  std::unique_ptr<nlohmann::json> maps_, loops_;
};

}  // namespace flexspline::workbench
