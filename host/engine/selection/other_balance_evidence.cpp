#include "host/engine/selection/other_balance_evidence.hpp"
#include "host/engine/selection/policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/evidence.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/model_projection.hpp"

namespace flexspline::selection {
namespace {

// The other balance's own terms with the values fitted there; all others with the candidate's values.
Terms as_seen_by(const BalanceSearch& other, const CandidateFit& candidate) {
  Terms terms = candidate.fit.terms;
  for (estimation::Term& term : terms) {
    if (term.entry->identified_on() != other.data->balance()) continue;
    const auto there = std::find_if(other.base.terms.begin(), other.base.terms.end(),
                                    [&](const estimation::Term& t) { return t.id == term.id; });
    if (there != other.base.terms.end()) term = *there;
  }
  return terms;
}

// Free parameters of the added effect that its balance determines, with their values and their places in the
// covariance.
struct Identified {
  std::vector<std::size_t> parameters;
  std::vector<Eigen::Index> at;
};
Identified identified_of(const BalanceSearch& own, CandidateFit& candidate) {
  Identified identified;
  CrossValidatedFit& fit = candidate.fit;
  const std::size_t added = fit.terms.size() - 1;
  const auto on_balance = estimation::terms_on(fit.terms, own.data->balance(), own.data->prepared().output_signals);
  std::vector<ParameterRef> refs = fit.linear;
  const std::vector<ParameterRef> nonlinear = estimation::free_nonlinear_parameters(fit.terms, on_balance);
  refs.insert(refs.end(), nonlinear.begin(), nonlinear.end());
  for (std::size_t j = 0; j < refs.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (refs[j].term != added || !std::isfinite(fit.covariance(at, at))) continue;
    identified.parameters.push_back(refs[j].parameter);
    identified.at.push_back(at);
    // Nonlinear parameters have the values at which they were searched; the fit moved them from there.
    if (j >= fit.linear.size()) {
      fit.terms[added].values[refs[j].parameter] += fit.theta[at];
      fit.theta[at] = 0.0;
    }
  }
  return identified;
}

// A parameter beyond its bounds, in words; empty where all are within them.
std::string impossible_value(const estimation::Term& term) {
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    const effects::ParameterInfo& info = term.entry->parameters[p];
    if (info.limit != effects::Limit::stated || !info.per.empty() || !info.root_of.empty()) continue;
    if (term.values[p] < info.low || term.values[p] > info.high)
      return fmt::format("its {} would be {:.3g} where both balances agree, which is not possible", info.name,
                         term.values[p]);
  }
  return {};
}

// Whether the effect scales the measured torque, the left side of this balance. It then changes all parameters by one
// factor, which is no evidence unless one of them is known.
bool only_scales(const BalanceSearch& other, const catalogue::Entry& entry) {
  constexpr unsigned kScale = effects::kTorqueScale | effects::kTorque;
  if ((entry.info->reads & kScale) != kScale) return false;
  Terms own;
  for (const estimation::Term& t : other.base.terms)
    if (t.entry->identified_on() == other.data->balance()) own.push_back(t);
  return !states_a_torque(own);
}

// Twice the log of the Jacobian of a left side from which the added effect takes a share of itself: else a smaller left
// side would count as a smaller error.
double jacobian_of(const RegressionProblem& data, const Terms& terms, std::size_t added, double rows, double tau) {
  constexpr unsigned kScale = effects::kTorqueScale | effects::kTorque;
  if ((terms[added].entry->info->reads & kScale) != kScale) return 0.0;
  const Eigen::VectorXd& target = data.target();
  const double share = data.term_torque(terms, added).dot(target) / std::max(target.squaredNorm(), 1e-300);
  return 2.0 * rows / tau * std::log(std::max(std::abs(1.0 - share), 1e-300));
}

// Combines both balances' estimates of the added effect's parameters. Returns the score there, less the cost of the
// change on its own balance.
double score_on(BalanceSearch& other, CandidateFit& candidate, const Identified& identified) {
  if (only_scales(other, *candidate.model.entry)) return 0.0;
  const RegressionProblem& data = *other.data;
  Terms terms = as_seen_by(other, candidate);
  const std::size_t added = terms.size() - 1;
  const double tau = std::max(1.0, other.base.autocorrelation_time);
  const Eigen::VectorXd residual = other.base.residual - data.term_torque(terms, added);
  const estimation::ScoreAndInformation evidence = estimation::score_and_information(
      estimation::cross_balance_columns(data, terms, added, identified.parameters),
      estimation::model_columns(data, other.base.terms), residual, other.base.root_weights, tau);
  const estimation::CombinedEstimate both =
      estimation::combine(estimation::scaled_inverse(candidate.fit.covariance(identified.at, identified.at)), evidence);
  if (!both.change.allFinite()) return 0.0;
  for (std::size_t k = 0; k < identified.parameters.size(); ++k)
    terms[added].values[identified.parameters[k]] += both.change[static_cast<Eigen::Index>(k)];
  candidate.fit.terms.back().values = terms[added].values;
  if (std::string why = impossible_value(terms[added]); !why.empty()) {
    candidate.admissible = false;
    candidate.why_not = std::move(why);
  }
  // No parameter is free there, so there is no penalty.
  const CrossValidatedFit fit = cross_validate(data, terms, other.keep);
  candidate.at_floor_on_others = candidate.at_floor_on_others && other.at_floor(fit);
  const LikelihoodGain gain = likelihood_gain(other.base, fit, 0.0);
  candidate.other_balance_percent = std::max(candidate.other_balance_percent, gain.chi2_percent);
  return gain.score + jacobian_of(data, terms, added, other.keep.sum(), tau) - both.cost;
}

bool acts_on(const catalogue::Entry& entry, const BalanceSearch& own, const BalanceSearch& other) {
  return &other != &own && entry.adds_to(other.data->balance());
}

}  // namespace

std::vector<BalanceSearch*> other_balances_of(const std::vector<BalanceSearch*>& all, const BalanceSearch& own,
                                              const CandidateFit& candidate) {
  std::vector<BalanceSearch*> others;
  if (!own.data->prepared().output_signals.torque) return others;  // the motor's balance is the only one
  for (BalanceSearch* other : all)
    if (acts_on(*candidate.model.entry, own, *other)) others.push_back(other);
  return others;
}

void add_other_balance_evidence(const std::vector<BalanceSearch*>& all, BalanceSearch& own,
                                std::vector<CandidateFit>& candidates) {
  // Also parameters that their own balance hardly shows: an offset of the sensor is small for the spring, and large for
  // a free load.
  std::vector<CandidateFit*> acting;
  for (CandidateFit& candidate : candidates)
    if (candidate.admissible && !other_balances_of(all, own, candidate).empty()) acting.push_back(&candidate);
  if (acting.empty()) return;
  estimation::in_parallel(acting.size(), [&](std::size_t i) {
    CandidateFit& candidate = *acting[i];
    const Identified identified = identified_of(own, candidate);
    if (identified.parameters.empty()) return;
    for (BalanceSearch* other : other_balances_of(all, own, candidate))
      candidate.other_balance_score += score_on(*other, candidate, identified);
    if (candidate.gain.score <= kPolicy.named_score || candidate.score() > kPolicy.named_score) return;
    candidate.admissible = false;
    candidate.why_not = "it acts on another torque balance as well, and that one fits worse with it";
  });
  sort_candidates(own, candidates);
}

bool is_confused_with(const CandidateModel& candidate, const catalogue::Entry& named, std::optional<double> order) {
  return candidate.order == order && (catalogue::names_contain(candidate.entry->info->confused_with, named.name()) ||
                                      catalogue::names_contain(named.info->confused_with, candidate.entry->name()));
}

bool discount_evidence(const std::vector<SearchedBalance>& all, SearchedBalance& own) {
  bool any = false;
  for (CandidateFit& candidate : own.candidates) {
    // A wave has a phase, too, which an effect of the other balance would not have by chance.
    if (candidate.model.order || candidate.other_balance_score <= kPolicy.named_score) continue;
    double similar = 0.0;
    for (const SearchedBalance& other : all)
      if (acts_on(*candidate.model.entry, own.search, other.search))
        for (const CandidateFit& t : other.candidates)
          if (passes(t) && is_confused_with(candidate.model, *t.model.entry, t.model.order))
            similar = std::max(similar, t.gain.score);
    if (similar <= candidate.other_balance_score + kPolicy.confounded_margin) continue;
    candidate.other_balance_score = 0.0;
    any = true;
  }
  if (any) sort_candidates(own.search, own.candidates);
  return any;
}

}  // namespace flexspline::selection
