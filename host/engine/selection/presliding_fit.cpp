#include "host/engine/selection/presliding_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/common/numbers/quantile.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/described_candidates.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/wald_test.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;
using estimation::Term;

bool is_presliding(const NamedEffect& name) {
  return catalogue::get(name.effect).is_presliding();
}

// The model with the other names in it, at the values of their own candidates. A law of friction with a sign would
// compete with presliding for its place.
Terms with_others(Terms terms, const SearchedBalance& motor, const std::vector<NamedEffect>& names) {
  for (const NamedEffect& name : names) {
    const CandidateFit* other = candidate_named(motor, name);
    if (!other || is_presliding(name) || (other->model.entry->info->reads & effects::kDirection) != 0) continue;
    terms.push_back(other->fit.terms.back());
  }
  return terms;
}

// Travel of the motor between two samples at reversals, median, rad: what is shorter is not seen. Zero without
// reversals.
double travel_between_samples(const RegressionProblem& data) {
  std::vector<double> travels;
  for (const estimation::RowRange& range : data.records()) {
    const estimation::Record& r = data.prepared().records[range.record];
    if (r.at_rest || !r.has_motor_motion) continue;
    for (const data::Segment& s : r.segments)
      for (std::size_t k = s.first + 1; k + 1 < s.last; ++k)
        if (r.inputs.velocity_at(k) * r.inputs.velocity_at(k - 1) < 0.0)
          travels.push_back(std::abs(r.inputs.angle_at(k + 1) - r.inputs.angle_at(k)));
  }
  return travels.empty() ? 0.0 : numbers::upper_median(std::move(travels));
}

bool is_travel(const Term& term, std::size_t p) {
  return term.entry->parameters[p].limit == effects::Limit::travel;
}

// A travel is known no better than that between two samples.
void count_sampling(const RegressionProblem& data, Candidate& candidate) {
  const double unseen = travel_between_samples(data);
  for (Estimate& e : candidate.parameters) {
    const effects::ParameterInfo& info = catalogue::get(candidate.effect).parameters[e.ref.parameter];
    if (info.limit == effects::Limit::travel && e.std) set_std(e, std::hypot(*e.std, unseen), info);
  }
}

// The values of the grid are the best ones for a model that is linear around them. With the reversals in the data
// friction has no travel in the base model, which is wrong there, so that a change of it refuses no value.
CandidateFit searched(const BalanceSearch& search, CandidateFit law) {
  constexpr int kRounds = 3;  // the noise is of what the law leaves, so it changes with its values
  constexpr double kSame = 0.01;
  for (int round = 0; round < kRounds; ++round) {
    CandidateFit again = refined(search, law, nullptr);
    double change = 0.0;
    const Term &now = again.fit.terms.back(), &before = law.fit.terms.back();
    for (std::size_t p = 0; p < now.values.size(); ++p)
      if (is_travel(now, p)) change = std::max(change, std::abs(now.values[p] / before.values[p] - 1.0));
    law = std::move(again);
    if (change < kSame) break;
  }
  return law;
}

// By how many standard errors of the parts left out the error is larger with a travel that is hardly there: that
// between two samples, or a thirtieth of the travel found where that is longer.
double errors_without_travel(const BalanceSearch& search, const CandidateFit& law) {
  constexpr double kHardlyThere = 1.0 / 30.0;
  Terms terms = law.fit.terms;
  Term& friction = terms.back();
  const double unseen = travel_between_samples(*search.data);
  for (std::size_t p = 0; p < friction.values.size(); ++p)
    if (is_travel(friction, p)) {
      friction.values[p] = std::max(kHardlyThere * friction.values[p], unseen);
      friction.known[p] = 1;
    }
  return standard_errors_over(cross_validate(*search.data, terms, search.keep).left_out, law.fit.left_out);
}

// What all samples, those around reversals among them, say against a law of presliding; empty: nothing.
std::string doubt_about(const BalanceSearch& search, const CandidateFit& law, double without_reversals) {
  const double before = search.base.rmse_cv(), after = law.fit.rmse_cv();
  if (!(after < before)) return "with the samples around reversals, where alone it shows, the error does not fall";
  const double at_reversals = before * before - without_reversals * without_reversals;
  const double explained_percent = 100.0 * (before * before - after * after) / at_reversals;
  if (at_reversals > 0.0 && explained_percent < kPolicy.reversals_explained_percent)
    return fmt::format(
        "it explains {:.0f} % of the squared error that reversals add, and {:.0f} % are needed: an axis that only "
        "sticks there looks like it",
        explained_percent, kPolicy.reversals_explained_percent);
  return {};
}

}  // namespace

void refit_presliding(const data::Dataset& dataset, const model::Model& model, const Options& options,
                      const SearchedBalance* motor, Diagnosis& result) {
  const auto name = std::ranges::find_if(result.named, is_presliding);
  if (name == result.named.end() || !motor || motor->search.data->prepared().pipeline.keep_motor_reversals ||
      !options.pipeline.mask)
    return;
  const auto listed = std::ranges::find_if(result.candidates, [&](const Candidate& c) { return name_of(c) == *name; });
  if (listed == result.candidates.end()) return;
  estimation::PipelineOptions with_reversals = options.pipeline;
  with_reversals.keep_motor_reversals = true;
  with_reversals.ready = nullptr;
  const auto fitted = estimation::identify(dataset, model, with_reversals);
  const auto data = std::ranges::find(fitted->data, estimation::Balance::motor, &RegressionProblem::balance);
  if (data == fitted->data.end()) return;
  BalanceSearch search{&*data, Eigen::VectorXd::Ones(data->rows()), {}, motor->search.floor};
  search.base = cross_validate(*data, with_others(fitted->terms, *motor, result.named), search.keep);
  std::vector<CandidateFit> laws = rank_candidates(search, [&](const CandidateModel& law) {
    return NamedEffect{std::string(law.entry->name()), law.order} == *name;
  });
  if (laws.empty()) return;
  laws.front() = searched(search, std::move(laws.front()));
  const BalanceSearch& masked = motor->search;
  const double without_reversals =
      cross_validate(*masked.data, with_others(masked.base.terms, *motor, result.named), masked.keep).rmse_cv();
  Candidate of_all = candidate_of(laws.front(), search, model.drive.axis);
  count_sampling(*data, of_all);
  std::string doubt = doubt_about(search, laws.front(), without_reversals);
  // Either test of the travel is enough: the interval is wide where the law is far from linear in it, and the parts
  // differ where few of them hold most reversals.
  if (doubt.empty() && !doubt_about_presliding(of_all).empty() &&
      errors_without_travel(search, laws.front()) < kPolicy.travel_errors)
    doubt = kUnresolvedTravel;
  of_all.presliding_doubt = std::move(doubt);
  of_all.admit();
  of_all.cannot_distinguish = listed->cannot_distinguish;
  of_all.confounding_reasons = listed->confounding_reasons;
  of_all.minimum_detectable = listed->minimum_detectable;
  of_all.note = "Its values and errors are of all samples, those around reversals among them, as it shows there alone.";
  *listed = std::move(of_all);
  explain_named(search, laws, model.drive, result);
}

}  // namespace flexspline::selection
