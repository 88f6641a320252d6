#include "host/diagnosis/detectable.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/regression/shapes.hpp"

namespace flexspline::diagnosis {
namespace {

using effects::Kind;
using regression::Term;

// Nobody would call it an effect beyond that many times the usual size.
constexpr double kLargestScale = 1e6;
// Of the least shape that the search looks at: nothing is told of an effect that is that small.
constexpr double kUnseen = 1e-3;

std::vector<double> usual_values(const catalogue::Entry& entry) {
  std::vector<double> usual;
  for (const auto& info : entry.parameters) usual.push_back(info.usual);
  return catalogue::reduced(entry, usual);
}

// Shapes as usual, on the nearest point of the search's grid; a candidate that is named keeps those it was found with.
void settle_shapes(const BalanceData& data, const Trial& trial, Term& term) {
  if (passes(trial)) return;
  const std::vector<double> usual = usual_values(*term.entry);
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    if (!term.free_shape(p) || begins_at_nought(term, p)) continue;
    double nearest = term.values[p], least = 1e300;
    const regression::ShapeRange range = regression::shape_range(data, term, p);
    for (const double value : regression::shape_grid(range, kGridPoints))
      if (const double away = std::abs(range.share(value) - range.share(usual[p])); away < least) {
        least = away;
        nearest = value;
      }
    term.values[p] = nearest;
  }
}

regression::Estimate estimate(const Search& search, const Term& term, std::size_t p, double value) {
  const auto axis = search.data->prepared().rotary ? data::Axis::rotary : data::Axis::linear;
  regression::Estimate e;
  e.id = term.id;
  e.effect = std::string(term.entry->name());
  e.parameter = std::string(term.entry->parameters[p].name);
  e.unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, axis));
  e.value = value;
  return e;
}

// Free shapes at which a size was found, in their own units; without `size` itself.
std::vector<regression::Estimate> shapes_of(const Search& search, const Term& term, std::size_t size) {
  std::vector<regression::Estimate> list;
  const std::vector<double> natural = catalogue::natural(*term.entry, term.values);
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (p != size && term.free_shape(p)) list.push_back(estimate(search, term, p, natural[p]));
  return list;
}

bool is_wave(const catalogue::Entry& entry) {
  return entry.index_of("cosine") < entry.parameters.size() && entry.index_of("sine") < entry.parameters.size();
}

}  // namespace

Detection::Detection(Search& search)
    : search_(&search),
      imitation_(model_columns(*search.data, search.base.terms), search.base.root_weights),
      base_torque_(model_torque(*search.data, search.base.terms)) {}

// What the search would find: its own score, with the squares of what the effect adds in the place of those of a base
// model that lacks it.
bool Detection::named(const Trial& trial, const Eigen::VectorXd& own, double scale) const {
  Judged with, without;
  with.left_out = without.left_out = trial.judged.left_out;
  with.sums = without.sums = trial.judged.sums;
  with.deviations = without.deviations = trial.judged.deviations;
  with.autocorrelation_time = trial.judged.autocorrelation_time;
  without.autocorrelation_time = search_->base.autocorrelation_time;
  const auto& records = search_->data->records();
  for (std::size_t i = 0; i < records.size(); ++i) {
    double squares = 0.0;
    for (Eigen::Index k = records[i].first; k < records[i].last; ++k)
      if (search_->base.root_weights[k] > 0.0) squares += own[k] * own[k];
    without.left_out[i].squares += scale * scale * squares;
  }
  const Fall fall = fall_of(without, with, trial.proposal.added);
  return fall.score > kNamedScore && fall.chi2_percent > kNamedFallPercent;
}

std::optional<double> Detection::scale_to_name(const Trial& trial, const Eigen::VectorXd& torque) const {
  if (imitation_.own_share(torque) < kOwnShare) return std::nullopt;
  const Eigen::VectorXd own = imitation_.own_part(torque);
  double high = 1.0 / kLargestScale;
  while (high < kLargestScale && !named(trial, own, high)) high *= 4.0;
  if (high >= kLargestScale) return std::nullopt;
  double low = high / 4.0;
  for (int i = 0; i < 20; ++i) {
    const double middle = std::sqrt(low * high);
    (named(trial, own, middle) ? high : low) = middle;
  }
  return high;
}

std::optional<Detectable> Detection::of_linear(const Trial& trial, regression::Terms terms, BalanceData& data) const {
  Term& term = terms.back();
  const std::vector<double> usual = usual_values(*term.entry);
  Eigen::VectorXd torque = Eigen::VectorXd::Zero(search_->data->rows());
  std::size_t first = term.values.size();
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    if (!term.free_linear(p) || usual[p] == 0.0) continue;
    first = std::min(first, p);
    torque += usual[p] * data.column(terms, {terms.size() - 1, p});
  }
  const auto scale = first < term.values.size() ? scale_to_name(trial, torque) : std::nullopt;
  if (!scale) return std::nullopt;
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.free_linear(p)) term.values[p] = *scale * usual[p];
  const double value = catalogue::natural(*term.entry, term.values)[first];
  return Detectable{estimate(*search_, term, first, std::abs(value)), false, shapes_of(*search_, term, first)};
}

std::optional<Detectable> Detection::of_wave(const Trial& trial, regression::Terms terms, BalanceData& data) const {
  Term& term = terms.back();
  const std::size_t cosine = term.entry->index_of("cosine"), sine = term.entry->index_of("sine");
  const double usual = std::hypot(usual_values(*term.entry)[cosine], usual_values(*term.entry)[sine]);
  constexpr int kPhases = 4;
  std::optional<double> largest;
  // Torques are all but linear in the size, so two of them make all phases.
  Eigen::VectorXd parts[2];
  for (int i = 0; i < 2; ++i) {
    term.values[cosine] = i == 0 ? usual : 0.0;
    term.values[sine] = i == 0 ? 0.0 : usual;
    parts[i] = model_torque(data, terms) - base_torque_;
  }
  for (int i = 0; i < kPhases; ++i) {
    const double phase = std::numbers::pi * i / kPhases;
    const auto scale = scale_to_name(trial, std::cos(phase) * parts[0] + std::sin(phase) * parts[1]);
    if (!scale) return std::nullopt;
    largest = std::max(largest.value_or(0.0), *scale);
  }
  Detectable found{estimate(*search_, term, cosine, *largest * usual), false, {}};
  found.size.parameter = "amplitude";
  return found;
}

// A size that the torque is not proportional to: the first value, from where the effect vanishes, that would be named.
std::optional<Detectable> Detection::of_shape(const Trial& trial, regression::Terms terms, BalanceData& data) const {
  Term& term = terms.back();
  std::size_t size = 0;
  while (size < term.values.size() && !term.free_shape(size)) ++size;
  if (size == term.values.size()) return std::nullopt;
  const auto torque_at = [&](double value) -> Eigen::VectorXd {
    term.values[size] = value;
    return model_torque(data, terms) - base_torque_;
  };
  const auto& info = term.entry->parameters[size];
  if (info.low < 0.0 && info.per.empty()) {
    // Of either sign, and all but proportional about nought.
    const double step = 0.01 * usual_values(*term.entry)[size];
    const auto scale = scale_to_name(trial, torque_at(step));
    if (!scale) return std::nullopt;
    return Detectable{estimate(*search_, term, size, *scale * step), false, shapes_of(*search_, term, size)};
  }
  const auto would_name = [&](const Eigen::VectorXd& torque) {
    return imitation_.own_share(torque) > kOwnShare && named(trial, imitation_.own_part(torque), 1.0);
  };
  const regression::ShapeRange range = regression::shape_range(*search_->data, term, size);
  const Eigen::VectorXd at_low = torque_at(range.low), at_high = torque_at(range.high);
  // The end at which it does less is the one where it vanishes.
  const bool falls = at_low.norm() > at_high.norm();
  if (!would_name(falls ? at_low : at_high)) return std::nullopt;
  double with = range.at(falls ? 0.0 : 1.0), without = range.at(falls ? 1.0 : 0.0);
  // A size below what the search looks at passes for the least that it does.
  if (would_name(falls ? at_high : at_low)) without = falls || !range.logarithmic ? with : kUnseen * range.low;
  if (without == with) return std::nullopt;
  for (int i = 0; i < 10; ++i) {
    const double middle = range.logarithmic ? std::sqrt(with * without) : 0.5 * (with + without);
    (would_name(torque_at(middle)) ? with : without) = middle;
  }
  term.values[size] = with;
  const double value = catalogue::natural(*term.entry, term.values)[size];
  return Detectable{estimate(*search_, term, size, value), falls, shapes_of(*search_, term, size)};
}

std::optional<Detectable> Detection::smallest(const Trial& trial, BalanceData& data) const {
  regression::Terms terms = trial.judged.terms;
  Term& term = terms.back();
  settle_shapes(*search_->data, trial, term);
  if (is_wave(*term.entry)) return of_wave(trial, std::move(terms), data);
  // What takes the place of another effect has the size of that one.
  if (term.entry->count(Kind::linear) > 0 && term.entry->info->replaces.empty())
    return of_linear(trial, std::move(terms), data);
  return of_shape(trial, std::move(terms), data);
}

}  // namespace flexspline::diagnosis
