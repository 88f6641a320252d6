// Linear black boxes fitted to the signals of a comparison, for comparison with the physical model: what error do so
// many parameters reach without any physics?
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host/engine/blackbox/specification.hpp"
#include "host/engine/estimation/regression_problem.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::comparison {

// A signal as a black box sees it: the decimated samples of each segment, with the filter of the balances. Masked
// samples are kept as past values of later ones.
struct BaselineSignal {
  struct Segment {
    blackbox::Record record;
    std::vector<double> model_error;  // measured minus physical model, on the same samples
  };
  std::string signal;  // as in SignalResult
  std::string unit;
  std::string load;  // "free" or "locked" where these are different systems
  std::vector<std::string> inputs;
  std::vector<double> sample_s;  // one for each segment
  std::vector<Segment> segments;
  std::vector<std::string> experiments;  // names and roles by the index in blackbox::Record
  std::vector<data::Role> roles;
};

struct BaselineExperiment {
  std::string name;
  data::Role role = data::Role::fit;
  double rmse = 0.0;        // free run
  double model_rmse = 0.0;  // the physical model on the same samples
};

// NaN where a figure is not known: no such experiments, or a black box that is not stable (its free runs).
struct BaselineResult {
  std::string requested;  // "arx:auto"
  std::string black_box;  // "arx:6,6,1"
  std::string signal;
  std::string unit;
  std::string load;  // "", "free" or "locked"
  std::vector<std::string> inputs;
  std::size_t parameters = 0;
  double sample_s = 0.0;
  std::size_t samples = 0;
  double rmse = 0.0;  // free run over all experiments, as nrmse and fit_percent
  double nrmse = 0.0;
  double fit_percent = 0.0;
  double rmse_one_step = 0.0;  // with the measured past
  double rmse_fit = 0.0;
  double rmse_holdout = 0.0;
  double model_rmse = 0.0;  // the physical model on the same samples
  double model_rmse_holdout = 0.0;
  double largest_pole = 0.0;
  bool stable = true;
  std::vector<BaselineExperiment> experiments;
};

// A balance: its target from the motion, both filtered. Inputs are acceleration and velocity of the motor (motor),
// torsion and torsion rate (transmission), acceleration and velocity of the output (load); a motor balance that holds
// the others takes the torsion too; what is zero throughout is left out. The motion at the same instant is known: nk =
// 1 refers to it.
BaselineSignal balance_signal(const estimation::PreparedData& prepared, const estimation::RegressionProblem& data,
                              const estimation::Terms& terms, const std::string& signal, const std::string& unit);

// Adds a record to the free run of motor_velocity or torque: what the measured effort makes of it (report, figure 4).
// Locked and free records are different systems and become signals of their own. Other signals are not added: a
// position integrates its input, which a finite impulse response cannot represent. `model_error` has one entry for each
// sample of the record.
void add_free_run_signal(const estimation::PreparedData& prepared, std::size_t record, const std::string& signal,
                         const std::string& unit, const std::vector<double>& measured,
                         const std::vector<double>& model_error, std::vector<BaselineSignal>& signals);

// Fits each black box to each signal on the experiments of role fit (on all where there are none, with a warning) and
// scores it on all. A black box that cannot be fitted is left out with a warning.
std::vector<BaselineResult> fit_baselines(const std::vector<BaselineSignal>& signals,
                                          const std::vector<blackbox::Specification>& requested,
                                          std::vector<std::string>& warnings);

}  // namespace flexspline::comparison
