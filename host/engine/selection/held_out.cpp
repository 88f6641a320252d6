#include "host/engine/selection/held_out.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/estimation/modelled_torque.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

HeldOut::HeldOut(const data::Dataset& dataset, const estimation::Identification& fitted, estimation::Balance balance,
                 const estimation::PreparedData* ready) {
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == data::Role::holdout) experiments.push_back(&e);
  if (experiments.empty()) return;
  prepared = estimation::prepare_with(experiments, fitted.model.drive, fitted.prepared.pipeline, ready);
  prepared.output_signals = fitted.prepared.output_signals;
  estimation::take_modelled_current(prepared, fitted.terms);
  prepared.nonlinear_in_measured_current = fitted.prepared.nonlinear_in_measured_current;
  data = std::make_unique<RegressionProblem>(prepared, balance);
  if (data->empty()) data.reset();
}

double HeldOut::rmse(const Terms& terms) const {
  estimation::PreparedData own;
  std::optional<RegressionProblem> with_load;
  if (!prepared.output_signals.torque) {
    own = prepared;
    if (estimation::take_torque_where_read(own, terms)) with_load.emplace(own, data->balance());
  }
  const Eigen::VectorXd residual = (with_load ? *with_load : *data).residual(terms);
  return residual.size() > 0 ? std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size())) : 0.0;
}

namespace {

// Squared error on held-out data with a candidate over that without it, from which on it is contradicted: it grows by
// what a term must take off; where friction differs from run to run, that of the held-out runs, too, by much more.
double most_growth(const CrossValidatedFit& base, const CrossValidatedFit& with) {
  const auto differs = [](const CrossValidatedFit& fit) {
    return fit.random_effects.std.size() > 0 && fit.random_effects.std.maxCoeff() > 0.0;
  };
  return differs(base) || differs(with) ? kPolicy.max_held_out_growth : 1.0 + kPolicy.line_share;
}

}  // namespace

void check_on_held_out(const HeldOut& held_out, const BalanceSearch& search, std::vector<CandidateFit>& candidates) {
  if (!held_out.data) return;
  const double before = held_out.rmse(search.base.terms);
  while (!candidates.empty() && passes(candidates.front())) {
    CandidateFit& first = candidates.front();
    const double ratio = held_out.rmse(first.fit.terms) / std::max(before, 1e-300);
    first.held_out_ratio = ratio;
    if (ratio * ratio <= most_growth(search.base, first.fit)) return;
    first.why_not =
        fmt::format("the error on experiments that are held out rises by {:.1f} % with it", 100.0 * (ratio - 1.0));
    first.admissible = false;
    sort_candidates(search, candidates);
  }
}

}  // namespace flexspline::selection
