#include "host/engine/estimation/identify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <tuple>

#include "host/engine/estimation/build_balances.hpp"
#include "host/engine/estimation/evidence.hpp"
#include "host/engine/estimation/modelled_torque.hpp"
#include "host/engine/estimation/record_constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::estimation {

std::pair<BalanceFit, std::vector<ParameterRef>> fit_within_bounds(const RegressionProblem& data, Terms& terms,
                                                                   data::Axis axis,
                                                                   std::vector<std::string>& warnings) {
  std::vector<ParameterRef> held;
  for (;;) {
    BalanceFit fit = fit_balance(data, terms);
    const auto outside = std::find_if(fit.linear.begin(), fit.linear.end(), [&](const ParameterRef& ref) {
      const auto& info = terms[ref.term].entry->parameters[ref.parameter];
      const double value = terms[ref.term].values[ref.parameter];
      return value < info.low || value > info.high;
    });
    if (outside == fit.linear.end()) {
      for (const ParameterRef& ref : held) terms[ref.term].known[ref.parameter] = 0;
      return {std::move(fit), std::move(held)};
    }
    Term& term = terms[outside->term];
    const auto& info = term.entry->parameters[outside->parameter];
    double& value = term.values[outside->parameter];
    const double bound = value < info.low ? info.low : info.high;
    const auto unit = catalogue::unit_on(info.unit, axis);
    warnings.push_back(fmt::format(
        "{}.{} would be {:.4g} {}, which is not possible; it is held at {:g}: the model lacks something, or has an "
        "effect too many",
        term.id, info.name, value, unit, bound));
    value = bound;
    term.known[outside->parameter] = 1;
    held.push_back(*outside);
  }
}

namespace {

// Parameters of a fit that act on the balance of other data as well, with their places in the fit's covariance. Of what
// the fit does not identify, other balances are not used either.
struct Shared {
  std::vector<ParameterRef> refs;
  std::vector<Eigen::Index> at;
};
Shared shared_with(const BalanceFit& fit, const Terms& terms, Balance other) {
  Shared shared;
  std::vector<ParameterRef> all = fit.linear;
  all.insert(all.end(), fit.nonlinear.begin(), fit.nonlinear.end());
  for (std::size_t j = 0; j < all.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (!terms[all[j].term].entry->adds_to(other) || !std::isfinite(fit.covariance(at, at))) continue;
    shared.refs.push_back(all[j]);
    shared.at.push_back(at);
  }
  return shared;
}

// Combines the evidence of two balances for parameters that act on both: the estimate of their own balance with its
// covariance, and the evidence of the other one. Where they contradict each other, one model is incomplete, and the own
// balance counts.
bool combine_balances(Identification& result, std::size_t identified, std::size_t other) {
  constexpr double kContradiction = 16.0;  // squared standard errors a parameter
  BalanceFit& fit = result.fits[identified];
  const Shared shared = shared_with(fit, result.terms, result.data[other].balance());
  if (shared.refs.empty()) return false;
  const RegressionProblem& data = result.data[other];
  const BalanceFit& its = result.fits[other];
  Eigen::MatrixXd cross_columns(data.rows(), 0);
  for (const ParameterRef& ref : shared.refs) {
    cross_columns.conservativeResize(Eigen::NoChange, cross_columns.cols() + 1);
    cross_columns.rightCols(1) = cross_balance_columns(data, result.terms, ref.term, {ref.parameter});
  }
  const Eigen::MatrixXd own = data.slopes(result.terms, its.on_balance, its.linear, its.nonlinear);
  const Eigen::VectorXd residual = data.residual(result.terms);
  const NoiseModel noise = noise_model(cross_columns, own, data, result.terms, its, residual);
  const ScoreAndInformation evidence = score_and_information(cross_columns, own, residual, noise.error_covariance,
                                                             std::max(1.0, noise.autocorrelation_time));
  const Eigen::MatrixXd before = fit.covariance(shared.at, shared.at);
  const Eigen::MatrixXd precision = scaled_inverse(before);
  const CombinedEstimate both = combine(precision, evidence);
  if (!both.change.allFinite() || both.cost > kContradiction * static_cast<double>(shared.refs.size())) {
    result.warnings.push_back(fmt::format(
        "{}: the torque balance that its values are identified on and the motor's contradict each other; one of them "
        "lacks an effect (see `flexspline diagnose`)",
        result.terms[shared.refs.front().term].id));
    return false;
  }
  // The other parameters of the own balance change with them.
  std::vector<ParameterRef> all = fit.linear;
  all.insert(all.end(), fit.nonlinear.begin(), fit.nonlinear.end());
  std::vector<Eigen::Index> known;
  for (Eigen::Index j = 0; j < fit.covariance.rows(); ++j)
    if (std::isfinite(fit.covariance(j, j))) known.push_back(j);
  const Eigen::MatrixXd gain = fit.covariance(known, shared.at) * precision;
  const Eigen::VectorXd change = gain * both.change;
  for (std::size_t k = 0; k < known.size(); ++k) {
    const ParameterRef& ref = all[static_cast<std::size_t>(known[k])];
    result.terms[ref.term].values[ref.parameter] += change[static_cast<Eigen::Index>(k)];
  }
  const Eigen::MatrixXd less = gain * (before - both.covariance) * gain.transpose();
  for (std::size_t i = 0; i < known.size(); ++i)
    for (std::size_t j = 0; j < known.size(); ++j)
      fit.covariance(known[i], known[j]) -= less(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  fit.residual = result.data[identified].residual(result.terms);
  return true;
}

// Fits all balances. What an effect adds to a balance other than the one that its parameters are identified on is known
// there, so that one comes first: the transmission's before the motor's, and, where the motor's identifies others, both
// again.
// Returns what was held at a bound on each.
std::vector<std::vector<ParameterRef>> fit_all(Identification& result, data::Axis axis) {
  std::vector<std::vector<ParameterRef>> held(result.data.size());
  result.fits.resize(result.data.size());
  bool reach = false, identified_on_other_balance = false;
  for (const Term& term : result.terms) {
    reach = reach || term.entry->info->adds_to != 0;
    identified_on_other_balance = identified_on_other_balance || term.entry->info->identified_on_motor;
  }
  std::vector<std::size_t> order;
  for (std::size_t b = 0; b < result.data.size(); ++b)
    if (!reach || result.data[b].balance() != Balance::motor) order.push_back(b);
  for (std::size_t b = 0; b < result.data.size() && reach; ++b)
    if (result.data[b].balance() == Balance::motor) order.push_back(b);
  for (int pass = 0; pass < (identified_on_other_balance ? 2 : 1); ++pass)
    for (const std::size_t b : order) {
      std::vector<std::string> warnings;
      std::tie(result.fits[b], held[b]) = fit_within_bounds(result.data[b], result.terms, axis, warnings);
      if (pass > 0 || !identified_on_other_balance) std::ranges::move(warnings, std::back_inserter(result.warnings));
    }
  for (std::size_t b = 0; b < result.data.size() && reach && result.prepared.output_signals.torque; ++b)
    for (std::size_t other = 0; other < result.data.size(); ++other)
      if (other != b && result.data[other].balance() == Balance::motor && combine_balances(result, b, other)) {
        std::vector<std::string> warnings;
        std::tie(result.fits[other], held[other]) = fit_within_bounds(result.data[other], result.terms, axis, warnings);
        for (std::string& warning : warnings)
          if (std::ranges::find(result.warnings, warning) == result.warnings.end())
            result.warnings.push_back(std::move(warning));
      }
  return held;
}

}  // namespace

model::Drive reconcile(const model::Drive& drive, const data::Dataset& dataset, std::vector<std::string>& warnings) {
  model::Drive result = drive;
  const auto one = [&](model::Quantity& ours, const std::optional<double>& theirs, const char* name) {
    if (!theirs) return;
    if (!ours.value) {
      ours.value = theirs;
      ours.source = "data set";
    } else if (std::abs(*ours.value - *theirs) > 1e-3 * std::abs(*ours.value)) {
      warnings.push_back(fmt::format("{} is {:g} in the model and {:g} in the data set; the model's is used", name,
                                     *ours.value, *theirs));
    }
  };
  one(result.gear_ratio, dataset.drive.gear_ratio, "gear_ratio");
  one(result.torque_constant_nm_a, dataset.drive.torque_constant_nm_a, "torque_constant_nm_a");
  one(result.pitch_m, dataset.drive.pitch_m, "pitch_m");
  one(result.pole_pairs, dataset.drive.pole_pairs, "pole_pairs");
  one(result.motor_slots, dataset.drive.motor_slots, "motor_slots");
  if (dataset.drive.axis && *dataset.drive.axis != drive.axis)
    warnings.push_back("the data set's axis is not of the model's kind (rotary, linear); the model's is used");
  return result;
}

std::vector<const data::Experiment*> experiments_to_fit(const data::Dataset& dataset) {
  std::vector<const data::Experiment*> fit_on;
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == data::Role::fit) fit_on.push_back(&e);
  if (fit_on.empty())
    throw data::DataError(
        {{data::Severity::error, "too_few_samples", "", 0, "", "no experiment has the role fit; all are held out",
          "give at least one experiment to fit on; the role stands in the file (\"role\" in the header "
          "of a CSV or in dataset.toml), and --holdout sets it"}});
  return fit_on;
}

std::unique_ptr<Identification> build_balances(const data::Dataset& dataset, const model::Model& model,
                                               const PipelineOptions& options) {
  return build_balances_from(experiments_to_fit(dataset), dataset, model, options);
}

std::unique_ptr<Identification> build_balances_from(const std::vector<const data::Experiment*>& fit_on,
                                                    const data::Dataset& dataset, const model::Model& model,
                                                    const PipelineOptions& options) {
  auto result = std::make_unique<Identification>();
  result->model = model;
  result->model.drive = reconcile(model.drive, dataset, result->warnings);
  result->prepared = prepare(fit_on, result->model, options);
  result->terms = terms_of(result->model);
  std::map<std::size_t, std::string> too_short;  // by record, of any balance
  std::vector<std::uint8_t> used(result->prepared.records.size(), 0);
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    if (balance != Balance::motor && !result->prepared.output_signals.torque) continue;
    if (terms_on(result->terms, balance, result->prepared.output_signals).empty()) continue;
    RegressionProblem data(result->prepared, balance);
    too_short.insert(data.evaluator().left_out().begin(), data.evaluator().left_out().end());
    if (data.empty()) continue;
    for (const RowRange& range : data.records()) used[range.record] = 1;
    result->data.push_back(std::move(data));
  }
  // A record may identify one balance only: free motion twists the transmission too little.
  std::erase_if(too_short, [&](const auto& record) { return used[record.first] != 0; });
  std::string list;
  for (const auto& [record, what] : too_short) list += (list.empty() ? "" : ", ") + what;
  if (result->data.empty() && !too_short.empty() && options.mask && !options.cutoff_hz) {
    PipelineOptions unmasked = options;
    unmasked.mask = false;
    unmasked.ready = nullptr;
    auto kept = build_balances_from(fit_on, dataset, model, unmasked);
    kept->warnings.push_back(fmt::format(
        "reversals are not left out, as too few samples would remain in {}: static friction laws do not hold "
        "there; record longer strokes",
        list));
    return kept;
  }
  if (result->data.empty() && !too_short.empty())
    throw data::DataError({{data::Severity::error, "too_few_samples", "", 0, "",
                            fmt::format("too few samples are left to fit on in {}", list),
                            "record longer or faster motion, or raise --cutoff-hz, or give --mask none"}});
  if (result->data.empty())
    throw data::DataError({{data::Severity::error, "missing_column", "", 0, "",
                            "no torque balance of the model can be formed from these columns",
                            "record current (or torque) and motor position together"}});
  if (!too_short.empty()) result->warnings.push_back(fmt::format("too few samples are left in {}; not used", list));
  return result;
}

namespace {

// Moves the constants of each record to where they fit best, and forms the balances again. Returns whether any moved.
bool refine_record_constants(Identification& result) {
  if (record_constants(result.terms).empty()) return false;
  bool moved = false;
  for (std::size_t b = 0; b < result.data.size(); ++b) {
    const BalanceFit& found = result.fits[b];
    std::vector<ParameterRef> others = found.linear;
    others.insert(others.end(), found.nonlinear.begin(), found.nonlinear.end());
    moved = refine_record_constants(result.prepared, result.data[b], result.terms, others, found.root_weights) || moved;
  }
  if (!moved) return false;
  for (RegressionProblem& data : result.data) data = RegressionProblem(result.prepared, data.balance());
  return true;
}

// Learns the tables of a balance together with its other effects, one after the other. Returns whether there were any.
bool learn_tables(Identification& result) {
  bool any = false;
  for (std::size_t t = 0; t < result.terms.size(); ++t) {
    Term& term = result.terms[t];
    const model::Definition* definition = term.entry->definition;
    if (!definition || definition->variable.empty() || definition->table.fixed) continue;
    for (std::size_t b = 0; b < result.data.size(); ++b) {
      const std::vector<std::size_t>& on_balance = result.fits[b].on_balance;
      if (std::find(on_balance.begin(), on_balance.end(), t) == on_balance.end()) continue;
      const TableSpecification specification = table_specification(*definition);
      auto learned = learn_table(result.data[b], result.terms, specification, result.fits[b].root_weights, term.id);
      if (!learned) {
        result.warnings.push_back(fmt::format("{}: {} does not vary in these data; the table is left as it is", term.id,
                                              definition->variable));
        continue;
      }
      term.entry = &catalogue::entry_of(effect_of(specification, learned->table, term.id));
      result.tables.emplace_back(term.id, std::move(*learned));
      any = true;
    }
  }
  return any;
}

}  // namespace

void fit(Identification& result) {
  const std::vector<std::string> before = result.warnings;
  const auto again = [&] {
    // Warnings of the previous fit may no longer hold.
    result.warnings = before;
    result.at_bound = fit_all(result, result.model.drive.axis);
  };
  again();
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds && refine_record_constants(result); ++round) again();
  if (learn_tables(result)) again();
  // The load that effects read has to be known before they can be fitted, and changes with them.
  for (int round = 0; round < kRounds && take_torque_where_read(result.prepared, result.terms); ++round) {
    for (RegressionProblem& data : result.data) data = RegressionProblem(result.prepared, data.balance());
    again();
  }
}

std::unique_ptr<Identification> identify(const data::Dataset& dataset, const model::Model& model,
                                         const PipelineOptions& options) {
  auto result = build_balances(dataset, model, options);
  fit(*result);
  compute_estimates(*result);
  return result;
}

}  // namespace flexspline::estimation
