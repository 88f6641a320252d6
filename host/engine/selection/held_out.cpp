#include "host/engine/selection/held_out.hpp"

#include <fmt/format.h>

#include "host/common/algebra/root_mean_square.hpp"
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
  std::optional<RegressionProblem> with_load;
  estimation::PreparedData own;
  return algebra::root_mean_square(data_for(terms, own, with_load).residual(terms));
}

double HeldOut::rms_torque(const Terms& terms, std::size_t term) const {
  std::optional<RegressionProblem> with_load;
  estimation::PreparedData own;
  return algebra::root_mean_square(data_for(terms, own, with_load).term_torque(terms, term));
}

// Where no torque is measured, a law of it reads that of the load.
const RegressionProblem& HeldOut::data_for(const Terms& terms, estimation::PreparedData& own,
                                           std::optional<RegressionProblem>& with_load) const {
  if (prepared.output_signals.torque) return *data;
  own = prepared;
  if (!estimation::take_torque_where_read(own, terms)) return *data;
  return with_load.emplace(own, data->balance());
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
    first.shows_held_out = std::pow(held_out.rms_torque(first.fit.terms, first.fit.terms.size() - 1), 2) >=
                           kPolicy.matters_share * before * before;
    if (ratio * ratio <= most_growth(search.base, first.fit)) return;
    first.why_not =
        fmt::format("the error on experiments that are held out rises by {:.1f} % with it", 100.0 * (ratio - 1.0));
    first.admissible = false;
    sort_candidates(search, candidates);
  }
}

}  // namespace flexspline::selection
