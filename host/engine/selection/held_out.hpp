// Experiments of role holdout on one torque balance: they judge fitted models and are not fitted on.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::selection {

// The held-out experiments on the pipeline of a fit.
struct HeldOut {
  std::vector<const data::Experiment*> experiments;
  estimation::PreparedData prepared;
  std::unique_ptr<RegressionProblem> data;  // null where no experiment is held out or none shows the balance

  // `ready`: signals of these experiments that are prepared already, or null.
  HeldOut(const data::Dataset& dataset, const estimation::Identification& fitted, estimation::Balance balance,
          const estimation::PreparedData* ready);

  // Root mean square, N m, of what a model leaves with the values in `terms`. Needs `data`.
  double rmse(const Terms& terms) const;
  // That of the torque of one of the terms, N m. Needs `data`.
  double rms_torque(const Terms& terms, std::size_t term) const;

 private:
  const RegressionProblem& data_for(const Terms& terms, estimation::PreparedData& own,
                                    std::optional<RegressionProblem>& with_load) const;
};

// Refuses candidates of the motor balance that would be named and that held-out data contradict, best first, until they
// do not: the squared error there grows with them. The list stays best first. Nothing changes without held-out data.
void check_on_held_out(const HeldOut& held_out, const BalanceSearch& search, std::vector<CandidateFit>& candidates);

}  // namespace flexspline::selection
