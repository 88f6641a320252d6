#include "host/engine/estimation/identify.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/regressor_evaluator.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/estimation/variable_projection.hpp"

namespace flexspline::estimation {
namespace {

// Each record fitted alone, with nonlinear parameters as pooled. Its error is its own: from its residual and that
// residual's autocorrelation, not from those of all records, which contain the differences between the records.
std::vector<AloneFit> fit_alone(const RegressionProblem& data, const BalanceFit& balance_fit, const Terms& terms) {
  const auto [X, y] = data.regression(terms, balance_fit.on_balance, balance_fit.linear);
  std::vector<AloneFit> all;
  for (const RowRange& range : data.records()) {
    AloneFit& fit = all.emplace_back();
    fit.name = data.prepared().records[range.record].name;
    if (range.size() < 4 * X.cols()) {
      fit.too_short = fmt::format("{} samples for {} parameters", range.size(), X.cols());
      continue;
    }
    LinearFit alone = least_squares(X.middleRows(range.first, range.size()), y.segment(range.first, range.size()),
                                    Eigen::VectorXd::Ones(range.size()));
    const double noise = alone.residual.squaredNorm() / static_cast<double>(range.size() - X.cols());
    const double rows_as_one = std::max(autocorrelation_time({{range.record, 0, range.size()}}, alone.residual),
                                        data.filter_autocorrelation_time());
    fit.theta = std::move(alone.theta);
    fit.root_tolerance = std::move(alone.root_tolerance);
    fit.covariance = alone.unit_covariance * (noise * rows_as_one);
  }
  for (const auto& [record, reason] : data.evaluator().left_out()) {
    AloneFit& fit = all.emplace_back();
    fit.name = data.prepared().records[record].name;
    fit.too_short = "too few samples are left after filtering and masking";
  }
  return all;
}

Estimate estimate_of(const Terms& terms, ParameterRef ref, data::Axis axis) {
  const Term& term = terms[ref.term];
  const auto& info = term.entry->parameters[ref.parameter];
  Estimate e;
  e.ref = ref;
  e.id = term.id;
  e.effect = std::string(term.entry->name());
  e.parameter = std::string(info.name);
  e.unit = std::string(catalogue::unit_on(info.unit, axis));
  e.value = catalogue::natural(*term.entry, term.values)[ref.parameter];
  e.fixed = term.known[ref.parameter] != 0;
  return e;
}

Estimate* find_estimate(std::vector<Estimate>& estimates, std::string_view effect, std::string_view parameter) {
  for (Estimate& e : estimates)
    if (e.effect == effect && e.parameter == parameter) return &e;
  return nullptr;
}

void take(ByExperiment from, ByExperiment& to) {
  to = std::move(from);
}

// The experiments' own fits of a balance.
struct AloneFits {
  std::vector<AloneFit> fits;
  std::vector<ParameterRef> linear;

  std::optional<Eigen::Index> column_of(ParameterRef ref) const {
    for (std::size_t j = 0; j < linear.size(); ++j)
      if (linear[j].term == ref.term && linear[j].parameter == ref.parameter) return static_cast<Eigen::Index>(j);
    return std::nullopt;
  }
};

// Tvp = Tv + dTv, Tvn = Tv - dTv and likewise for Coulomb friction (EFFECTS: derived values), where `odd` is half the
// difference between the directions of `even`. The spread of a difference of directions has little information; that of
// the two directions themselves is what the report compares.
void derive_directions(const std::vector<AloneFits>& balances, const Estimate& even, Estimate& odd,
                       std::string_view symbols, std::vector<Derived>& derived) {
  const std::vector<std::string_view> names = catalogue::split_names(symbols);
  std::size_t with_spread = 0, with_verdict = 0;
  double larger = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double sign = k == 0 ? 1.0 : -1.0;
    Derived d;
    d.name = std::string(names[k]);
    d.value = even.value + sign * odd.value;
    d.unit = even.unit;
    for (const AloneFits& alone : balances) {
      const auto first = alone.column_of(even.ref), second = alone.column_of(odd.ref);
      if (first && second) take(by_experiment(alone.fits, {*first, second, sign}), d);
    }
    with_spread += d.spread_percent.has_value();
    with_verdict += d.reliable.has_value();
    larger = std::max(larger, d.spread_percent.value_or(0.0));
    derived.push_back(std::move(d));
  }
  odd.spread_percent.reset();
  odd.reliable.reset();
  if (with_spread == 2) odd.spread_percent = larger;
  if (with_verdict == 2) odd.reliable = larger <= kReliableSpreadPercent;
}

void derive_directions(const std::vector<AloneFits>& balances, std::vector<Estimate>& estimates,
                       std::vector<Derived>& derived) {
  for (const catalogue::Entry& entry : catalogue::all()) {
    const effects::Description& info = *entry.info;
    if (info.asymmetry_of.empty()) continue;
    const Estimate* even =
        find_estimate(estimates, info.asymmetry_of, catalogue::get(info.asymmetry_of).parameters.front().name);
    Estimate* odd = find_estimate(estimates, entry.name(), entry.parameters.front().name);
    if (even && odd) derive_directions(balances, *even, *odd, info.direction_symbols, derived);
  }
}

// The free parameter whose column is most similar to that of `j`.
std::size_t likest(const Eigen::MatrixXd& X, std::size_t j) {
  std::size_t best = j;
  double most = 0.0;
  const auto column = X.col(static_cast<Eigen::Index>(j));
  for (Eigen::Index k = 0; k < X.cols(); ++k) {
    if (k == static_cast<Eigen::Index>(j)) continue;
    const double norm = column.norm() * X.col(k).norm();
    const double alike = norm > 0.0 ? std::abs(column.dot(X.col(k))) / norm : 0.0;
    if (alike > most) {
      most = alike;
      best = static_cast<std::size_t>(k);
    }
  }
  return best;
}

double share_of_range(const RegressionProblem& data, const Terms& terms, ParameterRef nonlinear_ref) {
  const Term& term = terms[nonlinear_ref.term];
  return parameter_range(data, term, nonlinear_ref.parameter).share(term.values[nonlinear_ref.parameter]);
}

// Standard error that more data do not take away: of filters and differentiation, measured on simulated drives whose
// noise leaves less (0.02 to 0.07 % of inertia and friction), and of a travel, which no encoder resolves within its
// step.
double beyond_noise(const RegressionProblem& data, const effects::ParameterInfo& info, double value) {
  constexpr double kPipeline = 5e-4;  // of the value
  constexpr double kOfAStep = 0.5;
  double step = 0.0;
  if (info.limit == effects::Limit::travel)
    for (const RowRange& range : data.records())
      step = std::max(step, data.prepared().records[range.record].motor_quantum.value_or(0.0));
  return std::hypot(kPipeline * value, kOfAStep * step);
}

void warn_of_excitation(const RegressionProblem& data, const BalanceFit& fit, const Terms& terms,
                        Identification& result) {
  const Eigen::MatrixXd X = data.columns(terms, fit.linear);
  for (std::size_t j = 0; j < fit.linear.size(); ++j) {
    const Term& term = terms[fit.linear[j].term];
    const auto c = static_cast<Eigen::Index>(j);
    const std::string name = fmt::format("{}.{}", term.id, term.entry->parameters[fit.linear[j].parameter].name);
    if (X.col(c).norm() == 0.0) {
      result.warnings.push_back(
          fmt::format("{}: nothing in these data depends on it; record {}", name, term.entry->info->separated_by));
    } else if (fit.root_tolerance[c] < kUndetermined) {
      const ParameterRef other = fit.linear[likest(X, j)];
      result.warnings.push_back(
          fmt::format("{} cannot be distinguished from {} in these data and is left at zero; record {}", name,
                      terms[other.term].id, term.entry->info->separated_by));
    } else if (fit.root_tolerance[c] < 0.03) {
      const ParameterRef other = fit.linear[likest(X, j)];
      result.warnings.push_back(
          fmt::format("{} is weakly excited: {:.1f} % of its effect is orthogonal to the others, the rest cannot be "
                      "distinguished from {}; {} would show it",
                      name, 100.0 * fit.root_tolerance[c], terms[other.term].id, term.entry->info->separated_by));
    }
  }
  for (std::size_t j = 0; j < fit.nonlinear.size(); ++j) {
    const Term& term = terms[fit.nonlinear[j].term];
    const double share = share_of_range(data, terms, fit.nonlinear[j]);
    // A free run shows values below the range of the regression.
    const ParameterRange range = parameter_range(data, term, fit.nonlinear[j].parameter);
    if (term.values[fit.nonlinear[j].parameter] < range.low * (1.0 - 1e-9)) continue;
    if (share < kAtTheEnd || share > 1.0 - kAtTheEnd)
      result.warnings.push_back(fmt::format("{}.{} stopped at the end of what these data can show ({:.4g}); record {}",
                                            term.id, term.entry->parameters[fit.nonlinear[j].parameter].name,
                                            term.values[fit.nonlinear[j].parameter], term.entry->info->separated_by));
  }
}

// Values of kind grid were set from the data and belong to the model from now on.
void store_grids(model::Model& model, const Term& term, data::Axis axis) {
  model::Effect* effect = model.find(term.id);
  for (std::size_t p = 0; effect && p < term.values.size(); ++p) {
    const auto& info = term.entry->parameters[p];
    model::Parameter* parameter = effect->find(info.name);
    if (info.kind != effects::Kind::grid || !parameter || parameter->value) continue;
    parameter->value = term.values[p];
    parameter->unit = std::string(catalogue::unit_on(info.unit, axis));
    parameter->fixed = true;
  }
}

// What a model states of an error: half of the 95 % interval in standard errors. It counts the biases as the interval
// does, because whoever reads a model (an opened model's interval, drives drawn for a prediction) has nothing else.
std::optional<double> stated_std(const Estimate& e) {
  if (!e.std || !e.low || !e.high) return e.std;
  return 0.5 * (*e.high - *e.low) / half_width_under_bias(0.0);
}

}  // namespace

void store(model::Model& model, const std::vector<Estimate>& estimates) {
  for (const Estimate& e : estimates) {
    model::Effect* effect = model.find(e.id);
    model::Parameter* p = effect ? effect->find(e.parameter) : nullptr;
    if (!p || e.fixed) continue;
    p->value = e.value;
    p->unit = e.unit;
    p->std = stated_std(e);
    p->spread_percent = e.spread_percent;
  }
}

namespace {

// Effects of which a nonlinear parameter stopped at an end of its range: the error still falls beyond it, so its slopes
// there show neither that parameter's error nor that of the effect's others. (A length at the resolution of the data
// may be zero; that end is a bound.)
std::vector<std::size_t> effects_without_minimum(const RegressionProblem& data, const BalanceFit& fit,
                                                 const Terms& terms) {
  std::vector<std::size_t> found;
  for (const ParameterRef& ref : fit.nonlinear) {
    const effects::ParameterInfo& info = terms[ref.term].entry->parameters[ref.parameter];
    const double share = share_of_range(data, terms, ref);
    if (share > 1.0 - kAtTheEnd || (share < kAtTheEnd && !is_length(info))) found.push_back(ref.term);
  }
  return found;
}

// Why the scale of the torques is not known where a parameter of it is to be identified; empty: it is. All others on
// the balance are scaled with it, so no interval of theirs would say how far they may be off. Either it was held at its
// bound; or its column, which is a measured torque, has noise that is not small against the part of it that no other
// column explains: noise of a column makes its parameter smaller by (noise / (noise + that part)) in squares. The
// residual is the most that this noise can be.
std::string why_no_scale(const RegressionProblem& data, const BalanceFit& fit, const std::vector<ParameterRef>& held,
                         const Terms& terms) {
  constexpr double kMostAttenuation = 0.1;
  const auto is_scale = [&](ParameterRef ref) {
    return (terms[ref.term].entry->info->reads & effects::kTorqueScale) != 0;
  };
  const auto name = [&](ParameterRef ref) {
    return fmt::format("{}.{}", terms[ref.term].id, terms[ref.term].entry->parameters[ref.parameter].name);
  };
  if (const auto at = std::ranges::find_if(held, is_scale); at != held.end())
    return fmt::format("{} is held at its bound", name(*at));
  const auto at = std::ranges::find_if(fit.linear, is_scale);
  if (at == fit.linear.end()) return "";
  const auto j = static_cast<Eigen::Index>(at - fit.linear.begin());
  const double own = fit.root_tolerance[j] * data.column(terms, *at).norm();
  const double noise = fit.residual.norm();
  if (fit.root_tolerance[j] < kUndetermined || noise * noise < kMostAttenuation * (noise * noise + own * own))
    return "";
  return fmt::format(
      "noise may make {} too small: {:.2g} N m of its torque are orthogonal to the others, with {:.2g} "
      "of noise",
      name(*at), own / std::sqrt(static_cast<double>(data.rows())), fit.rmse());
}

// Estimates of what a fit found, with standard errors and intervals.
void add_estimates(const RegressionProblem& data, const BalanceFit& fit, const std::vector<ParameterRef>& held,
                   Identification& result) {
  const std::vector<std::size_t> open = effects_without_minimum(data, fit, result.terms);
  const std::string no_scale = why_no_scale(data, fit, held, result.terms);
  if (!no_scale.empty())
    result.warnings.push_back(fmt::format(
        "{}: the scale of the torques is not known, and the values of this balance have no intervals; supply one "
        "parameter that you know another way, such as --supply inertia.inertia=VALUE, or record faster motion",
        no_scale));
  std::vector<ParameterRef> all = fit.linear;
  all.insert(all.end(), fit.nonlinear.begin(), fit.nonlinear.end());
  for (std::size_t j = 0; j < all.size(); ++j) {
    const ParameterRef& ref = all[j];
    const auto at = static_cast<Eigen::Index>(j);
    Estimate e = estimate_of(result.terms, ref, result.model.drive.axis);
    const effects::ParameterInfo& info = result.terms[ref.term].entry->parameters[ref.parameter];
    e.identifiable = fit.root_tolerance[at] >= kUndetermined && no_scale.empty() && !std::ranges::count(open, ref.term);
    e.excitation = fit.excitation[at];
    const double variance = natural_variance(result.terms[ref.term], ref, all, fit.covariance);
    // What differs from a column that was left out by too little has its value and that one's together.
    if (e.identifiable && std::isfinite(variance) && fit.excitation[at] >= kUndetermined) {
      e.std = std::hypot(std::sqrt(variance), beyond_noise(data, info, e.value));
      const Interval interval = interval_95(e.value, *e.std);
      e.low = interval.low;
      e.high = interval.high;
      // A length below the resolution of these data stops at its bound and may be zero.
      if (j >= fit.linear.size() && is_length(info) && share_of_range(data, result.terms, ref) < kAtTheEnd)
        e.low = std::min(*e.low, info.low);
    }
    result.estimates.push_back(std::move(e));
  }
}

// The values by experiment, with average and spread.
void add_by_experiment(const RegressionProblem& data, const AloneFits& alone, const Identification& result,
                       Estimate& e) {
  if (const auto column = alone.column_of(e.ref)) take(by_experiment(alone.fits, {*column, std::nullopt}), e);
  if (!result.terms[e.ref.term].entry->parameters[e.ref.parameter].per_record) return;
  e.per_experiment.clear();
  for (const RowRange& range : data.records()) {
    const Record& record = result.prepared.records[range.record];
    e.per_experiment.push_back({record.name, e.value + record.torsion_zero_rad, std::nullopt, ""});
  }
  summarise(e);
  // It differs by definition.
  e.spread_percent.reset();
  e.reliable.reset();
}

void store_tables(Identification& result) {
  for (const auto& [id, learned] : result.tables) {
    result.model.find(id)->definition->table = learned.table;
    const auto unseen = std::count(learned.visited.begin(), learned.visited.end(), std::uint8_t{0});
    if (unseen > 0)
      result.warnings.push_back(fmt::format(
          "{}: {} of its {} points are where these data have no samples; they are extrapolated from their neighbours",
          id, unseen, learned.visited.size()));
  }
}

// Why a balance has no equations in these data.
std::string why_not_formed(const Identification& result, Balance balance) {
  const RegressorEvaluator of_records(result.prepared, balance);
  std::vector<std::string> left_out;
  for (const auto& [record, text] : of_records.left_out()) left_out.push_back(text);
  if (!left_out.empty())
    return fmt::format("too few samples of its balance ({}) are left: {}", catalogue::balance_name(balance),
                       fmt::join(left_out, ", "));
  constexpr std::array<std::string_view, 3> kNeeds = {"the effort and the motion of the motor",
                                                      "a torque, and the motion of motor and output",
                                                      "a torque, and a motion of an output that is free"};
  return fmt::format("no record of role fit has what its balance ({}) needs: {}", catalogue::balance_name(balance),
                     kNeeds[index(balance)]);
}

}  // namespace

void compute_estimates(Identification& result) {
  const data::Axis axis = result.model.drive.axis;
  std::vector<std::uint8_t> touched(result.terms.size(), 0);
  std::vector<AloneFits> alone;
  for (std::size_t b = 0; b < result.data.size(); ++b) {
    const RegressionProblem& data = result.data[b];
    const BalanceFit& fit = result.fits[b];
    const std::size_t first = result.estimates.size();
    add_estimates(data, fit, result.at_bound[b], result);
    alone.push_back({fit_alone(data, fit, result.terms), fit.linear});
    for (std::size_t j = first; j < result.estimates.size(); ++j)
      add_by_experiment(data, alone.back(), result, result.estimates[j]);
    for (const ParameterRef& ref : result.at_bound[b]) result.estimates.push_back(estimate_of(result.terms, ref, axis));
    for (const std::size_t t : fit.on_balance) touched[t] = 1;
    result.condition_number = std::max(result.condition_number, fit.condition_number);
    warn_of_excitation(data, fit, result.terms, result);
  }
  for (std::size_t t = 0; t < result.terms.size(); ++t)
    if (!touched[t])
      result.warnings.push_back(fmt::format("{}: {}; its parameters are left as they are", result.terms[t].id,
                                            why_not_formed(result, result.terms[t].entry->info->balance)));
  for (const Term& term : result.terms) store_grids(result.model, term, axis);
  store_tables(result);
  derive_directions(alone, result.estimates, result.derived);
  store(result.model, result.estimates);
}

}  // namespace flexspline::estimation
