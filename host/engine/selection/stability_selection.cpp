#include "host/engine/selection/stability_selection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "host/common/numbers/quantile.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/selection/filtered_table.hpp"

namespace flexspline::selection {
namespace {

constexpr std::uint64_t kSeed = 1234;

double median_of_positive(std::vector<double> x) {
  std::erase_if(x, [](double v) { return !(v > 0.0); });
  return x.empty() ? 1.0 : numbers::upper_median(std::move(x));
}

}  // namespace

StabilitySelection::StabilitySelection(const std::vector<const data::Experiment*>& experiments,
                                       const model::Drive& drive, const estimation::Terms& terms, Balance balance,
                                       const SelectionPolicy& policy)
    : policy_(policy), tables_(make_tables(experiments, drive, terms, balance, policy)) {
  if (tables_.table.model_columns == 0) return;
  filter_samples();
  evaluate();
}

void StabilitySelection::filter_samples() {
  for (const auto& [cutoff_hz, mask] : tables_.settings)
    if (!mask) samples_.push_back({cutoff_hz, {}, {}});
  estimation::in_parallel(samples_.size(), [&](std::size_t b) {
    BandwidthSamples& samples = samples_[b];
    // Columns of waves that a bandwidth cannot show would cost most of the time.
    for (std::size_t t = 0; t < tables_.table.terms.size(); ++t)
      if (tables_.may_enter(tables_.table.terms[t], samples.cutoff_hz)) samples.terms.push_back(static_cast<int>(t));
    samples.table = filtered_table(tables_.table, choose_columns(tables_.table, samples.terms), samples.cutoff_hz);
  });
}

void StabilitySelection::evaluate() {
  per_setting_.assign(tables_.settings.size(), {});
  result_ = {};
  estimation::in_parallel(per_setting_.size(), [&](std::size_t i) {
    const std::pair<double, bool>& setting = tables_.settings[i];
    const auto samples = std::find_if(samples_.begin(), samples_.end(),
                                      [&](const BandwidthSamples& s) { return s.cutoff_hz == setting.first; });
    per_setting_[i] = evaluate_setting(*samples, setting.second, kSeed + i);
  });
  count();
}

std::optional<TimeLag> StabilitySelection::time_lag(const std::vector<std::string>& names) const {
  // The phase of a torque that was replaced by the load's model is the model's.
  if (tables_.torque_has_noise) return std::nullopt;
  // At the setting of the highest bandwidth of the motion, reversals kept.
  const auto at = std::find_if(tables_.settings.begin(), tables_.settings.end(), [&](const auto& s) {
    return s.first <= 1.01 * tables_.bandwidth.highest_hz && !s.second;
  });
  if (at == tables_.settings.end()) return std::nullopt;
  const SettingResult& setting = per_setting_[static_cast<std::size_t>(at - tables_.settings.begin())];
  if (setting.votes.empty()) return std::nullopt;
  std::vector<int> terms;
  for (const std::string& name : names)
    for (const int term : terms_of(setting, {name}))
      terms.push_back(term == kPreslidingTerm ? term : setting.terms[static_cast<std::size_t>(term)]);
  std::erase(terms, kPreslidingTerm);
  // Half a period later a wave is the same wave again.
  const bool has_wave = std::any_of(terms.begin(), terms.end(), [&](int term) {
    return tables_.table.terms[static_cast<std::size_t>(term)].order.has_value();
  });
  const std::optional<TimeLag> lag =
      estimate_time_lag(tables_.table, terms, has_wave ? LagRange::usual : LagRange::longest, policy_);
  if (!lag || std::abs(lag->lag_s) < policy_.delay_errors * lag->std_s || lag->reduction_share < policy_.line_share)
    return std::nullopt;
  return lag;
}

void StabilitySelection::correct_lag(const TimeLag& lag) {
  correct_time_lag(tables_.table, lag.lag_s);
  estimation::in_parallel(samples_.size(), [&](std::size_t b) { filter_targets(tables_.table, samples_[b].table); });
  evaluate();
}

void StabilitySelection::leave_out(const std::vector<std::string>& names) {
  left_out_.insert(names.begin(), names.end());
  evaluate();
}

Noise StabilitySelection::noise_of_best(const Setting& setting, const std::vector<double>& weights,
                                        FrictionRandomEffects& differences, SettingResult& result) const {
  Noise noise;
  for (int round = 0; round < 2; ++round) {
    result.all = sum_of(setting, weights, differences);
    const SelectionPath rough = select_forward(result.columns, result.all, result.all, noise, policy_);
    std::vector<int> chosen;
    for (const SelectionStep& s : rough.steps) chosen.push_back(s.term);
    const TermFit fitted = fit_terms(result.columns, chosen, result.all, result.all);
    const bool z = std::find(chosen.begin(), chosen.end(), kPreslidingTerm) != chosen.end();
    const Direction direction = z ? Direction::presliding : Direction::sign;
    const Eigen::VectorXd residual = weighted_residual(setting, direction, fitted, weights, differences);
    noise.variance = semivariance(setting, residual);
    std::vector<estimation::RowRange> ranges;
    for (const Run& run : setting.runs) ranges.push_back({run.record, run.first, run.last});
    noise.tau = std::max(2.0, estimation::autocorrelation_time(ranges, residual));
    const double left = residual.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, residual.size()));
    result.von_neumann_ratio = residual.size() > 0 ? noise.variance / std::max(left, 1e-300) : -1.0;
    if (result.columns.differences.empty() || round == 1) break;
    differences.noise = noise.tau * std::max(left, 1e-12);
    differences.variance = friction_effects_of(result.columns, setting, direction, weights, differences.noise, policy_);
  }
  return noise;
}

StabilitySelection::SettingResult StabilitySelection::evaluate_setting(const BandwidthSamples& samples, bool mask,
                                                                       std::uint64_t seed) const {
  SettingResult result;
  std::vector<int> places;
  for (std::size_t t = 0; t < samples.terms.size(); ++t) {
    if (is_left_out(samples.table.terms[t].name)) continue;
    places.push_back(static_cast<int>(t));
    result.terms.push_back(samples.terms[t]);
  }
  // Presliding shows around reversals alone.
  const ChosenColumns chosen = choose_columns(samples.table, places, !mask && !is_left_out(kPresliding));
  const Setting setting = make_setting(samples.table, chosen, mask, false, policy_);
  if (setting.blocks.size() < 4 || static_cast<double>(setting.rows.rows()) <
                                       policy_.fewest_rows_per_column * static_cast<double>(chosen.table.model_columns))
    return result;
  result.columns = chosen.table;
  std::vector<double> weights = record_weights(result.columns, setting);
  FrictionRandomEffects differences{result.columns.differences, {}, 0.0};
  const Noise noise = noise_of_best(setting, weights, differences, result);
  select_on_halves(setting, weights, differences, noise, seed, result);

  const Setting held = make_setting(samples.table, chosen, mask, true, policy_);
  if (held.blocks.empty()) return result;
  // A record that was not fitted on has no variance of its own: it counts as the median of the others.
  const double usual = median_of_positive(weights);
  for (double& w : weights) w = w > 0.0 ? w : usual;
  result.held_out = sum_of(held, weights, differences);
  return result;
}

void StabilitySelection::select_on_halves(const Setting& setting, const std::vector<double>& weights,
                                          const FrictionRandomEffects& differences, const Noise& noise,
                                          std::uint64_t seed, SettingResult& result) const {
  constexpr std::size_t kTogether = 8;  // pairs: as many as leave their products in memory that is near
  std::mt19937_64 chance(seed);
  std::size_t records = 0;
  for (const double w : weights) records += w > 0.0 ? 1 : 0;
  std::vector<std::vector<std::uint8_t>> in;
  for (std::size_t pair = 0; pair < policy_.pairs; ++pair) {
    const bool by_record = records >= policy_.fewest_records_to_split && pair % 2 == 1;
    in.push_back(by_record ? half_of_records(setting, chance) : half_of_blocks(setting, chance));
    if (in.size() < kTogether && pair + 1 < policy_.pairs) continue;
    for (const auto& [a, b] : halves_of(setting, weights, in, differences)) {
      result.votes.push_back(select_forward(result.columns, a, b, noise, policy_));
      result.votes.push_back(select_forward(result.columns, b, a, noise, policy_));
    }
    in.clear();
  }
  for (SelectionPath& vote : result.votes)
    for (SelectionStep& step : vote.steps)
      if (step.term != kPreslidingTerm) step.term = result.terms[static_cast<std::size_t>(step.term)];
}

namespace {

// How often a term was chosen, over the subsamples of all settings.
struct Count {
  Frequency f;
  double chosen = 0.0, first = 0.0;
  // With reversals, and without: subsamples that it was offered to, those of them that voted (did not abstain), and
  // those that chose it or something hardly better.
  std::array<double, 2> offered{}, voted{}, chosen_or_near{};
  double all() const { return voted[0] + voted[1]; }
  std::map<std::string, double> alternatives;
  std::vector<double> shares;
};
using Counts = std::map<std::string, Count>;

const std::string& name_of(const RegressorTable& table, int term) {
  static const std::string presliding = kPresliding;
  return term == kPreslidingTerm ? presliding : table.terms[static_cast<std::size_t>(term)].name;
}

// Terms by name that a subsample of a setting may count for, or against; null: presliding.
using OfferedTerms = std::map<std::string, const CandidateTerm*>;

// Counts a subsample that does not abstain: each offered name once, although a law may have been taken at two values of
// its nonlinear parameter.
void count_steps(const RegressorTable& table, const SelectionPath& vote, bool mask, const OfferedTerms& offered,
                 Counts& counts) {
  struct Chosen {
    double share = 0.0;
    std::set<std::string> alternatives;
  };
  std::map<std::string, Chosen> chosen;
  std::set<std::string> near;
  for (const SelectionStep& s : vote.steps) {
    Chosen& one = chosen[name_of(table, s.term)];
    one.share += s.of_all;
    one.alternatives.insert(s.alternatives.begin(), s.alternatives.end());
    near.insert(s.alternatives.begin(), s.alternatives.end());
  }
  const auto is_offered = [&](const std::string& name) { return offered.count(name) != 0; };
  for (const auto& [name, one] : chosen) {
    if (!is_offered(name)) continue;
    Count& c = counts[name];
    c.chosen += 1.0;
    c.shares.push_back(one.share);
    for (const std::string& other : one.alternatives)
      if (other != name && is_offered(other)) c.alternatives[other] += 1.0;
    near.insert(name);
  }
  for (const std::string& name : near)
    if (is_offered(name)) counts[name].chosen_or_near[mask ? 1 : 0] += 1.0;
  if (!vote.steps.empty() && is_offered(name_of(table, vote.steps.front().term)))
    counts[name_of(table, vote.steps.front().term)].first += 1.0;
}

// Of a term that was chosen at least once.
Frequency frequency_of(Count& c) {
  c.f.frequency = c.chosen / c.all();
  c.f.first = c.first / c.all();
  c.f.near = (c.chosen_or_near[0] + c.chosen_or_near[1]) / c.all();
  c.f.least_near_by_mask = 1.0;
  for (const std::size_t mask : {0, 1})
    if (c.offered[mask] > 0.0)
      c.f.least_near_by_mask = std::min(c.f.least_near_by_mask, c.chosen_or_near[mask] / std::max(1.0, c.voted[mask]));
  for (const auto& [other, times] : c.alternatives)
    if (times >= kPolicy.often_similar * c.chosen) c.f.alternatives.emplace_back(other, times / c.chosen);
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
  const RegressorTable& table = tables_.table;
  Counts counts;
  std::vector<double> white;
  for (std::size_t i = 0; i < per_setting_.size(); ++i) {
    if (per_setting_[i].votes.empty()) continue;
    OfferedTerms offered;
    for (const int t : per_setting_[i].terms) {
      const CandidateTerm& term = table.terms[static_cast<std::size_t>(t)];
      offered[term.name] = &term;
    }
    if (tables_.shows_presliding(tables_.settings[i]) && !is_left_out(kPresliding)) offered[kPresliding] = nullptr;
    for (const SelectionPath& vote : per_setting_[i].votes) {
      result_.subsamples += 1.0;
      for (const auto& [name, term] : offered) counts[name].offered[tables_.settings[i].second ? 1 : 0] += 1.0;
      if (vote.abstains) {
        result_.abstained += 1.0;
        continue;
      }
      for (const auto& [name, term] : offered) {
        Count& c = counts[name];
        c.f.name = name;
        if (term) {
          c.f.entry = term->entry;
          c.f.order = term->order;
        }
        c.voted[tables_.settings[i].second ? 1 : 0] += 1.0;
      }
      count_steps(table, vote, tables_.settings[i].second, offered, counts);
    }
  }
  for (std::size_t i = 0; i < per_setting_.size(); ++i)
    if (tables_.settings[i].second && per_setting_[i].von_neumann_ratio >= 0.0 &&
        tables_.settings[i].first <= 1.01 * tables_.bandwidth.highest_hz)
      white.push_back(std::min(1.0, per_setting_[i].von_neumann_ratio));
  result_.von_neumann_ratio = numbers::upper_median(white);
  for (auto& [name, c] : counts)
    if (c.chosen > 0.0 && c.all() > 0.0) result_.frequencies.push_back(frequency_of(c));
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
    for (std::size_t t = 0; t < setting.columns.terms.size(); ++t) {
      if (setting.columns.terms[t].name != name || setting.columns.terms[t].is_delayed) continue;
      chosen.push_back(static_cast<int>(t));
      const double squares = fit_terms(setting.columns, chosen, setting.all, setting.all).training_squares;
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
  for (std::size_t at = 0; at < per_setting_.size(); ++at) {
    const SettingResult& setting = per_setting_[at];
    if (setting.held_out.rows == 0.0) continue;
    // Terms that are not visible at this bandwidth, or without reversals, are left out of all fits.
    std::vector<std::string> seen;
    for (const std::string& name : names)
      if (!terms_of(setting, {name}).empty()) seen.push_back(name);
    const double with_all =
        fit_terms(setting.columns, terms_of(setting, seen), setting.all, setting.held_out).validation_squares;
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::vector<std::string> others = seen;
      if (std::erase(others, names[i]) == 0) continue;
      if (names[i] == kPresliding && !tables_.shows_presliding(tables_.settings[at])) continue;
      const double without =
          fit_terms(setting.columns, terms_of(setting, others), setting.all, setting.held_out).validation_squares;
      if (without > 0.0) ratios[i].push_back(std::sqrt(with_all / without));
    }
  }
  std::vector<double> medians;
  for (const std::vector<double>& r : ratios)
    if (!r.empty()) medians.push_back(numbers::upper_median(r));
  return medians.size() == names.size() ? medians : std::vector<double>{};
}

}  // namespace flexspline::selection
