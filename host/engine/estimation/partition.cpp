#include "host/engine/estimation/partition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>
#include <utility>

#include "host/engine/estimation/build_balances.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::estimation {
namespace {

bool has_free_nonlinear(const Term& term) {
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.free_nonlinear(p)) return true;
  return false;
}

// Puts the parameters of one fit before those of another one on the same balance.
void put_before(BalanceFit& fit, const BalanceFit& first, const std::vector<std::size_t>& term_now) {
  std::vector<ParameterRef> linear;
  for (ParameterRef ref : first.linear) {
    ref.term = term_now[ref.term];
    linear.push_back(ref);
  }
  const auto before = static_cast<Eigen::Index>(linear.size());
  const Eigen::Index after = fit.covariance.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(before + after, before + after);
  covariance.topLeftCorner(before, before) = first.covariance.topLeftCorner(before, before);
  covariance.bottomRightCorner(after, after) = fit.covariance;
  Eigen::VectorXd own(before + after);
  own << first.root_tolerance.head(before), fit.root_tolerance;
  Eigen::VectorXd excitation(before + after);
  excitation << first.excitation.head(before), fit.excitation;
  linear.insert(linear.end(), fit.linear.begin(), fit.linear.end());
  fit.linear = std::move(linear);
  fit.covariance = std::move(covariance);
  fit.root_tolerance = std::move(own);
  fit.excitation = std::move(excitation);
  fit.condition_number = std::max(fit.condition_number, first.condition_number);
}

}  // namespace

namespace {

using Experiments = std::vector<const data::Experiment*>;

// Fast records first and slow ones second (report 3.4: a composite, then a slow saw-tooth).
struct FastAndSlow {
  Experiments fast, slow;
};

// Root mean square of the motor's velocity, as measured.
double speed_of(const data::Experiment& e) {
  double squares = 0.0, seconds = 0.0;
  const bool from_position = e.has(data::Column::motor_position);
  if (!from_position && !e.has(data::Column::motor_velocity)) return 0.0;
  // Over a tenth of a second: differences of neighbours would show the encoder's steps.
  const auto apart = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(0.1 / e.sample_s)));
  for (const data::Segment& s : e.segments)
    for (std::size_t k = s.first + apart; k < s.last; k += apart) {
      const double v = from_position
                           ? (e[data::Column::motor_position][k] - e[data::Column::motor_position][k - apart]) /
                                 (static_cast<double>(apart) * e.sample_s)
                           : e[data::Column::motor_velocity][k];
      squares += v * v;
      seconds += 1.0;
    }
  return seconds > 0.0 ? std::sqrt(squares / seconds) : 0.0;
}

// Records at the widest gap between their speeds, if it is wide; else none, and all records serve both parts.
FastAndSlow by_speed(const Experiments& experiments) {
  constexpr double kWide = 3.0;
  std::vector<std::pair<double, const data::Experiment*>> speeds;
  for (const data::Experiment* e : experiments)
    if (const double v = speed_of(*e); v > 0.0) speeds.emplace_back(v, e);
  std::ranges::stable_sort(speeds, {}, [](const auto& one) { return one.first; });
  std::size_t first_fast = 0;
  double widest = kWide;
  for (std::size_t k = 1; k < speeds.size(); ++k)
    if (const double ratio = speeds[k].first / speeds[k - 1].first; ratio >= widest) {
      widest = ratio;
      first_fast = k;
    }
  FastAndSlow found;
  for (std::size_t k = 0; first_fast > 0 && k < speeds.size(); ++k)
    (k < first_fast ? found.slow : found.fast).push_back(speeds[k].second);
  return found;
}

// Whether what is left for the second part shows at low speed.
bool shows_at_low_speed(const Terms& terms) {
  for (const Term& term : terms)
    for (std::size_t p = 0; p < term.values.size(); ++p)
      if (term.free_nonlinear(p) && term.entry->parameters[p].limit == effects::Limit::velocity) return true;
  return false;
}

// Puts the values of the first part into the terms of the second one, as known; returns which they are, and in
// `term_now` where its terms are.
std::vector<ParameterRef> plug_in(const Identification& first, Identification& all,
                                  std::vector<std::size_t>& term_now) {
  term_now.assign(first.terms.size(), 0);
  std::vector<ParameterRef> plugged_in;
  for (std::size_t t = 0; t < first.terms.size(); ++t)
    for (std::size_t now = 0; now < all.terms.size(); ++now) {
      if (all.terms[now].id != first.terms[t].id) continue;
      term_now[t] = now;
      for (std::size_t p = 0; p < all.terms[now].values.size(); ++p) {
        if (!all.terms[now].free_linear(p)) continue;
        all.terms[now].values[p] = first.terms[t].values[p];
        all.terms[now].known[p] = 1;
        plugged_in.push_back({now, p});
      }
    }
  return plugged_in;
}

std::string names_of(const Experiments& experiments) {
  constexpr std::size_t kMost = 4;
  std::string list;
  for (std::size_t k = 0; k < std::min(kMost, experiments.size()); ++k)
    list += (k > 0 ? ", " : "") + experiments[k]->name;
  return experiments.size() > kMost ? fmt::format("{} and {} more", list, experiments.size() - kMost) : list;
}

// The second part on the slow records; estimates of the first part are those of the fast ones.
std::unique_ptr<Identification> fast_then_slow(const FastAndSlow& records, const data::Dataset& dataset,
                                               const model::Model& model, const model::Model& simple,
                                               const PipelineOptions& pipeline) {
  PipelineOptions own = pipeline;
  own.ready = nullptr;
  auto first = build_balances_from(records.fast, dataset, simple, own);
  fit(*first);
  compute_estimates(*first);
  auto all = build_balances_from(records.slow, dataset, model, own);
  std::vector<std::size_t> term_now;
  const std::vector<ParameterRef> plugged_in = plug_in(*first, *all, term_now);
  fit(*all);
  compute_estimates(*all);
  for (const ParameterRef& ref : plugged_in) all->terms[ref.term].known[ref.parameter] = 0;
  std::erase_if(all->estimates, [&](const Estimate& e) { return std::ranges::count(plugged_in, e.ref) > 0; });
  std::vector<Estimate> estimates = first->estimates;
  for (Estimate& e : estimates) e.ref.term = term_now[e.ref.term];
  estimates.insert(estimates.end(), all->estimates.begin(), all->estimates.end());
  all->estimates = std::move(estimates);
  all->derived = first->derived;
  all->condition_number = std::max(all->condition_number, first->condition_number);
  all->warnings.insert(all->warnings.end(), first->warnings.begin(), first->warnings.end());
  all->warnings.push_back(
      fmt::format("linear parameters are those of the fast records ({}), the others those of the "
                  "slow ones ({})",
                  names_of(records.fast), names_of(records.slow)));
  store(all->model, all->estimates);
  return all;
}

}  // namespace

std::unique_ptr<Identification> partitioned(const data::Dataset& dataset, const model::Model& model,
                                            const PipelineOptions& pipeline) {
  model::Model simple = model;
  std::erase_if(simple.effects, [](const model::Effect& effect) { return has_free_nonlinear(term_of(effect)); });
  if (simple.effects.empty() || simple.effects.size() == model.effects.size()) {
    auto all = build_balances(dataset, model, pipeline);
    fit(*all);
    compute_estimates(*all);
    return all;
  }
  if (shows_at_low_speed(terms_of(model))) {
    const FastAndSlow records = by_speed(experiments_to_fit(dataset));
    if (!records.fast.empty()) return fast_then_slow(records, dataset, model, simple, pipeline);
  }
  auto all = build_balances(dataset, model, pipeline);
  auto first = build_balances(dataset, simple, pipeline);
  fit(*first);
  std::vector<std::size_t> term_now;
  const std::vector<ParameterRef> plugged_in = plug_in(*first, *all, term_now);
  fit(*all);
  for (const ParameterRef& ref : plugged_in) all->terms[ref.term].known[ref.parameter] = 0;
  for (BalanceFit& fit : all->fits)
    for (const BalanceFit& before : first->fits)
      if (before.balance == fit.balance) put_before(fit, before, term_now);
  all->warnings.insert(all->warnings.end(), first->warnings.begin(), first->warnings.end());
  compute_estimates(*all);
  return all;
}

void search_from_several_starts(Identification& identification, int starts, std::uint64_t seed) {
  constexpr double kLike = 1e-3;   // of the sum of squares
  constexpr double kApart = 0.05;  // of a nonlinear parameter's range
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (std::size_t b = 0; b < identification.fits.size(); ++b) {
    BalanceFit& fit = identification.fits[b];
    const RegressionProblem& data = identification.data[b];
    std::vector<ParameterRef> open;
    for (const ParameterRef& ref : fit.nonlinear)
      if (!identification.terms[ref.term].stated[ref.parameter]) open.push_back(ref);
    if (open.empty()) continue;
    Terms best = identification.terms;
    double least = refine_nonlinear(data, best, fit.on_balance, fit.root_weights);
    const double swept = least;
    bool ends_apart = false;
    for (int start = 1; start < starts; ++start) {
      Terms candidate = identification.terms;
      for (const ParameterRef& ref : open)
        candidate[ref.term].values[ref.parameter] =
            parameter_range(data, candidate[ref.term], ref.parameter).at(share(random));
      const double cost = refine_nonlinear(data, candidate, fit.on_balance, fit.root_weights);
      bool apart = false;
      for (const ParameterRef& ref : open) {
        const ParameterRange range = parameter_range(data, candidate[ref.term], ref.parameter);
        apart = apart || std::abs(range.share(candidate[ref.term].values[ref.parameter]) -
                                  range.share(best[ref.term].values[ref.parameter])) > kApart;
      }
      ends_apart = ends_apart || (apart && std::abs(cost - least) < kLike * least);
      if (cost < least) {
        least = cost;
        best = candidate;
      }
    }
    if (ends_apart)
      identification.warnings.push_back(
          "searches from several starts end at different nonlinear parameters with the same error: these data do not "
          "identify them (--intervals profile shows how far)");
    if (least > (1.0 - 1e-6) * swept) continue;
    // From the better place, as if the model stated it.
    for (const ParameterRef& ref : open) {
      const Term& term = best[ref.term];
      identification.terms[ref.term].values[ref.parameter] = term.values[ref.parameter];
      identification.terms[ref.term].stated[ref.parameter] = 1;
    }
    std::vector<std::string> warnings;
    std::tie(fit, identification.at_bound[b]) =
        fit_within_bounds(data, identification.terms, identification.model.drive.axis, warnings);
    for (std::string& warning : warnings)
      if (std::ranges::find(identification.warnings, warning) == identification.warnings.end())
        identification.warnings.push_back(std::move(warning));
  }
}

}  // namespace flexspline::estimation
