// What a model depends on: its errors, and its amplitude and phase, with each effect left out in turn or a parameter
// scaled, compared with those of the full model (report, section 5.4).
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/engine/sensitivity/changes.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::sensitivity {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Simulated over measured at one frequency.
struct Response {
  double frequency_hz = kUnknown;
  double amplitude_ratio = kUnknown;
  double phase_deg = kUnknown;  // positive: the model leads
};

// One signal of one model. NaN where a number is not known: a free run that diverges has none, a balance no response.
struct SignalError {
  std::string signal;  // as in a comparison: motor_balance, ...; free run: motor_velocity, torque, ...
  std::string load;    // of a free run: "free" or "locked"; balances take both together
  std::string unit;
  std::size_t samples = 0;
  double rmse = kUnknown;
  double nrmse = kUnknown;   // rmse / std(y)
  double growth = kUnknown;  // of nrmse over the full model's; infinite where only the changed model diverges
  // At the strongest line of the motion. Over experiments: the mean that fits all of their sines best.
  Response response;
  std::vector<Response> lines;   // of one experiment: all lines of its motion, the strongest first
  std::string worst_experiment;  // of all experiments: the one with the largest growth

  bool is_balance() const { return signal.ends_with("_balance"); }
  // Drift sums up in a position that nothing holds.
  bool drifts() const { return signal.ends_with("_position") && load == "free"; }
};

struct ExperimentErrors {
  std::string name;
  data::Role role = data::Role::fit;
  std::string load;
  std::vector<SignalError> signals;
};

struct Variant {
  std::optional<Change> change;            // none: the full model
  std::vector<std::string> also_left_out;  // effects that scaled what was left out
  double growth = kUnknown;                // largest of `overall`, free positions aside
  std::vector<SignalError> overall;
  std::vector<ExperimentErrors> experiments;  // in the order of the data set
  std::string note;                           // why something is not known

  std::string label() const { return change ? change->label() : "the full model"; }
  const SignalError* find(std::string_view signal, std::string_view load = "") const;
};

struct Options {
  estimation::PipelineOptions pipeline{};
  bool refit = false;             // re-estimate what is left, for the full model too
  std::vector<Change> more = {};  // after the usual changes
  unsigned threads = 0;           // 0: as many as the machine has; the answer does not depend on it
  std::function<void(std::size_t done, std::size_t all)> progress = {};  // one call at a time, from any thread
};

struct Sensitivity {
  bool refit = false;
  Variant full;
  std::vector<Variant> variants;  // worst first
  estimation::Pipeline pipeline;
  std::vector<std::string> warnings;
};

// Evaluates the errors of all experiments as `comparison::compare` does. With `refit` the experiments of role fit are
// fitted. A change that leaves a model which cannot be run or fitted has a note. Throws model::ModelError where a
// parameter has no value or `more` names what the model does not have, data::DataError where nothing can be compared.
Sensitivity analyse(const data::Dataset& dataset, const model::Model& model, const Options& options);

}  // namespace flexspline::sensitivity
