#include "host/engine/selection/presliding_fit.hpp"

#include <algorithm>
#include <cmath>

#include "host/common/numbers/quantile.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/described_candidates.hpp"
#include "host/engine/selection/effect_names.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;

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

// A travel is known no better than that between two samples.
void count_sampling(const RegressionProblem& data, Candidate& candidate) {
  const double unseen = travel_between_samples(data);
  for (Estimate& e : candidate.parameters) {
    const effects::ParameterInfo& info = catalogue::get(candidate.effect).parameters[e.ref.parameter];
    if (info.limit == effects::Limit::travel && e.std) set_std(e, std::hypot(*e.std, unseen), info);
  }
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
  const std::vector<CandidateFit> laws = rank_candidates(search, [&](const CandidateModel& law) {
    return NamedEffect{std::string(law.entry->name()), law.order} == *name;
  });
  if (laws.empty()) return;
  Candidate of_all = candidate_of(laws.front(), search, model.drive.axis);
  count_sampling(*data, of_all);
  of_all.admit();
  of_all.cannot_distinguish = listed->cannot_distinguish;
  of_all.confounding_reasons = listed->confounding_reasons;
  of_all.minimum_detectable = listed->minimum_detectable;
  of_all.note = "Its values and errors are of all samples, those around reversals among them, as it shows there alone.";
  *listed = std::move(of_all);
  explain_named(search, laws, model.drive, result);
}

}  // namespace flexspline::selection
