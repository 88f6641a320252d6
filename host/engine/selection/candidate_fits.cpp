#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/policy.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::selection {
namespace {

using estimation::Term;

// Relative change of the squares that ends the search: well below one by score.
constexpr double kSameSquares = 1e-5;
constexpr std::size_t kFineGridPoints = 24;
constexpr std::size_t kRefined = 4;  // candidates whose nonlinear parameters are searched continuously

// Chooses the nonlinear parameters of the added effect on a grid. `coarse` has the same samples, from decimated
// signals.
void choose_nonlinear(const BalanceSearch& search, const RegressionProblem& coarse, CandidateModel& model) {
  Term& added = model.terms.back();
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_nonlinear(p) || begins_at_zero(added, p)) continue;
    double best = added.values[p], least = std::numeric_limits<double>::infinity();
    // An effect without a linear parameter fits in a narrow range only, so its grid is finer.
    const std::size_t points = added.entry->count(effects::Kind::linear) == 0 ? kFineGridPoints : kGridPoints;
    for (const double value : estimation::parameter_grid(estimation::parameter_range(*search.data, added, p), points)) {
      added.values[p] = value;
      const double squares = whitened_squares(coarse, model.terms, search.base);
      if (squares < least) {
        least = squares;
        best = value;
      }
    }
    added.values[p] = best;
  }
}

// The effect of the model whose column is most similar to that of the added one.
std::string most_collinear_effect(const RegressionProblem& data, const CrossValidatedFit& fit, std::size_t added) {
  std::string best = "the model";
  double most = 0.0;
  for (const ParameterRef& own : fit.linear) {
    if (own.term != added) continue;
    const Eigen::VectorXd column = data.column(fit.terms, own);
    for (const ParameterRef& other : fit.linear) {
      if (other.term == added) continue;
      const Eigen::VectorXd& theirs = data.column(fit.terms, other);
      const double norm = column.norm() * theirs.norm();
      const double similar = norm > 0.0 ? std::abs(column.dot(theirs)) / norm : 0.0;
      if (similar > most) {
        most = similar;
        best = fit.terms[other.term].id;
      }
    }
  }
  return best;
}

bool scales_torques(const Terms& terms) {
  return std::any_of(terms.begin(), terms.end(),
                     [](const Term& t) { return (t.entry->info->reads & effects::kTorqueScale) != 0; });
}

// A nonlinear parameter of the added effect that stops at an end of what the data can show: the error still falls
// beyond it, so it is another law. (The shortest travel or torsion that can be shown stands for any below it.) Empty:
// there is none.
std::string why_no_minimum(const RegressionProblem& data, const Term& added) {
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_nonlinear(p) || begins_at_zero(added, p)) continue;
    const effects::ParameterInfo& info = added.entry->parameters[p];
    const double share = estimation::parameter_range(data, added, p).share(added.values[p]);
    if (share <= 1.0 - estimation::kAtTheEnd && (share >= estimation::kAtTheEnd || estimation::is_length(info)))
      continue;
    return fmt::format("its {} stops at the end of what these data can show ({:.4g})", info.name, added.values[p]);
  }
  return {};
}

// A candidate that needs an impossible value, or that makes the base model impossible, is a fit, not an explanation.
void check_admissible(const RegressionProblem& data, const CrossValidatedFit& base, CandidateFit& candidate) {
  const auto& fit = candidate.fit;
  const auto refuse = [&](std::string why) {
    if (candidate.admissible) candidate.why_not = std::move(why);
    candidate.admissible = false;
  };
  const std::size_t added = fit.terms.size() - 1;
  bool any_own = fit.terms[added].entry->count(effects::Kind::linear) == 0;
  for (std::size_t j = 0; j < fit.linear.size(); ++j) {
    const Term& t = fit.terms[fit.linear[j].term];
    const auto& info = t.entry->parameters[fit.linear[j].parameter];
    const double value = fit.theta[static_cast<Eigen::Index>(j)];
    if (fit.linear[j].term == added) {
      any_own = any_own || fit.root_tolerance[static_cast<Eigen::Index>(j)] > kPolicy.least_orthogonal_share;
      if (value < info.low || value > info.high)
        refuse(fmt::format(
            "its {} would be {:.3g} {}, which is not possible", info.name, value,
            catalogue::unit_on(info.unit, data.prepared().rotary ? data::Axis::rotary : data::Axis::linear)));
      continue;
    }
    // Friction, inertia and stiffness have a sign; offsets and asymmetries may have any. What the candidate can explain
    // itself may move to it.
    if (info.low != 0.0) continue;
    if (catalogue::names_contain(fit.terms[added].entry->info->contains, t.entry->name())) continue;
    const auto before = position(base, t.id, info.name);
    if (!before) continue;
    const double was = base.theta[static_cast<Eigen::Index>(*before)];
    if (was <= kPolicy.known_base_errors * base.std[static_cast<Eigen::Index>(*before)]) continue;
    // The coefficient depends on the exponent, so torques are compared, not coefficients.
    const std::size_t old = base.linear[*before].term;
    const Eigen::VectorXd torque = data.term_torque(base.terms, old);
    // An effect that is hardly larger than the missing torque is not known well enough to refuse a candidate.
    if (torque.norm() < kPolicy.known_base_over_missing * base.residual.norm()) continue;
    // Where almost nothing is left the base model was useless, unless all torques decreased together.
    if (candidate.gain.chi2_percent > kPolicy.all_explained_percent && !scales_torques(fit.terms)) continue;
    // Relative to the larger one: without the missing effect an estimate may be half or twice the true value.
    const Eigen::VectorXd now = data.term_torque(fit.terms, fit.linear[j].term);
    const double change = (now - torque).norm() / std::max(torque.norm(), now.norm());
    if (change > kPolicy.most_base_change)
      refuse(fmt::format("{} would change by {:.0f} % (its {} from {:.3g} to {:.3g})", t.id,
                         100.0 * (now - torque).norm() / torque.norm(), info.name, was, value));
  }
  if (const std::string why = why_no_minimum(data, fit.terms.back()); !why.empty()) refuse(why);
  if (!any_own) {
    candidate.confounded_with = most_collinear_effect(data, fit, added);
    refuse(fmt::format("it is confounded with {} in these data", candidate.confounded_with));
  }
}

// Moves nonlinear parameters that begin at zero to their fitted values; the model is almost linear in them there.
void take_first_step(const RegressionProblem& data, CrossValidatedFit& fit) {
  const auto on_balance = estimation::terms_on(fit.terms, data.balance(), data.prepared().output_signals);
  const std::vector<ParameterRef> nonlinear = estimation::free_nonlinear_parameters(fit.terms, on_balance);
  for (std::size_t k = 0; k < nonlinear.size(); ++k) {
    Term& added = fit.terms.back();
    double& step = fit.theta[static_cast<Eigen::Index>(fit.linear.size() + k)];
    if (&fit.terms[nonlinear[k].term] != &added || !begins_at_zero(added, nonlinear[k].parameter)) continue;
    added.values[nonlinear[k].parameter] += step;
    step = 0.0;
  }
}

CandidateFit evaluate(const BalanceSearch& search, CandidateModel model) {
  CandidateFit candidate;
  candidate.fit = cross_validate(*search.data, model.terms, search.keep);
  take_first_step(*search.data, candidate.fit);
  candidate.gain = likelihood_gain(search.base, candidate.fit, model.added);
  candidate.model = std::move(model);
  check_admissible(*search.data, search.base, candidate);
  return candidate;
}

bool better(const CandidateFit& a, const CandidateFit& b);

// Where the best value of a nonlinear parameter makes the model impossible, returns the best admissible value of the
// grid; `refused` where there is none.
CandidateFit best_admissible(const BalanceSearch& search, CandidateModel model, CandidateFit refused) {
  Term& added = model.terms.back();
  if (refused.gain.score < kPolicy.named_score) return refused;
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_nonlinear(p) || begins_at_zero(added, p)) continue;
    const double chosen = added.values[p];
    for (const double value :
         estimation::parameter_grid(estimation::parameter_range(*search.data, added, p), kGridPoints)) {
      if (value == chosen) continue;
      added.values[p] = value;
      CandidateFit candidate = evaluate(search, model);
      if (better(candidate, refused)) refused = std::move(candidate);
    }
    added.values[p] = chosen;
  }
  return refused;
}

// Residual and span of the base model, for the choice of orders.
Unexplained left_by(const RegressionProblem& data, const CrossValidatedFit& base) {
  Unexplained left;
  left.root_weights = base.root_weights;
  left.residual = base.root_weights.cwiseProduct(base.residual);
  if (base.linear.empty()) return left;
  const Eigen::MatrixXd X = base.root_weights.asDiagonal() * data.columns(base.terms, base.linear);
  left.own = algebra::PivotedQr(X).span();
  return left;
}

bool better(const CandidateFit& a, const CandidateFit& b) {
  if (a.admissible != b.admissible) return a.admissible;
  return a.score() > b.score();
}

// Of two fits of one effect. Its score is over the autocorrelation time of what it leaves, which may be longer where it
// leaves less.
bool fits_better(const CandidateFit& a, const CandidateFit& b) {
  return a.admissible != b.admissible ? a.admissible : a.gain.chi2_percent > b.gain.chi2_percent;
}

}  // namespace

std::optional<std::size_t> position(const CrossValidatedFit& fit, std::string_view id, std::string_view parameter) {
  for (std::size_t j = 0; j < fit.linear.size(); ++j) {
    const Term& t = fit.terms[fit.linear[j].term];
    if (t.id == id && t.entry->parameters[fit.linear[j].parameter].name == parameter) return j;
  }
  return std::nullopt;
}

namespace {

// Percent of the left-out chi-square. An effect that differs between records only (temperature) reduces the random
// effects and hardly the residual.
double explained_percent(const CandidateFit& t) {
  return std::max({t.gain.chi2_percent, t.gain.fixed_effects_percent, t.other_balance_percent});
}

}  // namespace

bool is_same_function(const CandidateFit& a, const CandidateFit& b) {
  constexpr double kRounding = 1e-6;  // relative
  const auto are_equal = [](double x, double y) { return std::abs(x - y) <= kRounding * std::abs(x); };
  return a.gain.chi2_percent != 0.0 && are_equal(a.gain.score, b.gain.score) &&
         are_equal(a.gain.chi2_percent, b.gain.chi2_percent);
}

bool passes(const CandidateFit& t) {
  return t.admissible && t.score() > kPolicy.named_score && explained_percent(t) > kPolicy.named_chi2_percent;
}

bool explains_a_part(const CandidateFit& candidate) {
  return candidate.gain.score > kPolicy.named_score && candidate.gain.chi2_percent >= 100.0 * kPolicy.line_share;
}

bool is_worth_a_term(const BalanceSearch& search, const CandidateFit& candidate) {
  const double noise = search.floor.value_or(0.0) / std::max(search.base.rmse_cv_fixed_effects(), 1e-300);
  return passes(candidate) &&
         explained_percent(candidate) >= 100.0 * kPolicy.line_share * std::max(0.0, 1.0 - noise * noise);
}

void check_worth(const BalanceSearch& search, std::vector<CandidateFit>& candidates) {
  while (!candidates.empty() && passes(candidates.front()) && !is_worth_a_term(search, candidates.front())) {
    CandidateFit& first = candidates.front();
    first.admissible = false;
    first.why_not = fmt::format("it reduces the squared error by only {:.1f} %", explained_percent(first));
    sort_candidates(search, candidates);
  }
}

// Whether the law is nonlinear over a travel that the encoder resolves in few steps: the residual there is the
// encoder's.
bool is_below_resolution(const RegressionProblem& data, const CandidateFit& candidate) {
  const Term& added = candidate.fit.terms.back();
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_nonlinear(p) || added.entry->parameters[p].limit != effects::Limit::travel) continue;
    for (const RowRange& range : data.records()) {
      const std::optional<double>& quantum = data.prepared().records[range.record].motor_quantum;
      if (quantum && added.values[p] < kPolicy.least_travel_quanta * *quantum) return true;
    }
  }
  return false;
}

// A law that contains another one fits at least as well. So among the best law and those confused with it that leave
// almost the same error, the one with the fewest parameters comes first.
void prefer_simple(const BalanceSearch& search, std::vector<CandidateFit>& candidates) {
  const CrossValidatedFit& base = search.base;
  for (CandidateFit& candidate : candidates) candidate.leads = false;
  if (candidates.empty() || !passes(candidates.front())) return;
  const CandidateFit& best = candidates.front();
  // Left-out squares over each record's noise variance, as the best candidate leaves it: a noisy record must not decide
  // alone.
  const std::vector<LeftOut> noise = best.fit.left_out;
  const auto chi2 = [&](const CrossValidatedFit& fit) {
    double sum = 0.0;
    for (std::size_t i = 0; i < noise.size(); ++i)
      sum += fit.left_out[i].squares * noise[i].rows / std::max(noise[i].squares, 1e-300);
    return sum;
  };
  const double least = chi2(best.fit), decrease = chi2(base) - least;
  std::size_t simplest = 0;
  bool distinguished = true;
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const CandidateFit& other = candidates[i];
    // A law with dozens of parameters counts as confused with every other.
    const bool dozens = best.model.added >= other.model.added + kPolicy.many_parameters;
    const bool is_confused =
        dozens || catalogue::names_contain(best.model.entry->info->confused_with, other.model.entry->name()) ||
        catalogue::names_contain(other.model.entry->info->confused_with, best.model.entry->name());
    if (!is_confused || !passes(other) || other.model.added >= candidates[simplest].model.added) continue;
    const double left = chi2(other.fit);
    const auto within = [&](const SelectionPolicy::Same& same) {
      return left <= same.left * least && left - least <= same.share_of_missing * decrease;
    };
    const bool same = within(is_below_resolution(*search.data, other) ? kPolicy.same_below_resolution : kPolicy.same) ||
                      (dozens && within(kPolicy.hardly_more)) ||
                      (left <= kPolicy.hardly_more.left * least &&
                       standard_errors_over(other.fit.left_out, best.fit.left_out) < kPolicy.simpler_standard_errors);
    if (!same && !(best.score() - other.score() <= kPolicy.confounded_margin && within(kPolicy.hardly_more))) continue;
    simplest = i;
    distinguished = same;
  }
  candidates.front().leads = !distinguished;
  std::rotate(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(simplest),
              candidates.begin() + static_cast<std::ptrdiff_t>(simplest) + 1);
}

CandidateFit refined(const BalanceSearch& search, const CandidateFit& candidate, const RegressionProblem* coarse) {
  const RegressionProblem& data = *search.data;
  CandidateModel model = candidate.model;
  model.terms = candidate.fit.terms;
  const auto on_balance = estimation::terms_on(model.terms, data.balance(), data.prepared().output_signals);
  estimation::refine_nonlinear(data, model.terms, on_balance, noise_covariance(data, candidate.fit), kSameSquares,
                               coarse);
  return evaluate(search, std::move(model));
}

std::vector<CandidateFit> rank_candidates(const BalanceSearch& search,
                                          const std::function<bool(const CandidateModel&)>& is_tried) {
  std::vector<CandidateModel> tried =
      candidate_models(*search.data, search.base.terms, left_by(*search.data, search.base));
  if (is_tried) std::erase_if(tried, [&](const CandidateModel& model) { return !is_tried(model); });
  std::vector<CandidateFit> candidates(tried.size());
  const RegressionProblem coarse = search.data->decimated();
  estimation::in_parallel(tried.size(), [&](std::size_t i) {
    CandidateModel& model = tried[i];
    choose_nonlinear(search, coarse, model);
    candidates[i] = evaluate(search, model);
    if (!candidates[i].admissible) candidates[i] = best_admissible(search, std::move(model), std::move(candidates[i]));
  });
  // By score alone: a grid value near the best one may make the model impossible although the best one does not.
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const CandidateFit& a, const CandidateFit& b) { return a.gain.score > b.gain.score; });
  std::vector<CandidateFit*> to_refine;
  for (CandidateFit& candidate : candidates) {
    const Term& added = candidate.model.terms.back();
    bool has_nonlinear = false;
    for (std::size_t p = 0; p < added.values.size(); ++p) has_nonlinear = has_nonlinear || added.free_nonlinear(p);
    if (has_nonlinear && candidate.gain.score >= kPolicy.named_score && to_refine.size() < kRefined)
      to_refine.push_back(&candidate);
  }
  estimation::in_parallel(to_refine.size(), [&](std::size_t i) {
    CandidateFit& candidate = *to_refine[i];
    CandidateFit again = refined(search, candidate, &coarse);
    // A value of the grid near an end of the range, where the best one stops, is no minimum either.
    const bool stops =
        !why_no_minimum(*search.data, again.fit.terms.back()).empty() && again.score() > candidate.score();
    if (fits_better(again, candidate) || !candidate.admissible || stops) candidate = std::move(again);
  });
  sort_candidates(search, candidates);
  return candidates;
}

// Samples that count differ with the autocorrelation of what a candidate leaves, so that scores of candidates that
// leave unlike structure are not comparable. Where the best one leaves a multiple of the squares that another leaves
// with no more parameters, the other comes first.
void prefer_smaller_error(std::vector<CandidateFit>& candidates) {
  if (candidates.empty() || !passes(candidates.front())) return;
  std::size_t smallest = 0;
  const auto squares = [&](std::size_t i) { return std::pow(candidates[i].fit.rmse_cv_fixed_effects(), 2); };
  for (std::size_t i = 1; i < candidates.size(); ++i)
    if (passes(candidates[i]) && candidates[i].model.added <= candidates.front().model.added &&
        kPolicy.similar_left * squares(i) < squares(0) && squares(i) < squares(smallest))
      smallest = i;
  const auto at = candidates.begin() + static_cast<std::ptrdiff_t>(smallest);
  std::rotate(candidates.begin(), at, at + 1);
}

void sort_candidates(const BalanceSearch& search, std::vector<CandidateFit>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(), better);
  prefer_smaller_error(candidates);
  prefer_simple(search, candidates);
}

bool is_negative(const CandidateFit& candidate) {
  const Term& term = candidate.fit.terms.back();
  if (term.entry->info->negative_means.empty()) return false;
  bool any = false;
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    // Data of one direction leave the amplitude of the other one at zero, known.
    if (term.entry->parameters[p].kind != effects::Kind::linear || term.known[p]) continue;
    if (!(term.values[p] < 0.0)) return false;
    any = true;
  }
  return any;
}

bool is_another_law(const CandidateFit& candidate, const RegressionProblem& data) {
  if (candidate.model.entry->info->wide_negative_is.empty() || !is_negative(candidate)) return false;
  const Term& term = candidate.fit.terms.back();
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    if (term.entry->parameters[p].limit != effects::Limit::velocity) continue;
    // The range ends at a quarter of the fast motion; a law is wide from a tenth of it on.
    return term.values[p] > kPolicy.wide_share_of_range * estimation::parameter_range(data, term, p).high;
  }
  return false;
}

std::optional<CandidateFit> backward_elimination(const BalanceSearch& search,
                                                 const std::vector<CandidateFit>& candidates) {
  const CandidateFit& first = candidates.front();
  BalanceSearch next{search.data, search.keep, first.fit};
  std::vector<CandidateFit> more = rank_candidates(next, [&](const CandidateModel& model) {
    return std::ranges::none_of(candidates, [&](const CandidateFit& alone) {
      return alone.model.entry == model.entry && alone.model.order == model.order &&
             alone.gain.chi2_percent < kPolicy.least_alone_share * first.gain.chi2_percent;
    });
  });
  if (more.empty() || !passes(more.front())) return std::nullopt;
  const CandidateFit& second = more.front();
  // Only an effect that may be added to the base model alone can replace the first one.
  CandidateModel alone;
  try {
    alone.terms = extend(search.base.terms, *second.model.entry, second.model.order);
  } catch (const model::ModelError&) {
    return std::nullopt;
  }
  alone.entry = second.model.entry;
  alone.order = second.model.order;
  alone.added = second.model.added;
  alone.terms.back().values = second.fit.terms.back().values;
  CandidateFit instead = evaluate(search, std::move(alone));
  const LikelihoodGain lost = likelihood_gain(instead.fit, second.fit, first.model.added);
  if (passes(instead) && lost.score < kPolicy.named_score) return instead;
  return std::nullopt;
}

}  // namespace flexspline::selection
