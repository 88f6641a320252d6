// Effects of the catalogue that a model does not have and the data could show.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"
#include "host/engine/estimation/terms.hpp"

namespace flexspline::selection {

struct CandidateModel {
  const catalogue::Entry* entry = nullptr;
  std::optional<double> order;
  estimation::Terms terms;  // the model with it: what it replaces is gone, it is last
  double added = 0.0;       // parameters more than before
};

// The residual of a model, each sample over its noise, and the span of the model's own columns.
struct Unexplained {
  Eigen::VectorXd residual;
  Eigen::VectorXd root_weights;  // one over the noise of each sample
  Eigen::MatrixXd own;           // orthonormal basis of the model's columns; empty: none
};

// All effects that may be added on this balance; nonlinear parameters are in the middle of their range. Of an effect
// with orders per turn, the orders with the largest waves in the residual, orthogonal to the model.
std::vector<CandidateModel> candidate_models(const estimation::RegressionProblem& data, const estimation::Terms& terms,
                                             const Unexplained& left);

// The orders that the drive may have: all up to the policy's highest, those that pole pairs and slots of its motor give
// beyond, and those of the output's turn of which a record's range of angles holds more than a cycle.
std::vector<double> possible_orders(const catalogue::Entry& entry, const estimation::PreparedData& prepared);

// Parameters that are fitted.
std::size_t free_count(const estimation::Terms& terms);

// Whether the effect is a constant of each record, which others do not predict.
bool is_each_records_own(const catalogue::Entry& entry);

// The model has a wave of this order of which the effect is what an error of the phase leaves, or the reverse.
bool has_phase_error(const estimation::Terms& terms, const catalogue::Entry& entry, std::optional<double> order);

// Values of a nonlinear parameter that a search tries first; their columns are cached.
inline constexpr std::size_t kGridPoints = 6;

// Some record moves in both directions (each a tenth of its samples), or is at rest, or there are several records of
// each direction. Else differences between directions are confounded with differences between records.
bool moves_both_ways(const estimation::RegressionProblem& data);
// Whether these signals can show an effect that this model may be given.
bool may_be_seen(const estimation::RegressionProblem& data, const estimation::Terms& terms,
                 const catalogue::Entry& entry);

// Sets the linear parameters of the last term to zero, and known, that act in one direction of motion alone, where the
// records to fit on hold none of it: nothing would determine their values.
void leave_out_unseen_direction(const estimation::RegressionProblem& data, estimation::Terms& terms);

// Whether the model states a linear parameter: a torque that the data need not identify.
bool states_a_torque(const estimation::Terms& terms);

// The model with one more effect. Throws model::ModelError where that is impossible: the effect is there already, or
// the one that it modulates or replaces is missing.
estimation::Terms extend(const estimation::Terms& terms, const catalogue::Entry& entry, std::optional<double> order);

// Whether the torque is almost linear in a nonlinear parameter about zero (an angle, a ratio of either sign), so that
// its slope replaces a grid search.
bool begins_at_zero(const estimation::Term& term, std::size_t parameter);

}  // namespace flexspline::selection
