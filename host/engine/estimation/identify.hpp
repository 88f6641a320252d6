// Identification of a model from a data set: estimates as the report gives them (by experiment, average, spread) and
// pooled with intervals.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/by_experiment.hpp"
#include "host/engine/estimation/learned_table.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::estimation {

struct Estimate : ByExperiment {
  ParameterRef ref;
  std::string id, effect, parameter, unit;
  double value = 0.0;
  std::optional<double> std;
  std::optional<double> low, high;  // 95 % interval
  std::optional<double> change_at_twice_cutoff;
  bool identifiable = true;
  bool fixed = false;
  // Persistent excitation, by parameter (report 3.1): the share of its effect on the data, 0 to 1, that no other
  // parameter can explain.
  std::optional<double> excitation;
};

// A value that follows from several parameters, as the report gives them: Tvp = Tv + dTv.
struct Derived : ByExperiment {
  std::string name;
  double value = 0.0;
  std::string unit;
};

struct Identification {
  std::string_view method = "";  // as in Options of estimate.hpp; empty: of identify()
  PreparedData prepared;
  Terms terms;                                      // with values
  std::vector<RegressionProblem> data;              // the balances that could be formed
  std::vector<BalanceFit> fits;                     // one each
  std::vector<std::vector<ParameterRef>> at_bound;  // on each, parameters whose value is their bound
  std::vector<Estimate> estimates;
  std::vector<std::pair<std::string, LearnedTable>> tables;  // by id: those of the model that are not fixed
  std::vector<Derived> derived;
  double condition_number = 0.0;
  std::vector<std::string> warnings;
  model::Model model;  // the input with estimates in it
};

// Fits every balance that has data. Only experiments of role fit are used. Throws data::DataError where there is
// nothing to fit on.
std::unique_ptr<Identification> identify(const data::Dataset& dataset, const model::Model& model,
                                         const PipelineOptions& options);

// Its three steps, for other estimators to come between: balances from the data; their fit; estimates, tables and
// warnings from the fits and the values in `terms`.
std::unique_ptr<Identification> build_balances(const data::Dataset& dataset, const model::Model& model,
                                               const PipelineOptions& options);
void fit(Identification& identification);
// Fits a balance; a parameter whose best value is not possible (negative friction) is held at its bound and the others
// are fitted again. Returns the fit and what was held at a bound, which is among the warnings.
std::pair<BalanceFit, std::vector<ParameterRef>> fit_within_bounds(const RegressionProblem& data, Terms& terms,
                                                                   data::Axis axis, std::vector<std::string>& warnings);
void compute_estimates(Identification& identification);

// Where data set and model differ in what they know of the drive by more than 0.1 %: the model wins, with a warning.
// What only the data set knows is filled in.
model::Drive reconcile(const model::Drive& drive, const data::Dataset& dataset, std::vector<std::string>& warnings);

// Writes estimates into a model.
void store(model::Model& model, const std::vector<Estimate>& estimates);

}  // namespace flexspline::estimation
