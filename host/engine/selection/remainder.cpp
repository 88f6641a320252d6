#include "host/engine/selection/remainder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/selection/balance_errors.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/named_delay.hpp"

namespace flexspline::selection {
namespace {

std::string drift_text(const Drift& drift, const estimation::PreparedData& prepared) {
  const bool has_temperature = std::any_of(prepared.records.begin(), prepared.records.end(),
                                           [](const estimation::Record& r) { return r.has_temperature; });
  // The largest that is looked for is half of the value.
  constexpr double kMost_percent = 45.0;
  if (drift.percent > kMost_percent)
    return fmt::format(
        "{} differs between runs by half its value or more, which the model does not explain. So much is seldom the "
        "temperature: some runs hardly show it, or the friction law is another one. Record slow and fast motion in one "
        "run",
        drift.group);
  return fmt::format(
      "{} differs between runs by {:.1f} %, which the model does not explain. {} An effect that shows only from run to "
      "run counts for less then; repeat one motion from time to time",
      drift.group, drift.percent,
      has_temperature ? "The temperature is recorded: see whether an effect of it is named or possible."
                      : "The temperature does that, which is not recorded, and so does a load or a posture of other "
                        "joints that differs.");
}

}  // namespace

std::string delay_advice(double delay_s, const estimation::PreparedData& prepared) {
  constexpr double kSure = 0.25, kMoreThanHold = 0.75;  // samples
  double longest_s = 0.0;
  for (const estimation::Record& r : prepared.records) longest_s = std::max(longest_s, r.sample_s);
  const double samples = std::abs(delay_s) / std::max(longest_s, 1e-300);
  if (samples < kSure) return {};
  const bool is_held = std::any_of(prepared.records.begin(), prepared.records.end(), [](const estimation::Record& r) {
    return r.experiment->current_hold == data::CurrentHold::zoh;
  });
  const std::string what = fmt::format("The effort {} the motion by {:.3g} ms ({:.2g} samples)",
                                       delay_s > 0.0 ? "lags" : "leads", 1e3 * std::abs(delay_s), samples);
  if (delay_s > 0.0 && samples < kMoreThanHold && is_held)
    return what +
           ": it was moved by half a sample, as if the drive held it from sample to sample. If yours does not, state "
           "current_hold = \"none\" in dataset.toml.";
  return what + (delay_s > 0.0 ? ": check the time stamps and filters of the log."
                               : ": it acts later than it is logged, as a commanded current does (current_delay), or "
                                 "the time stamps differ.");
}

void add_drifts(const SearchedBalance& balance, const CrossValidatedFit& fit, Diagnosis& result) {
  for (const Drift& d : drifts(fit)) {
    result.friction_drift.push_back(d);
    result.warnings.push_back(drift_text(d, balance.search.data->prepared()));
  }
}

namespace {

// Whether halves of the data decide, and found a structure that is in no catalogue.
bool halves_show_unknown_structure(const Diagnosis& result) {
  return result.resampling && result.resampling->decides &&
         std::ranges::any_of(result.resampling->found, &Resampling::FoundTerm::is_unknown_structure);
}

// What is above the noise with the named effect in the model, and the verdict where none is named.
void assess_verdict(const SearchedBalance& chosen, const CrossValidatedFit& after, Diagnosis& result) {
  const bool at_floor = result.noise_floor && after.rmse() < kPolicy.at_floor * *result.noise_floor;
  bool enough = true;
  if (result.noise_floor && !result.named.empty()) {
    const auto above = [&](const CrossValidatedFit& j) {
      return j.rmse() * j.rmse() - *result.noise_floor * *result.noise_floor;
    };
    double before = above(chosen.search.base);
    // A delay that is named by its lag: the base model has that lag.
    if (!result.candidates.empty() && result.candidates.front().is_lag)
      before += std::pow(chosen.search.base.rmse(), 2) * (1.0 / (1.0 - lag_of(chosen.search.base).share) - 1.0);
    if (before > 0.0) result.recovered_percent = std::clamp(100.0 * (1.0 - above(after) / before), 0.0, 100.0);
    enough = at_floor || result.recovered_percent.value_or(100.0) >= kPolicy.recovered_percent;
  }
  const std::vector<LocalisedResidual> remaining =
      shares(*chosen.search.data, after, after.residual,
             enough ? kPolicy.shown_share_percent : kPolicy.least_shown_share_percent);
  if (!at_floor) result.remaining_structure = remaining;
  if (!result.named.empty()) return;
  if (at_floor)
    result.verdict = Verdict::at_noise_floor;
  else if ((result.noise_floor && !remaining.empty()) || halves_show_unknown_structure(result))
    result.verdict = Verdict::unknown_structure;
  else
    result.verdict = Verdict::nothing_significant;
}

}  // namespace

void assess_remainder(const SearchedBalance& chosen, Diagnosis& result) {
  const CandidateFit* named = result.named.empty() ? nullptr : candidate_named(chosen, result.named.front());
  const CrossValidatedFit& after = named ? named->fit : chosen.search.base;
  // A missing effect may look like a delay, so the delay is taken from the better model. Where a delay is named, it
  // says how large it is.
  const bool names_delay = std::any_of(result.named.begin(), result.named.end(), [](const NamedEffect& n) {
    return estimation::is_delay_of_current(catalogue::get(n.effect));
  });
  const Eigen::Index delay = after.theta.size() - 1;
  if (chosen.search.data->balance() == estimation::Balance::motor && !names_delay &&
      std::abs(after.theta[delay]) > kPolicy.delay_errors * after.std[delay] &&
      std::abs(after.theta[delay]) <= kPolicy.longest_lag_s)
    result.delay_s = after.theta[delay];
  add_drifts(chosen, after, result);
  assess_verdict(chosen, after, result);
}

bool follow_names(const SearchedBalance& chosen, Diagnosis& result) {
  if (result.verdict != Verdict::missing_effect && result.verdict != Verdict::confusable_effects) return false;
  if (result.named.size() == 1) result.verdict = Verdict::missing_effect;
  if (!result.named.empty()) return false;
  // They were of the effect that was named.
  result.recovered_percent.reset();
  result.remaining_structure.clear();
  assess_verdict(chosen, chosen.search.base, result);
  return true;
}

}  // namespace flexspline::selection
