// Learns the points of a table effect from the samples of a balance.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"
#include "host/engine/estimation/smooth_curve.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::estimation {

struct LearnedTable {
  model::Table table;  // with values and their standard deviations, corrected for autocorrelation
  // Of samples that were left out of the fit, in fifths of each record: errors without the table and with it, the
  // decrease of their weighted squares, and twice the log likelihood ratio over the autocorrelation time.
  double rmse_cv_before = 0.0;
  double rmse_cv_after = 0.0;
  double decrease_percent = 0.0;
  double score = 0.0;
  double effective_degrees_of_freedom = 0.0;  // of the curve
  std::vector<std::string> left_to;           // effects of the model that hold what the curve and they could both draw
  std::vector<std::uint8_t>
      visited;  // one a point: whether samples are there; else it is extrapolated from its neighbours
  Eigen::VectorXd residual;
  double autocorrelation_time = 1.0;
};

// The signal and the points of a table that is to be learnt.
struct TableSpecification {
  effects::Variable variable{};
  bool times_direction = false;
  Balance balance = Balance::motor;
  std::vector<double> at;         // points to keep; empty: their number and range follow from the data
  std::size_t most_points = 256;  // where they do
  bool exactly = false;           // as many as that
  bool filtered = true;           // else columns as they are at the samples, which cost little
  bool delay_too = false;         // a delay of the effort is estimated as well
};

// Fits all free linear parameters of `terms` on this balance and the table together (nonlinear parameters move to first
// order), as smooth as cross-validation chooses. A table of `terms` with the id `but` is left out: it is the one to
// learn. The number of points is the least that predicts left-out samples as well as more would, within a fiftieth of
// their squares. Nothing where the signal does not vary.
std::optional<LearnedTable> learn_table(const RegressionProblem& data, const Terms& terms,
                                        const TableSpecification& specification, const Eigen::VectorXd& root_weights,
                                        std::string_view but = {});

// The signal at the samples covers this range, but for one sample in a thousand at each end.
struct SignalRange {
  double low = 0.0;
  double high = 0.0;
};
SignalRange central_range(const Eigen::VectorXd& signal);

// The specification of a table of a model: its own points where it has some.
TableSpecification table_specification(const model::Definition& definition);

// A table effect with what was learnt; `id` names it.
model::Effect effect_of(const TableSpecification& specification, const model::Table& table, std::string id);

}  // namespace flexspline::estimation
