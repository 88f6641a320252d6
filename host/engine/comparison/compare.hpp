// A model with values against measurements: by experiment, by signal, and by region of what the error may depend on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/engine/comparison/black_box_baseline.hpp"
#include "host/engine/comparison/h_infinity.hpp"
#include "host/engine/estimation/record.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::comparison {

// The error is measured minus model. NaN where a number is not known (a signal that does not vary has no nrmse; a free
// run that diverges has none at all).
struct SignalResult {
  std::string signal;  // motor_balance, transmission_balance, load_balance; free run: motor_velocity, motor_position,
                       // output_position, torque
  std::string unit;    // of rmse, max_abs and noise_floor
  std::size_t samples = 0;
  std::size_t masked = 0;  // left out
  double rmse = 0.0;
  double nrmse = 0.0;        // rmse / std(y)
  double fit_percent = 0.0;  // 100 (1 - |y - yhat| / |y - mean(y)|)
  double vaf_percent = 0.0;  // 100 (1 - var(y - yhat) / var(y))
  double max_abs = 0.0;
  HInfinityNorm h_infinity;  // of the error against the signal, without a mask
  std::optional<double> noise_floor;
  std::string noise_floor_from = "none";
  bool collapsed = false;  // motor and load are one balance, as there is no torque sensor

  std::optional<double> excess() const {
    return noise_floor && *noise_floor > 0.0 ? std::optional(rmse / *noise_floor) : std::nullopt;
  }
};

struct ExperimentResult {
  std::string name;
  data::Role role = data::Role::fit;
  std::vector<SignalResult> signals;
};

// Samples of all experiments in which a variable is between two values.
struct Region {
  std::string signal;
  std::string unit;
  std::string variable;
  std::string variable_unit;
  double low = 0.0;
  double high = 0.0;
  std::size_t samples = 0;
  double bias = 0.0;
  double rmse = 0.0;
  double excess = 0.0;  // rmse over the noise floor of these samples; NaN where there is none
};

struct Comparison {
  std::vector<ExperimentResult> experiments;  // in the order of the data set
  std::vector<SignalResult> overall;          // all samples of all experiments together
  std::vector<Region> regions;
  std::vector<BaselineResult> baselines;  // black boxes, in the order of the command, each with its signals
  estimation::Pipeline pipeline;
  std::vector<std::string> warnings;

  const SignalResult* find_overall(std::string_view signal) const;
};

// Options of a comparison: parts that take longer than errors by experiment, and are not always needed.
struct CompareOptions {
  bool free_runs = true;          // else the balances alone
  bool regions_and_gains = true;  // else neither `regions` nor H-infinity norms of balances
};

// Inverse model: each torque balance on the samples of the regression, with the motion as measured. Free run: what the
// model does with the measured effort alone, from the measured state at the start of each segment; positions are not
// detrended, as drift is an error. The cut-off is chosen from the experiments of role fit, where there are any.
// `baselines`: black boxes that are fitted to the same signals, see black_box_baseline.hpp. Throws model::ModelError
// naming parameters without a value, data::DataError where no balance can be formed.
Comparison compare(const data::Dataset& dataset, const model::Model& model, const estimation::PipelineOptions& options,
                   const std::vector<blackbox::Specification>& baselines = {}, CompareOptions extent = {});

// Throws model::ModelError naming the parameters without a value, if there are any.
void require_values(const model::Model& model);

}  // namespace flexspline::comparison
