#include "host/engine/selection/significance_checks.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/estimation/evidence.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/selection/other_balance_evidence.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

using effects::Kind;

std::size_t order_place(const catalogue::Entry& entry) {
  for (std::size_t p = 0; p < entry.parameters.size(); ++p)
    if (entry.parameters[p].kind == Kind::given) return p;
  return entry.parameters.size();
}

// Columns of the added effect at an order: of its linear parameters, or slopes by its nonlinear parameters about zero.
Eigen::MatrixXd order_columns(const RegressionProblem& data, Terms terms, double order) {
  estimation::Term& added = terms.back();
  added.values[order_place(*added.entry)] = order;
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  Eigen::MatrixXd columns(data.rows(), 0);
  const auto take = [&](const Eigen::VectorXd& column) {
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols(1) = column;
  };
  for (std::size_t p = 0; p < added.values.size(); ++p)
    if (added.free_nonlinear(p)) added.values[p] = 0.0;
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (added.free_linear(p)) take(data.column(terms, {terms.size() - 1, p}));
    if (added.free_nonlinear(p)) take(data.nonlinear_columns(terms, on_balance, {{terms.size() - 1, p}}));
  }
  return columns;
}

// A balance on which the effect of a candidate acts, and the span of its model there.
struct ActingBalance {
  const BalanceSearch* search = nullptr;
  const estimation::ModelProjection* projection = nullptr;
  const CrossValidatedFit* noise = nullptr;  // whose weights count
};

// Squares that an order takes off the residuals of all balances on which it acts, in units of the noise; its own
// balance first.
double explained(const std::vector<ActingBalance>& acting, const Terms& terms, double order) {
  std::vector<Eigen::MatrixXd> parts;
  std::vector<Eigen::VectorXd> residuals;
  Eigen::Index rows = 0;
  for (const ActingBalance& w : acting) {
    Terms tried = terms;
    estimation::Term& added = tried.back();
    added.values[order_place(*added.entry)] = order;
    Eigen::MatrixXd columns;
    if (parts.empty()) {
      columns = order_columns(*w.search->data, terms, order);
    } else {
      std::vector<std::size_t> parameters;
      for (std::size_t p = 0; p < added.values.size(); ++p)
        if (added.free_linear(p) || added.free_nonlinear(p)) {
          parameters.push_back(p);
          added.values[p] = 0.0;
        }
      columns = estimation::cross_balance_columns(*w.search->data, tried, tried.size() - 1, parameters);
    }
    const Eigen::VectorXd weights = w.noise->root_weights / std::sqrt(std::max(1.0, w.noise->autocorrelation_time));
    parts.push_back(weights.asDiagonal() * w.projection->orthogonal_part(columns));
    residuals.push_back(weights.cwiseProduct(w.search->base.residual));
    rows += residuals.back().size();
  }
  Eigen::MatrixXd own(rows, parts.front().cols());
  Eigen::VectorXd residual(rows);
  for (std::size_t i = 0, at = 0; i < parts.size(); at += static_cast<std::size_t>(parts[i].rows()), ++i) {
    own.middleRows(static_cast<Eigen::Index>(at), parts[i].rows()) = parts[i];
    residual.segment(static_cast<Eigen::Index>(at), parts[i].rows()) = residuals[i];
  }
  // Parameters differ in size by their units.
  for (auto column : own.colwise()) column /= std::max(column.norm(), 1e-300);
  const Eigen::VectorXd left = residual - own * algebra::PivotedQr(own, 1e-7).solve(residual);
  return residual.squaredNorm() - left.squaredNorm();
}

// Orders that no drive has, as those of the motor's turn or, for an order below one, of the output's.
std::vector<double> placebos_of(double order) {
  std::vector<double> placebos;
  for (int i = 0; i < kPolicy.placebo_orders; ++i)
    placebos.push_back((kPolicy.first_placebo_order + i) * std::min(1.0, order));
  return placebos;
}

// Whether the order is likelier than any that no drive has, by the noise that is left with it.
bool is_likelier_than_placebos(std::vector<ActingBalance> acting, const CandidateFit& candidate) {
  const BalanceSearch& own_search = *acting.front().search;
  if (!own_search.at_floor(candidate.fit) || (acting.size() > 1 && !candidate.at_floor_on_others)) return false;
  const estimation::ModelProjection projection(estimation::model_columns(*own_search.data, own_search.base.terms),
                                               candidate.fit.root_weights);
  acting.front() = {&own_search, &projection, &candidate.fit};
  const double true_gain = explained(acting, candidate.fit.terms, *candidate.model.order);
  for (const double placebo : placebos_of(*candidate.model.order))
    if (explained(acting, candidate.fit.terms, placebo) > true_gain - kPolicy.score_over_placebo) return false;
  return true;
}

// The usual order of such effects, unless another order fits better by more than this.
bool usual_and_best(const std::vector<CandidateFit>& candidates, const CandidateFit& candidate, double better_by) {
  const catalogue::Entry& entry = *candidate.model.entry;
  return *candidate.model.order == entry.parameters[order_place(entry)].usual &&
         std::none_of(candidates.begin(), candidates.end(), [&](const CandidateFit& other) {
           return other.model.entry == &entry && other.score() > candidate.score() + better_by;
         });
}

std::string objection_to_order(const std::vector<ActingBalance>& acting, const CandidateFit& candidate) {
  const BalanceSearch& search = *acting.front().search;
  const double order = *candidate.model.order;
  const double true_gain = explained(acting, candidate.fit.terms, order);
  double best_gain = 0.0, best_placebo = 0.0;
  for (const double placebo : placebos_of(order)) {
    const double gain = explained(acting, candidate.fit.terms, placebo);
    if (gain <= best_gain) continue;
    best_gain = gain;
    best_placebo = placebo;
  }
  if (best_gain * kPolicy.least_over_placebo > true_gain && !is_likelier_than_placebos(acting, candidate))
    return fmt::format(
        "order {:g} explains {:.0f} % of what this one does, and no drive has that: the data are too "
        "short to distinguish orders",
        best_placebo, 100.0 * best_gain / std::max(true_gain, 1e-300));
  int seen = 0;
  double whole = 0.0, largest = 0.0;
  const Eigen::Index rows = search.base.residual.size();
  constexpr auto parts = static_cast<Eigen::Index>(kPolicy.order_parts);
  for (Eigen::Index part = 0; part < parts; ++part) {
    double gain = 0.0;
    for (Eigen::Index k = rows * part / parts; k < rows * (part + 1) / parts; ++k) {
      const double weight = search.base.root_weights[k] * search.base.root_weights[k];
      gain += weight * (search.base.residual[k] * search.base.residual[k] -
                        candidate.fit.residual[k] * candidate.fit.residual[k]);
    }
    seen += gain > 0.0;
    whole += std::max(gain, 0.0);
    largest = std::max(largest, gain);
  }
  if (seen < kPolicy.order_parts_with_gain)
    return fmt::format("it shows in {} of {} parts of the data only", seen, parts);
  if (largest > kPolicy.most_in_one_part * whole)
    return fmt::format("{:.0f} % of what it explains is in one part of the data", 100.0 * largest / whole);
  return {};
}

}  // namespace

void check_orders(const std::vector<BalanceSearch*>& all, BalanceSearch& own_search,
                  std::vector<CandidateFit>& candidates) {
  std::map<const BalanceSearch*, estimation::ModelProjection> projections;
  const auto acting_balance = [&](BalanceSearch& search) {
    auto at = projections.find(&search);
    if (at == projections.end())
      at = projections
               .emplace(&search, estimation::ModelProjection(estimation::model_columns(*search.data, search.base.terms),
                                                             search.base.root_weights))
               .first;
    return ActingBalance{&search, &at->second, &search.base};
  };
  for (CandidateFit& t : candidates) {
    if (!t.model.order || !passes(t)) continue;
    std::vector<ActingBalance> acting = {acting_balance(own_search)};
    for (BalanceSearch* other : other_balances_of(all, own_search, t)) acting.push_back(acting_balance(*other));
    t.why_not = objection_to_order(acting, t);
    t.admissible = t.why_not.empty();
    if (t.admissible || !usual_and_best(candidates, t, kPolicy.confounded_margin)) continue;
    t.note = fmt::format(
        "These data are too short to identify its order: {:g} per turn is the usual order of such effects, and fits "
        "best of the whole orders; {} would show it.",
        *t.model.order, t.model.entry->info->separated_by);
    // Its own balance shows that the effect is there. Where another balance shows it, too, the usual order is taken.
    t.order_is_not_identifiable =
        t.other_balance_score <= kPolicy.confounded_margin || !usual_and_best(candidates, t, 0.0);
    if (t.order_is_not_identifiable) continue;
    t.admissible = true;
    t.why_not.clear();
  }
  sort_candidates(own_search, candidates);
}

std::string one_direction_warning(const RegressionProblem& data) {
  const Eigen::VectorXd directions = comparison::sample_directions(data);
  double forward = 0.0, backward = 0.0;
  for (const double d : directions) (d > 0.0 ? forward : backward) += std::isfinite(d) && d != 0.0 ? 1.0 : 0.0;
  const double rarer = std::min(forward, backward), all = forward + backward;
  if (all == 0.0 || rarer > kPolicy.one_way_share * all) return {};
  return fmt::format(
      "the axis moves {} in {:.1f} % of these data: dry friction, its difference between the directions and any offset "
      "are one constant here, and what differs by direction is not identifiable; record both directions",
      forward > backward ? "forward" : "backward", 100.0 * (all - rarer) / all);
}

}  // namespace flexspline::selection
