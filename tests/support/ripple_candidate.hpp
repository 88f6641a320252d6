#pragma once

#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::tests {

// The torque ripple of an order, fitted in addition to a model that `search` has fitted.
inline selection::CandidateFit ripple_candidate(selection::BalanceSearch& search, double order,
                                                const Eigen::VectorXd& keep) {
  const catalogue::Entry& entry = catalogue::get("torque_ripple");
  selection::CandidateFit candidate;
  candidate.model = {&entry, order, selection::extend(search.base.terms, entry, order), 2.0};
  candidate.fit = selection::cross_validate(*search.data, candidate.model.terms, keep);
  candidate.gain = selection::likelihood_gain(search.base, candidate.fit, candidate.model.added);
  return candidate;
}

}  // namespace flexspline::tests
