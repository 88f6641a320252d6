// Effects of the catalogue that a model does not have and the data could show.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "host/estimation/balance_data.hpp"
#include "host/estimation/terms.hpp"

namespace flexspline::selection {

struct CandidateModel {
  const catalogue::Entry* entry = nullptr;
  std::optional<double> order;
  estimation::Terms terms;  // the model with it: what it replaces is gone, it stands last
  double added = 0.0;       // parameters more than before
};

// What a model leaves, one a row over the row's noise, and the directions in which its own parameters can move that.
struct Unexplained {
  Eigen::VectorXd residual;
  Eigen::VectorXd root_weights;  // the factors that put a row over its noise
  Eigen::MatrixXd own;           // orthonormal, in the same rows; no columns: nothing is taken out
};

// All effects that may be added on this balance; shapes are in the middle of their range. Of an effect that comes in
// orders per turn, those that the residual shows most by what the model's own parameters cannot draw.
std::vector<CandidateModel> candidate_models(const estimation::BalanceData& data, const estimation::Terms& terms,
                                             const Unexplained& left);

// Values of a shape that a search tries first; who asks for the same finds its columns at hand.
inline constexpr std::size_t kShapeGridPoints = 6;

// Whether these signals can show an effect that this model may be given.
bool may_be_seen(const estimation::BalanceData& data, const estimation::Terms& terms, const catalogue::Entry& entry);

// Whether the model states a linear parameter: a torque that the data need not tell.
bool states_a_torque(const estimation::Terms& terms);

// A model with an effect more. Throws model::ModelError where it cannot be (what it modulates or replaces is missing,
// or it is there already).
estimation::Terms extend(const estimation::Terms& terms, const catalogue::Entry& entry, std::optional<double> order);

// Whether a shape of the candidate is all but linear about zero, so that its slope there tells what it could do and
// no grid is needed: an angle or a ratio of either sign.
bool begins_at_zero(const estimation::Term& term, std::size_t parameter);

}  // namespace flexspline::selection
