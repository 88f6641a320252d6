#include "host/engine/selection/joint_names.hpp"

#include <algorithm>
#include <optional>

#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/named_by_resampling.hpp"

namespace flexspline::selection {
namespace {

// Null: likelihood does not judge it.
const CandidateFit* candidate_by_likelihood(const SearchedBalance& motor, const NamedEffect& name) {
  const CandidateFit* candidate = candidate_named(motor, name);
  return candidate && candidate->model.entry->is_presliding() ? nullptr : candidate;
}

// Whether a parameter of the added effect has a value that is not possible: the others explain more than there is.
bool is_impossible(const CandidateFit& candidate) {
  const std::size_t added = candidate.fit.terms.size() - 1;
  for (std::size_t j = 0; j < candidate.fit.linear.size(); ++j) {
    if (candidate.fit.linear[j].term != added) continue;
    const effects::ParameterInfo& info = candidate.model.entry->parameters[candidate.fit.linear[j].parameter];
    const double value = candidate.fit.theta[static_cast<Eigen::Index>(j)];
    if (value < info.low || value > info.high) return true;
  }
  return false;
}

// With all nonlinear parameters of the model searched together: those of the others were found without this effect.
LikelihoodGain gain_together(const BalanceSearch& with_others, const CandidateFit& candidate) {
  constexpr double kTolerance = 1e-5;
  const RegressionProblem& data = *with_others.data;
  Terms terms = candidate.fit.terms;
  const auto on_balance = estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
  if (estimation::free_nonlinear_parameters(terms, on_balance).empty()) return candidate.gain;
  estimation::refine_nonlinear(data, terms, on_balance, noise_covariance(data, candidate.fit), kTolerance);
  const LikelihoodGain refined = likelihood_gain(
      with_others.base, cross_validate(data, std::move(terms), with_others.keep), candidate.model.added);
  return refined.score > candidate.gain.score ? refined : candidate.gain;
}

// The score of a name with the other ones in the model, zero where its values are not possible then. Nothing:
// likelihood does not judge it, or judges no other one.
std::optional<double> score_with_others(const SearchedBalance& motor, const std::vector<NamedEffect>& names,
                                        const NamedEffect& name) {
  if (!candidate_by_likelihood(motor, name)) return std::nullopt;
  Terms terms = motor.search.base.terms;
  const std::size_t before = terms.size();
  for (const NamedEffect& other : names)
    if (const CandidateFit* c = candidate_by_likelihood(motor, other); c && other != name)
      terms.push_back(c->fit.terms.back());
  if (terms.size() == before) return std::nullopt;
  BalanceSearch with_others{motor.search.data, motor.search.keep, {}, motor.search.floor};
  with_others.base = cross_validate(*motor.search.data, std::move(terms), motor.search.keep);
  const std::vector<CandidateFit> own = rank_candidates(with_others, [&](const CandidateModel& model) {
    return NamedEffect{std::string(model.entry->name()), model.order} == name;
  });
  if (own.empty()) return std::nullopt;
  return is_impossible(own.front()) ? 0.0 : gain_together(with_others, own.front()).score;
}

// The likeliest candidate, where it is none of the names and gains something with all of them in the model.
std::optional<NamedEffect> likeliest_other(const SearchedBalance& motor, const std::vector<NamedEffect>& names) {
  if (!motor.names_one() || motor.candidates.front().model.entry->is_presliding()) return std::nullopt;
  const NamedEffect first = name_of(motor.candidates.front());
  if (contains_family(names, motor.candidates.front())) return std::nullopt;
  const std::optional<double> score = score_with_others(motor, names, first);
  return score && *score > kPolicy.named_score ? std::optional(first) : std::nullopt;
}

bool may_replace(const Resampling& resampling, const CandidateFit& likeliest) {
  if (likeliest.held_out_ratio)
    return 1.0 - *likeliest.held_out_ratio * *likeliest.held_out_ratio >= kPolicy.line_share;
  return !resampling.found_group(name_of(likeliest)).empty();
}

// Whether halves cannot judge the likeliest effect, which looks like the one that it makes needless.
bool is_indistinct(const Resampling& resampling, const CandidateFit& likeliest, const NamedEffect& needless) {
  const bool is_covered = support_of(resampling, likeliest) && resampling.is_visible(likeliest.model.entry->name());
  const catalogue::Entry& entry = catalogue::get(needless.effect);
  return !is_covered && (catalogue::names_contain(likeliest.model.entry->info->confused_with, entry.name()) ||
                         catalogue::names_contain(entry.info->confused_with, likeliest.model.entry->name()));
}

}  // namespace

JointNames eliminate_backward(const Resampling& resampling, const SearchedBalance& motor,
                              std::vector<NamedEffect> names) {
  JointNames joint;
  const std::optional<NamedEffect> other = names.empty() ? std::nullopt : likeliest_other(motor, names);
  if (other) names.push_back(*other);
  while (names.size() > 1) {
    double least = 0.0;
    auto worst = names.end();
    for (auto name = names.begin(); name != names.end(); ++name) {
      const CandidateFit* alone = candidate_by_likelihood(motor, *name);
      if (!alone || alone->gain.score <= kPolicy.named_score) continue;
      const std::optional<double> score = score_with_others(motor, names, *name);
      if (!score || *score > least) continue;
      least = *score;
      worst = name;
    }
    if (worst == names.end()) break;
    joint.eliminated.push_back(std::move(*worst));
    names.erase(worst);
  }
  if (other && (joint.eliminated.empty() || !may_replace(resampling, motor.candidates.front()))) {
    const auto like_it = std::ranges::find_if(
        joint.eliminated, [&](const NamedEffect& n) { return is_indistinct(resampling, motor.candidates.front(), n); });
    if (like_it != joint.eliminated.end()) {
      joint.names = {std::move(*like_it), *other};
      joint.eliminated.erase(like_it);
      joint.is_group = true;
      std::erase(names, *other);
      joint.more = std::move(names);
      return joint;
    }
    std::erase(names, *other);
  }
  joint.names = std::move(names);
  return joint;
}

}  // namespace flexspline::selection
