#include "host/engine/selection/detection_limit.hpp"
#include "host/engine/selection/policy.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::selection {
namespace {

using effects::Kind;
using estimation::Term;

// Beyond that many times the usual size it is not a plausible effect.
constexpr double kLargestScale = 1e6;
// Of the least nonlinear parameter that the search tries: an effect that is that small is not identifiable.
constexpr double kUnseen = 1e-3;

std::vector<double> usual_values(const catalogue::Entry& entry) {
  std::vector<double> usual;
  for (const auto& info : entry.parameters) usual.push_back(info.usual);
  return catalogue::reduced(entry, usual);
}

// Nonlinear parameters as usual, on the nearest point of the search's grid; a candidate that is named keeps those it
// was found with.
void set_usual_nonlinear(const RegressionProblem& data, const CandidateFit& candidate, Term& term) {
  if (passes(candidate)) return;
  const std::vector<double> usual = usual_values(*term.entry);
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    if (!term.free_nonlinear(p) || begins_at_zero(term, p)) continue;
    double nearest = term.values[p], least = 1e300;
    const estimation::ParameterRange range = estimation::parameter_range(data, term, p);
    for (const double value : estimation::parameter_grid(range, kGridPoints))
      if (const double away = std::abs(range.share(value) - range.share(usual[p])); away < least) {
        least = away;
        nearest = value;
      }
    term.values[p] = nearest;
  }
}

estimation::Estimate estimate(const BalanceSearch& search, const Term& term, std::size_t p, double value) {
  const auto axis = search.data->prepared().rotary ? data::Axis::rotary : data::Axis::linear;
  estimation::Estimate e;
  e.id = term.id;
  e.effect = std::string(term.entry->name());
  e.parameter = std::string(term.entry->parameters[p].name);
  e.unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, axis));
  e.value = value;
  return e;
}

// Free nonlinear parameters at which a size was found, in their own units; without `size` itself.
std::vector<estimation::Estimate> nonlinear_values_of(const BalanceSearch& search, const Term& term, std::size_t size) {
  std::vector<estimation::Estimate> list;
  const std::vector<double> natural = catalogue::natural(*term.entry, term.values);
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (p != size && term.free_nonlinear(p)) list.push_back(estimate(search, term, p, natural[p]));
  return list;
}

bool is_wave(const catalogue::Entry& entry) {
  return entry.index_of("cosine") < entry.parameters.size() && entry.index_of("sine") < entry.parameters.size();
}

}  // namespace

DetectionLimit::DetectionLimit(const BalanceSearch& search)
    : search_(&search),
      coarse_(search.data->decimated()),
      projection_(estimation::model_columns(*search.data, search.base.terms), search.base.root_weights),
      base_torque_(estimation::model_torque(coarse_, search.base.terms)) {}

// The expected score of the search: noise plus the squares of the effect's orthogonal part, against noise alone.
bool DetectionLimit::named(const CandidateFit& candidate, const Eigen::VectorXd& own, double scale) const {
  CrossValidatedFit with, without;
  with.left_out = without.left_out = candidate.fit.left_out;
  with.errors = without.errors = candidate.fit.errors;
  with.random_effects = without.random_effects = candidate.fit.random_effects;
  with.autocorrelation_time = candidate.fit.autocorrelation_time;
  without.autocorrelation_time = search_->base.autocorrelation_time;
  const auto& records = search_->data->records();
  for (std::size_t i = 0; i < records.size(); ++i) {
    double squares = 0.0;
    for (Eigen::Index k = records[i].first; k < records[i].last; ++k)
      if (search_->base.root_weights[k] > 0.0) squares += own[k] * own[k];
    without.left_out[i].squares += scale * scale * squares;
  }
  const LikelihoodGain gain = likelihood_gain(without, with, candidate.model.added);
  return gain.score > kPolicy.named_score && gain.chi2_percent > kPolicy.named_chi2_percent;
}

std::optional<double> DetectionLimit::scale_to_name(const CandidateFit& candidate,
                                                    const Eigen::VectorXd& torque) const {
  if (projection_.orthogonal_share(torque) < kPolicy.least_orthogonal_share) return std::nullopt;
  const Eigen::VectorXd own = projection_.orthogonal_part(torque);
  double high = 1.0 / kLargestScale;
  while (high < kLargestScale && !named(candidate, own, high)) high *= 4.0;
  if (high >= kLargestScale) return std::nullopt;
  double low = high / 4.0;
  for (int i = 0; i < 20; ++i) {
    const double middle = std::sqrt(low * high);
    (named(candidate, own, middle) ? high : low) = middle;
  }
  return high;
}

std::optional<Detectable> DetectionLimit::of_linear(const CandidateFit& candidate, estimation::Terms terms) const {
  Term& term = terms.back();
  const std::vector<double> usual = usual_values(*term.entry);
  Eigen::VectorXd torque = Eigen::VectorXd::Zero(search_->data->rows());
  std::size_t first = term.values.size();
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    if (!term.free_linear(p) || usual[p] == 0.0) continue;
    first = std::min(first, p);
    torque += usual[p] * search_->data->column(terms, {terms.size() - 1, p});
  }
  const auto scale = first < term.values.size() ? scale_to_name(candidate, torque) : std::nullopt;
  if (!scale) return std::nullopt;
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.free_linear(p)) term.values[p] = *scale * usual[p];
  const double value = catalogue::natural(*term.entry, term.values)[first];
  return Detectable{estimate(*search_, term, first, std::abs(value)), false,
                    nonlinear_values_of(*search_, term, first)};
}

std::optional<Detectable> DetectionLimit::of_wave(const CandidateFit& candidate, estimation::Terms terms) const {
  Term& term = terms.back();
  const std::size_t cosine = term.entry->index_of("cosine"), sine = term.entry->index_of("sine");
  const double usual = std::hypot(usual_values(*term.entry)[cosine], usual_values(*term.entry)[sine]);
  constexpr int kPhases = 4;
  std::optional<double> largest;
  // Torques are almost linear in the size, so the waves of two phases give those of all phases.
  Eigen::VectorXd parts[2];
  for (int i = 0; i < 2; ++i) {
    term.values[cosine] = i == 0 ? usual : 0.0;
    term.values[sine] = i == 0 ? 0.0 : usual;
    parts[i] = estimation::model_torque(coarse_, terms) - base_torque_;
  }
  for (int i = 0; i < kPhases; ++i) {
    const double phase = std::numbers::pi * i / kPhases;
    const auto scale = scale_to_name(candidate, std::cos(phase) * parts[0] + std::sin(phase) * parts[1]);
    if (!scale) return std::nullopt;
    largest = std::max(largest.value_or(0.0), *scale);
  }
  Detectable found{estimate(*search_, term, cosine, *largest * usual), false, {}};
  found.size.parameter = "amplitude";
  return found;
}

// A size that the torque is not proportional to: the first value, from where the effect vanishes, that would be named.
std::optional<Detectable> DetectionLimit::of_nonlinear(const CandidateFit& candidate, estimation::Terms terms) const {
  Term& term = terms.back();
  std::size_t size = 0;
  while (size < term.values.size() && !term.free_nonlinear(size)) ++size;
  if (size == term.values.size()) return std::nullopt;
  const auto torque_at = [&](double value) -> Eigen::VectorXd {
    term.values[size] = value;
    return estimation::model_torque(coarse_, terms) - base_torque_;
  };
  const auto& info = term.entry->parameters[size];
  if (info.low < 0.0 && info.per.empty()) {
    // Of either sign, and all but proportional about zero.
    const double step = 0.01 * usual_values(*term.entry)[size];
    const auto scale = scale_to_name(candidate, torque_at(step));
    if (!scale) return std::nullopt;
    return Detectable{estimate(*search_, term, size, *scale * step), false, nonlinear_values_of(*search_, term, size)};
  }
  const auto would_name = [&](const Eigen::VectorXd& torque) {
    return projection_.orthogonal_share(torque) > kPolicy.least_orthogonal_share &&
           named(candidate, projection_.orthogonal_part(torque), 1.0);
  };
  const estimation::ParameterRange range = estimation::parameter_range(*search_->data, term, size);
  const Eigen::VectorXd at_low = torque_at(range.low), at_high = torque_at(range.high);
  // The effect vanishes at the end of the range with the smaller torque.
  const bool decreases = at_low.norm() > at_high.norm();
  if (!would_name(decreases ? at_low : at_high)) return std::nullopt;
  double with = range.at(decreases ? 0.0 : 1.0), without = range.at(decreases ? 1.0 : 0.0);
  // A size below the range of the search is reported as the least of that range.
  if (would_name(decreases ? at_high : at_low)) without = decreases || !range.logarithmic ? with : kUnseen * range.low;
  if (without == with) return std::nullopt;
  for (int i = 0; i < 10; ++i) {
    const double middle = range.logarithmic ? std::sqrt(with * without) : 0.5 * (with + without);
    (would_name(torque_at(middle)) ? with : without) = middle;
  }
  term.values[size] = with;
  const double value = catalogue::natural(*term.entry, term.values)[size];
  return Detectable{estimate(*search_, term, size, value), decreases, nonlinear_values_of(*search_, term, size)};
}

std::optional<Detectable> DetectionLimit::smallest(const CandidateFit& candidate) const {
  estimation::Terms terms = candidate.fit.terms;
  Term& term = terms.back();
  set_usual_nonlinear(*search_->data, candidate, term);
  if (is_wave(*term.entry)) return of_wave(candidate, std::move(terms));
  // An effect that replaces another one has the size of that one.
  if (term.entry->count(Kind::linear) > 0 && term.entry->info->replaces.empty())
    return of_linear(candidate, std::move(terms));
  return of_nonlinear(candidate, std::move(terms));
}

}  // namespace flexspline::selection
