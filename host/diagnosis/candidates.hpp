// Effects of the catalogue that a model does not have and the data could show.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "host/regression/balance_data.hpp"
#include "host/regression/terms.hpp"

namespace flexspline::diagnosis {

struct Proposal {
  const catalogue::Entry* entry = nullptr;
  std::optional<double> order;
  regression::Terms extended;  // the model with it: what it replaces is gone, it stands last
  double added = 0.0;          // parameters more than before
};

// What a model leaves, one a row over the row's noise, and the directions in which its own parameters can move that.
struct Unexplained {
  Eigen::VectorXd residual;
  Eigen::VectorXd root_weights;  // the factors that put a row over its noise
  Eigen::MatrixXd own;           // orthonormal, in the same rows; no columns: nothing is taken out
};

// All effects that may be added on this balance; shapes are in the middle of their range. Of an effect that comes in
// orders per turn, those that the residual shows most by what the model's own parameters cannot draw.
std::vector<Proposal> proposals(const regression::BalanceData& data, const regression::Terms& terms,
                                const Unexplained& left);

// Whether these signals can show an effect that this model may be given.
bool may_be_seen(const regression::BalanceData& data, const regression::Terms& terms, const catalogue::Entry& entry);

// Whether the model states a linear parameter: a torque that the data need not tell.
bool states_a_torque(const regression::Terms& terms);

// A model with an effect more. Throws model::ModelError where it cannot be (what it modulates or replaces is missing,
// or it is there already).
regression::Terms extend(const regression::Terms& terms, const catalogue::Entry& entry, std::optional<double> order);

// Whether a shape of the candidate is all but linear about nought, so that its slope there tells what it could do and
// no grid is needed: an angle or a ratio of either sign.
bool begins_at_nought(const regression::Term& term, std::size_t parameter);

}  // namespace flexspline::diagnosis
