#include "host/engine/selection/wald_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

std::optional<double> wald_p_value(const Candidate& candidate) {
  const catalogue::Entry* const entry = catalogue::find(candidate.effect);
  double parameters = 0.0, chi2 = 0.0;
  for (const estimation::Estimate& e : candidate.parameters) {
    if (e.fixed) continue;
    // A nonlinear parameter has no value where the amplitude is zero, so that the test does not hold (Davies 1977).
    if (entry && entry->parameters[e.ref.parameter].kind == effects::Kind::nonlinear) return std::nullopt;
    if (!e.std || !(*e.std > 0.0)) return std::nullopt;
    parameters += 1.0;
    chi2 += (e.value / *e.std) * (e.value / *e.std);
  }
  if (parameters == 0.0) return std::nullopt;
  const double tried = candidate.order ? kPolicy.highest_order : 1.0;
  return std::min(1.0, tried * numbers::chi_squared_above(parameters, chi2));
}

bool is_confirmed_by_held_out(const Diagnosis& result, const NamedEffect& name) {
  if (!result.resampling || !result.resampling->decides) return false;
  const auto is_it = [&](const NamedEffect& n) { return is_of_family(n, name); };
  return std::any_of(result.resampling->found.begin(), result.resampling->found.end(), [&](const auto& found) {
    return found.is_confirmed() && std::any_of(found.group.begin(), found.group.end(), is_it);
  });
}

namespace {

Candidate* candidate_of_name(Diagnosis& result, const NamedEffect& name) {
  const auto at = std::find_if(result.candidates.begin(), result.candidates.end(),
                               [&](const Candidate& c) { return name_of(c) == name; });
  return at == result.candidates.end() ? nullptr : &*at;
}

// A nonlinear parameter whose interval is its whole possible range: at the ends of the range the law is one that the
// model has, or vanishes, so that the data do not show it.
std::optional<std::string> undetermined_shape(const Candidate& candidate) {
  const catalogue::Entry* const entry = catalogue::find(candidate.effect);
  // What scales friction has no amplitude of its own; whether it is there, the friction of the records says.
  if (!entry || entry->count(effects::Kind::linear) == 0) return std::nullopt;
  for (const estimation::Estimate& e : candidate.parameters) {
    const effects::ParameterInfo& info = entry->parameters[e.ref.parameter];
    if (info.kind == effects::Kind::nonlinear && !e.fixed && e.low && e.high && *e.low <= info.low &&
        *e.high >= info.high)
      return std::string(info.name);
  }
  return std::nullopt;
}

// Why a name is taken back; empty where it stays. An axis that sticks is confirmed by held-out experiments, too, as it
// sticks there as well.
std::string why_insignificant(Diagnosis& result, const NamedEffect& name, bool presliding) {
  const Candidate* const candidate = candidate_of_name(result, name);
  if (!candidate) return {};
  if (presliding)
    if (std::string doubt = doubt_about_presliding(*candidate); !doubt.empty()) return doubt;
  if (is_confirmed_by_held_out(result, name)) return {};
  // Likelihood names no law whose nonlinear parameter is at an end of its range; halves do not ask.
  const bool halves_decide = result.resampling && result.resampling->decides;
  if (const std::optional<std::string> shape = undetermined_shape(*candidate); shape && halves_decide)
    return fmt::format("the interval of its {} is all that is possible", *shape);
  const std::optional<double> p = wald_p_value(*candidate);
  return p && *p > kPolicy.wald_p_value ? "its values do not differ from zero beyond their intervals" : "";
}

}  // namespace

std::string doubt_about_presliding(const Candidate& candidate) {
  if (candidate.presliding_doubt) return *candidate.presliding_doubt;
  const catalogue::Entry* const entry = catalogue::find(candidate.effect);
  const bool is_unresolved =
      entry && entry->is_presliding() && std::ranges::any_of(candidate.parameters, [&](const estimation::Estimate& e) {
        return entry->parameters[e.ref.parameter].limit == effects::Limit::travel && !e.fixed && e.std &&
               e.value < estimation::half_width_under_bias(0.0) * *e.std;
      });
  return is_unresolved ? std::string(kUnresolvedTravel) : "";
}

void take_back_insignificant(Diagnosis& result, bool presliding) {
  const auto is_insignificant = [&](const NamedEffect& name) {
    return !why_insignificant(result, name, presliding).empty();
  };
  if (result.verdict == Verdict::confusable_effects &&
      !std::all_of(result.named.begin(), result.named.end(), is_insignificant))
    return;
  std::erase_if(result.named, [&](const NamedEffect& name) {
    const std::string why = why_insignificant(result, name, presliding);
    if (why.empty()) return false;
    note_taken_back(result, name, why);
    return true;
  });
}

void note_taken_back(Diagnosis& result, const NamedEffect& name, const std::string& why) {
  if (Candidate* const candidate = candidate_of_name(result, name)) {
    candidate->admissible = false;
    candidate->why_not = why;
  }
  if (result.resampling && result.resampling->decides)
    result.possible.push_back({{name}, why, std::nullopt, std::nullopt});
}

}  // namespace flexspline::selection
