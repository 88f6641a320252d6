#include "host/engine/selection/stability_selection.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::selection {
namespace {

constexpr std::uint64_t kSeed = 1234;

double median(std::vector<double> x) {
  if (x.empty()) return 0.0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double median_of_positive(std::vector<double> x) {
  std::erase_if(x, [](double v) { return !(v > 0.0); });
  return x.empty() ? 1.0 : median(std::move(x));
}

}  // namespace

StabilitySelection::StabilitySelection(const std::vector<const data::Experiment*>& experiments,
                                       const model::Drive& drive, const estimation::Terms& terms, Balance balance,
                                       const SelectionPolicy& policy)
    : policy_(policy), tables_(make_tables(experiments, drive, terms, balance, policy)) {
  if (tables_.sign.model_columns > 0) evaluate();
}

void StabilitySelection::evaluate() {
  per_setting_.assign(tables_.settings.size(), {});
  result_ = {};
  estimation::in_parallel(per_setting_.size(), [&](std::size_t i) {
    per_setting_[i] = evaluate_setting(tables_.settings[i].first, tables_.settings[i].second, kSeed + i);
  });
  count();
}

std::optional<TimeLag> StabilitySelection::time_lag(const std::vector<std::string>& names) const {
  // At the setting of the highest bandwidth of the motion, reversals kept.
  const auto at = std::find_if(tables_.settings.begin(), tables_.settings.end(), [&](const auto& s) {
    return s.first <= 1.01 * tables_.bandwidth.highest_hz && !s.second;
  });
  if (at == tables_.settings.end()) return std::nullopt;
  const SettingResult& setting = per_setting_[static_cast<std::size_t>(at - tables_.settings.begin())];
  if (setting.votes.empty()) return std::nullopt;
  std::vector<int> terms;
  for (const std::string& name : names)
    for (const int term : terms_of(setting, {name})) terms.push_back(term);
  const bool presliding = std::erase(terms, kPreslidingTerm) > 0 && tables_.presliding;
  const std::optional<TimeLag> lag = estimate_time_lag(presliding ? *tables_.presliding : tables_.sign, terms, policy_);
  if (!lag || std::abs(lag->seconds) < policy_.delay_errors * lag->std || lag->share < policy_.line_share)
    return std::nullopt;
  return lag;
}

void StabilitySelection::take_off(const TimeLag& lag) {
  take_off_lag(tables_.sign, lag.seconds);
  if (tables_.presliding) take_off_lag(*tables_.presliding, lag.seconds);
  evaluate();
}

Noise StabilitySelection::noise_of_best(const Setting& one, const Setting* second, const std::vector<double>& weights,
                                        FrictionRandomEffects& differences, SettingResult& result) const {
  const RegressorTable& sign = tables_.sign;
  Noise noise;
  for (int round = 0; round < 2; ++round) {
    result.all = sum_of(one, second, weights, {}, 0, differences);
    const SelectionPath rough = select_forward(sign, result.all, result.all, noise, result.may_enter, policy_);
    std::vector<int> chosen;
    for (const SelectionStep& s : rough.steps) chosen.push_back(s.term);
    const TermFit fitted = fit_terms(sign, chosen, result.all, result.all);
    const bool z = std::find(chosen.begin(), chosen.end(), kPreslidingTerm) != chosen.end();
    const Setting& seen = z ? *second : one;
    const Eigen::VectorXd residual = weighted_residual(seen, fitted, weights, differences);
    noise.variance = semivariance(one, residual);
    std::vector<estimation::RowRange> ranges;
    for (const Run& run : one.runs) ranges.push_back({run.record, run.first, run.last});
    noise.tau = std::max(2.0, estimation::autocorrelation_time(ranges, residual));
    const double left = residual.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, residual.size()));
    result.whiteness = residual.size() > 0 ? noise.variance / std::max(left, 1e-300) : -1.0;
    if (sign.differences.empty() || round == 1) break;
    differences.noise = noise.tau * std::max(left, 1e-12);
    differences.variance =
        friction_effects_of(z ? *tables_.presliding : sign, seen, weights, differences.noise, policy_);
  }
  return noise;
}

StabilitySelection::SettingResult StabilitySelection::evaluate_setting(double cutoff_hz, bool mask,
                                                                       std::uint64_t seed) const {
  SettingResult result;
  const RegressorTable& sign = tables_.sign;
  const Setting one = make_setting(sign, cutoff_hz, mask, false, policy_);
  std::optional<Setting> two;
  if (tables_.presliding && !mask) two = make_setting(*tables_.presliding, cutoff_hz, mask, false, policy_);
  if (one.blocks.size() < 4 ||
      static_cast<double>(one.rows.rows()) < policy_.fewest_rows_per_column * static_cast<double>(sign.model_columns))
    return result;
  const bool has_second = two && two->blocks.size() == one.blocks.size();
  const Setting* const second = has_second ? &*two : nullptr;
  std::vector<double> weights = record_weights(sign, one);
  for (const CandidateTerm& term : sign.terms) result.may_enter.push_back(tables_.may_enter(term, cutoff_hz) ? 1 : 0);

  FrictionRandomEffects differences{sign.differences, {}, 0.0};
  const Noise noise = noise_of_best(one, second, weights, differences, result);

  std::mt19937_64 chance(seed);
  std::size_t records = 0;
  for (const double w : weights) records += w > 0.0 ? 1 : 0;
  for (std::size_t pair = 0; pair < policy_.pairs; ++pair) {
    const bool by_record = records >= policy_.fewest_records_to_split && pair % 2 == 1;
    const std::vector<std::uint8_t> in = by_record ? half_of_records(one, chance) : half_of_blocks(one, chance);
    const HalfData a = sum_of(one, second, weights, in, 0, differences),
                   b = sum_of(one, second, weights, in, 1, differences);
    result.votes.push_back(select_forward(sign, a, b, noise, result.may_enter, policy_));
    result.votes.push_back(select_forward(sign, b, a, noise, result.may_enter, policy_));
  }

  const Setting held = make_setting(sign, cutoff_hz, mask, true, policy_);
  if (held.blocks.empty()) return result;
  std::optional<Setting> held_second;
  if (second) held_second = make_setting(*tables_.presliding, cutoff_hz, mask, true, policy_);
  // A record that was not fitted on has no variance of its own: it counts as the median of the others.
  const double usual = median_of_positive(weights);
  for (double& w : weights) w = w > 0.0 ? w : usual;
  result.held_out = sum_of(held, held_second ? &*held_second : nullptr, weights, {}, 0, differences);
  return result;
}

namespace {

// How often a term was chosen, over the subsamples of all settings.
struct Count {
  Frequency f;
  double could = 0.0, was = 0.0, first = 0.0, near = 0.0;
  std::map<std::string, double> alternatives;
  std::vector<double> shares;
};
using Counts = std::map<std::string, Count>;

const std::string& name_of(const RegressorTable& table, int term) {
  static const std::string presliding = kPresliding;
  return term == kPreslidingTerm ? presliding : table.terms[static_cast<std::size_t>(term)].name;
}

// Counts a subsample that does not abstain. Returns the share of the excess that its steps explain.
double count_steps(const RegressorTable& table, const SelectionPath& vote, Counts& counts) {
  double sum = 0.0;
  for (std::size_t k = 0; k < vote.steps.size(); ++k) {
    const SelectionStep& s = vote.steps[k];
    Count& c = counts[name_of(table, s.term)];
    c.was += 1.0;
    for (const std::string& other : s.alternatives) {
      c.alternatives[other] += 1.0;
      counts[other].near += 1.0;
    }
    if (k == 0) c.first += 1.0;
    c.shares.push_back(s.of_all);
    sum += s.of_all;
  }
  return sum;
}

// Of a term that was chosen at least once.
Frequency frequency_of(Count& c) {
  constexpr double kOften = 0.3;
  c.f.frequency = c.was / c.could;
  c.f.first = c.first / c.could;
  c.f.near = std::min(1.0, (c.was + c.near) / c.could);
  for (const auto& [other, times] : c.alternatives)
    if (times >= kOften * c.was) c.f.alternatives.emplace_back(other, times / c.was);
  std::sort(c.shares.begin(), c.shares.end());
  const auto quantile_of_shares = [&](double q) {
    return c.shares[static_cast<std::size_t>(std::lround(q * static_cast<double>(c.shares.size() - 1)))];
  };
  c.f.share = quantile_of_shares(0.5);
  c.f.share_low = quantile_of_shares(0.025);
  c.f.share_high = quantile_of_shares(0.975);
  return c.f;
}

}  // namespace

void StabilitySelection::count() {
  const RegressorTable& sign = tables_.sign;
  Counts counts;
  std::vector<double> explained, white;
  for (std::size_t i = 0; i < per_setting_.size(); ++i) {
    if (per_setting_[i].votes.empty()) continue;
    std::map<std::string, const CandidateTerm*> open;
    for (std::size_t t = 0; t < sign.terms.size(); ++t)
      if (per_setting_[i].may_enter[t]) open[sign.terms[t].name] = &sign.terms[t];
    if (tables_.presliding && !tables_.settings[i].second) open[kPresliding] = nullptr;
    for (const SelectionPath& vote : per_setting_[i].votes) {
      result_.subsamples += 1.0;
      if (vote.extrapolates) result_.extrapolated += 1.0;
      if (vote.abstains) {
        result_.abstained += 1.0;
        continue;
      }
      for (const auto& [name, term] : open) {
        Count& c = counts[name];
        c.f.name = name;
        if (term) {
          c.f.entry = term->entry;
          c.f.order = term->order;
        }
        c.could += 1.0;
      }
      explained.push_back(count_steps(sign, vote, counts));
    }
  }
  for (std::size_t i = 0; i < per_setting_.size(); ++i)
    if (tables_.settings[i].second && per_setting_[i].whiteness >= 0.0 &&
        tables_.settings[i].first <= 1.01 * tables_.bandwidth.highest_hz)
      white.push_back(std::min(1.0, per_setting_[i].whiteness));
  result_.explained = median(explained);
  result_.whiteness = median(white);
  for (auto& [name, c] : counts)
    if (c.was > 0.0 && c.could > 0.0) result_.frequencies.push_back(frequency_of(c));
  std::sort(result_.frequencies.begin(), result_.frequencies.end(),
            [](const Frequency& a, const Frequency& b) { return a.frequency > b.frequency; });
}

std::vector<int> StabilitySelection::terms_of(const SettingResult& setting,
                                              const std::vector<std::string>& names) const {
  std::vector<int> chosen;
  for (const std::string& name : names) {
    if (name == kPresliding) {
      if (setting.all.presliding.size() == 0) return {};
      chosen.push_back(kPreslidingTerm);
      continue;
    }
    int best = -1;
    double least = 0.0;
    for (std::size_t t = 0; t < tables_.sign.terms.size(); ++t) {
      if (tables_.sign.terms[t].name != name || !setting.may_enter[t]) continue;
      chosen.push_back(static_cast<int>(t));
      const double squares = fit_terms(tables_.sign, chosen, setting.all, setting.all).training_squares;
      chosen.pop_back();
      if (best >= 0 && squares >= least) continue;
      best = static_cast<int>(t);
      least = squares;
    }
    if (best < 0) return {};
    chosen.push_back(best);
  }
  return chosen;
}

std::vector<double> StabilitySelection::held_out_ratios(const std::vector<std::string>& names) const {
  std::vector<std::vector<double>> ratios(names.size());
  for (const SettingResult& setting : per_setting_) {
    if (setting.held_out.rows == 0.0) continue;
    // Terms that are not visible at this bandwidth, or without reversals, are left out of all fits.
    std::vector<std::string> seen;
    for (const std::string& name : names)
      if (!terms_of(setting, {name}).empty()) seen.push_back(name);
    const double with_all =
        fit_terms(tables_.sign, terms_of(setting, seen), setting.all, setting.held_out).validation_squares;
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::vector<std::string> others = seen;
      if (std::erase(others, names[i]) == 0) continue;
      const double without =
          fit_terms(tables_.sign, terms_of(setting, others), setting.all, setting.held_out).validation_squares;
      if (without > 0.0) ratios[i].push_back(std::sqrt(with_all / without));
    }
  }
  std::vector<double> medians;
  for (const std::vector<double>& r : ratios)
    if (!r.empty()) medians.push_back(median(r));
  return medians.size() == names.size() ? medians : std::vector<double>{};
}

}  // namespace flexspline::selection
