#include "host/engine/planning/hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::planning {
namespace {

using effects::Kind;
using estimation::Balance;
using estimation::Term;

constexpr std::size_t kGridPoints = 7;

RehearsedMotions::BalanceData* side_of(RehearsedMotions& rehearsed, Balance balance) {
  for (RehearsedMotions::BalanceData& side : rehearsed.balances())
    if (side.planned->balance() == balance) return &side;
  return nullptr;
}

std::vector<double> usual_values(const Term& term) {
  std::vector<double> usual;
  for (const auto& info : term.entry->parameters) usual.push_back(info.usual);
  usual = catalogue::reduced(*term.entry, usual);
  for (std::size_t p = 0; p < usual.size(); ++p)
    if (term.known[p]) usual[p] = term.values[p];
  return usual;
}

// Nonlinear parameters that are searched on a grid; the others are moved along their slope.
std::vector<std::size_t> grid_parameters(const Term& term) {
  std::vector<std::size_t> list;
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.free_nonlinear(p) && !(term.entry->parameters[p].low < 0.0 && term.entry->parameters[p].per.empty()))
      list.push_back(p);
  return list;
}

// The added term's values over its grid: one nonlinear parameter over its range, the others as usual; then a second
// likewise.
std::vector<std::vector<double>> grid_of(const RegressionProblem& data, const Term& term) {
  const std::vector<double> usual = usual_values(term);
  std::vector<std::vector<double>> grid{usual};
  for (const std::size_t p : grid_parameters(term)) {
    const estimation::ParameterRange range = estimation::parameter_range(data, term, p);
    for (const double value : estimation::parameter_grid(range, kGridPoints)) {
      grid.push_back(usual);
      grid.back()[p] = value;
    }
  }
  return grid;
}

bool possible(const Term& term) {
  const auto& parameters = term.entry->parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    if (term.free_linear(p) && (term.values[p] < parameters[p].low || term.values[p] > parameters[p].high))
      return false;
  return true;
}

// A model fitted to what was recorded; nonlinear parameters of either sign follow their slopes.
selection::CrossValidatedFit fitted(const RegressionProblem& data, Terms terms) {
  const Eigen::VectorXd all = Eigen::VectorXd::Ones(data.rows());
  selection::CrossValidatedFit fit = selection::cross_validate(data, std::move(terms), all);
  for (int step = 0; step < 2; ++step) {
    Term& added = fit.terms.back();
    const auto on_balance = estimation::terms_on(fit.terms, data.balance(), data.prepared().output_signals);
    const auto nonlinear = estimation::free_nonlinear_parameters(fit.terms, on_balance);
    bool moved = false;
    for (std::size_t i = 0; i < nonlinear.size(); ++i) {
      const auto& info = added.entry->parameters[nonlinear[i].parameter];
      if (nonlinear[i].term + 1 != fit.terms.size() || !(info.low < 0.0 && info.per.empty())) continue;
      double& value = added.values[nonlinear[i].parameter];
      value = std::clamp(value + fit.theta[static_cast<Eigen::Index>(fit.linear.size() + i)], info.low, info.high);
      moved = true;
    }
    if (!moved) break;
    fit = selection::cross_validate(data, fit.terms, all);
  }
  return fit;
}

// Share of an effect's usual size that could be present without a significant effect on these data.
double unseen_share(const RegressionProblem& data, const Terms& base, const Terms& usual,
                    const estimation::ModelProjection& projection, double noise) {
  // Fits its own parameters alone; the others keep the values of the base.
  Terms terms = usual;
  for (Term& t : terms)
    for (const Term& b : base)
      if (t.label() == b.label()) t.values = b.values;
  const Eigen::VectorXd torque = estimation::model_torque(data, terms) - estimation::model_torque(data, base);
  const double squares = projection.orthogonal_part(torque).col(0).squaredNorm() / noise;
  return squares > selection::kPolicy.named_score ? std::sqrt(selection::kPolicy.named_score / squares) : 1.0;
}

}  // namespace

Terms without(const Terms& terms, std::string_view effect) {
  const selection::EffectName name = selection::parse_effect(effect);
  const std::string label = estimation::candidate_term(*name.entry, name.order).label();
  Terms left;
  for (const Term& t : terms)
    if (t.label() != label) left.push_back(t);
  return left;
}

EffectHypothesis effect_hypothesis(RehearsedMotions& rehearsed, ColumnLayout& layout, const Terms& model,
                                   std::string_view effect) {
  const selection::EffectName name = selection::parse_effect(effect);
  EffectHypothesis c;
  c.label = std::string(effect);
  Terms base = selection::extend(model, *name.entry, name.order);
  RehearsedMotions::BalanceData* side = side_of(rehearsed, name.entry->identified_on());
  if (!side) side = side_of(rehearsed, Balance::motor);
  if (side) estimation::set_grid_values(*side->planned, base, {base.size() - 1});

  Terms truth = base;
  truth.back().values = usual_values(truth.back());
  for (const Term& t : rehearsed.terms())
    if (t.label() == truth.back().label()) truth.back().values = t.values;
  std::vector<Terms> variants;
  const std::vector<std::vector<double>> grid =
      side ? grid_of(*side->planned, base.back()) : std::vector<std::vector<double>>{truth.back().values};
  double least = 1e300, unseen = 1.0;
  for (const std::vector<double>& values : grid) {
    Terms terms = base;
    terms.back().values = values;
    if (!side || !side->recorded) {
      variants.push_back(terms);
      continue;
    }
    const selection::CrossValidatedFit fit = fitted(*side->recorded, terms);
    if (const double rmse = fit.rmse(); rmse < least) {
      least = rmse;
      const Eigen::VectorXd torque =
          estimation::model_torque(*side->recorded, fit.terms) - estimation::model_torque(*side->recorded, model);
      const estimation::ModelProjection projection(estimation::model_columns(*side->recorded, model),
                                                   Eigen::VectorXd::Ones(side->recorded->rows()));
      const double noise = rmse * rmse * fit.autocorrelation_time;
      side->noise = std::min(side->noise, noise);
      c.seen = possible(fit.terms.back()) &&
               projection.orthogonal_part(torque).col(0).squaredNorm() / noise > selection::kPolicy.named_score;
      if (c.seen) truth = fit.terms;
      unseen = c.seen ? 1.0 : unseen_share(*side->recorded, model, truth, projection, noise);
    }
    variants.push_back(fit.terms);
  }
  // An effect that the data do not show is at most as large as their detection limit.
  if (!c.seen)
    for (std::size_t p = 0; p < truth.back().values.size(); ++p)
      if (truth.back().free_linear(p)) truth.back().values[p] *= unseen;
  c.truth = layout.add(std::move(truth));
  for (Terms& terms : variants) c.variants.push_back(layout.add(std::move(terms)));
  return c;
}

}  // namespace flexspline::planning
