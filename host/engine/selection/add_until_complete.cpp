#include "host/engine/selection/add_until_complete.hpp"
#include "host/engine/selection/policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::selection {
namespace {

// Decrease of chi-square over samples, in units of the noise where that is known: comparable between balances.
double chi2_drop(const Diagnosis& d) {
  if (d.candidates.empty()) return 0.0;
  const Candidate& c = d.candidates.front();
  const double drop = c.rmse_cv_before * c.rmse_cv_before - c.rmse_cv_after * c.rmse_cv_after;
  return d.noise_floor && *d.noise_floor > 0.0 ? drop / (*d.noise_floor * *d.noise_floor) : drop;
}

std::string label(const NamedEffect& named) {
  return named.order ? fmt::format("{}:{:g}", named.effect, *named.order) : named.effect;
}

}  // namespace

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
  std::vector<std::string> added;               // ids
  std::map<std::string, std::string> label_of;  // by id
  for (;;) {
    Diagnosis found = diagnose(dataset, result.model, options);
    bool more = found.verdict == Verdict::missing_effect && result.rounds.size() + 1 < most_rounds;
    const bool above = found.noise_floor && found.base_rmse_own_friction > kPolicy.at_floor * *found.noise_floor;
    if (more && !above && !result.rounds.empty() &&
        chi2_drop(found) < kPolicy.worth_adding * chi2_drop(result.rounds.front())) {
      found.warnings.push_back(
          fmt::format("{} is not added: it takes off less than {:g} % of what the first effect did",
                      label(found.named.front()), 100.0 * kPolicy.worth_adding));
      more = false;
    }
    result.rounds.push_back(std::move(found));
    if (progress) progress(result.rounds.back());
    if (!more) return result;
    if (options.progress) options.progress("adding it");
    result.model = add(dataset, result.model, label(result.rounds.back().named.front()), options.pipeline).model;
    added.push_back(result.model.effects.back().id);
    label_of[added.back()] = label(result.rounds.back().named.front());
    if (added.size() < 2) continue;
    // The newest was just named with the others in the model; only those are tried.
    const std::vector<std::string> before(added.begin(), added.end() - 1);
    const std::string out = least_significant_effect(dataset, result.model, before, options);
    if (out.empty()) continue;
    result.model = remove(dataset, result.model, out, options.pipeline).model;
    std::erase(added, out);
    // It was named before and removed as least_significant_effect. Naming it again would be an endless loop.
    const bool again = std::find(result.removed.begin(), result.removed.end(), label_of[out]) != result.removed.end();
    if (again) return result;
    result.removed.push_back(label_of[out]);
  }
}

}  // namespace flexspline::selection
