#include "host/engine/selection/add_until_complete.hpp"
#include "host/engine/selection/policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/effect_names.hpp"

namespace flexspline::selection {
namespace {

// Whether what a round would add takes off a relevant share of the squares that the first effect took off: in units of
// the noise where both know it, else in N m, on one balance.
bool is_worth_adding(const Diagnosis& first, const Diagnosis& now) {
  if (first.candidates.empty() || now.candidates.empty()) return true;
  const auto knows_noise = [](const Diagnosis& d) { return d.noise_floor && *d.noise_floor > 0.0; };
  const bool in_noise = knows_noise(first) && knows_noise(now);
  if (!in_noise && first.candidates.front().balance != now.candidates.front().balance) return true;
  const auto drop = [&](const Diagnosis& d) {
    const Candidate& c = d.candidates.front();
    const double unit = in_noise ? *d.noise_floor : 1.0;
    return (c.rmse_cv_before * c.rmse_cv_before - c.rmse_cv_after * c.rmse_cv_after) / (unit * unit);
  };
  return drop(now) >= kPolicy.worth_adding * drop(first);
}

}  // namespace

void StepwiseSelection::note_added(const NamedEffect& effect) {
  std::erase(removed, label_of(effect));
  kept.push_back(effect);
}

bool StepwiseSelection::note_removed(const std::string& name) {
  std::erase_if(kept, [&](const NamedEffect& effect) { return label_of(effect) == name; });
  removed.push_back(name);
  const bool again = std::ranges::find(ever_removed_, name) != ever_removed_.end();
  ever_removed_.push_back(name);
  return again;
}

std::string least_significant_effect(const data::Dataset& dataset, const model::Model& model,
                                     const std::vector<std::string>& ids, const Options& options) {
  const auto fitted = estimation::identify(dataset, model, options.pipeline);
  std::string worst;
  double least = kPolicy.named_score;
  for (const RegressionProblem& data : fitted->data) {
    const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
    const auto on_balance = estimation::terms_on(fitted->terms, data.balance(), fitted->prepared.output_signals);
    CrossValidatedFit full;
    for (const std::size_t t : on_balance) {
      const estimation::Term& term = fitted->terms[t];
      if (std::find(ids.begin(), ids.end(), term.id) == ids.end() || !term.entry->info->replaces.empty()) continue;
      const bool scaled = std::any_of(fitted->terms.begin(), fitted->terms.end(), [&](const estimation::Term& other) {
        return other.entry->info->modulates == term.entry->name();
      });
      if (scaled) continue;
      if (full.left_out.empty()) full = cross_validate(data, fitted->terms, keep);
      estimation::Terms without = fitted->terms;
      without.erase(without.begin() + static_cast<std::ptrdiff_t>(t));
      double parameters = 0.0;
      for (const auto known : term.known) parameters += known ? 0.0 : 1.0;
      const double score = likelihood_gain(cross_validate(data, std::move(without), keep), full, parameters).score;
      if (score < least) {
        least = score;
        worst = term.id;
      }
    }
  }
  return worst;
}

StepwiseSelection add_until_complete(const data::Dataset& dataset, const model::Model& model, const Options& options,
                                     std::size_t most_rounds, const std::function<void(const Diagnosis&)>& progress) {
  StepwiseSelection result;
  result.model = model;
  std::vector<std::string> added;  // ids of those that likelihood alone named: it may remove them, too
  std::map<std::string, std::string> label_by_id;
  for (;;) {
    Diagnosis found = diagnose(dataset, result.model, options);
    bool more = found.verdict == Verdict::missing_effect && result.rounds.size() + 1 < most_rounds;
    const bool above = found.noise_floor && found.base_rmse_own_friction > kPolicy.at_floor * *found.noise_floor;
    if (more && !above && !result.rounds.empty() && !is_worth_adding(result.rounds.front(), found)) {
      found.warnings.push_back(
          fmt::format("{} is not added: it takes off less than {:g} % of what the first effect did",
                      label_of(found.named.front()), 100.0 * kPolicy.worth_adding));
      more = false;
    }
    result.rounds.push_back(std::move(found));
    if (progress) progress(result.rounds.back());
    if (!more) return result;
    if (options.progress) options.progress("adding it");
    const NamedEffect newest = result.rounds.back().named.front();
    result.model = add(dataset, result.model, label_of(newest), options.pipeline).model;
    result.note_added(newest);
    // The newest was just named with the others in the model; only those are tried.
    const std::vector<std::string> before = added;
    const Diagnosis& last = result.rounds.back();
    if (!last.candidates.empty() && last.candidates.front().score > kPolicy.named_score) {
      added.push_back(result.model.effects.back().id);
      label_by_id[added.back()] = label_of(newest);
    }
    if (before.empty()) continue;
    const std::string out = least_significant_effect(dataset, result.model, before, options);
    if (out.empty()) continue;
    result.model = remove(dataset, result.model, out, options.pipeline).model;
    std::erase(added, out);
    if (result.note_removed(label_by_id[out])) return result;
  }
}

}  // namespace flexspline::selection
