#include "host/engine/selection/record_laws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "host/engine/estimation/effort_timing.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;
using estimation::RegressionProblem;
using estimation::RowRange;
using estimation::Term;

// What the record says of a parameter: value and variance, an infinite one where it does not identify it.
std::pair<double, double> value_in(const Estimate& parameter, const std::string& record) {
  const auto& values = parameter.per_experiment;
  const auto at = std::find_if(values.begin(), values.end(), [&](const auto& v) { return v.name == record; });
  if (at == values.end() || !at->value || !at->std) return {0.0, std::numeric_limits<double>::infinity()};
  return {*at->value, *at->std * *at->std};
}

// A lag of the effort that is certain changes what each record says by as much as its motion makes of it, which would
// look like a law of speed.
void take_lag_off(const estimation::Identification& base, const RegressionProblem& data, RecordFriction& friction) {
  if (friction.parameters.empty()) return;
  const std::optional<estimation::EffortLag> lag = estimation::effort_lag(base);
  if (!lag || !lag->is_certain() || lag->slope.size() != data.rows()) return;
  const auto on_balance = estimation::terms_on(base.terms, data.balance(), base.prepared.output_signals);
  const std::vector<estimation::ParameterRef> linear = estimation::free_linear_parameters(base.terms, on_balance);
  const Eigen::MatrixXd columns = data.columns(base.terms, linear);
  for (std::size_t i = 0; i < friction.records.size(); ++i) {
    const RowRange& range = friction.records[i];
    const estimation::LinearFit per_second =
        estimation::least_squares(columns.middleRows(range.first, range.size()),
                                  lag->slope.segment(range.first, range.size()), Eigen::VectorXd::Ones(range.size()));
    for (std::size_t j = 0; j < friction.parameters.size(); ++j) {
      const auto at = std::ranges::find(linear, friction.parameters[j]->ref);
      if (at == linear.end()) continue;
      const double change_per_s = per_second.theta[at - linear.begin()];
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      friction.values.theta(row, column) -= lag->lag_s * change_per_s;
      friction.values.variance(row, column) += std::pow(lag->std_s * change_per_s, 2);
    }
  }
}

}  // namespace

AsFriction as_friction(const RegressionProblem& data, const estimation::Terms& base, const RecordFriction& own,
                       const Eigen::VectorXd& torque, const Eigen::VectorXd& root_weights) {
  std::vector<estimation::ParameterRef> refs;
  for (const Estimate* e : own.parameters) refs.push_back(e->ref);
  const Eigen::MatrixXd columns = data.columns(base, refs);
  AsFriction result;
  result.added.resize(own.values.theta.rows(), own.values.theta.cols());
  for (std::size_t i = 0; i < own.records.size(); ++i) {
    const RowRange& range = own.records[i];
    const Eigen::VectorXd weights = root_weights.segment(range.first, range.size());
    const Eigen::VectorXd here = torque.segment(range.first, range.size());
    const Eigen::MatrixXd friction = columns.middleRows(range.first, range.size());
    const estimation::LinearFit fit = estimation::least_squares(friction, here, weights);
    const double left = weights.cwiseProduct(here - friction * fit.theta).squaredNorm();
    result.most_left = std::max(result.most_left, left / std::max(weights.cwiseProduct(here).squaredNorm(), 1e-300));
    result.added.row(static_cast<Eigen::Index>(i)) = fit.theta.transpose();
  }
  return result;
}

RecordFriction friction_by_record(const estimation::Identification& base, const RegressionProblem& data,
                                  std::size_t fewest) {
  const auto identified = [&](const Estimate& e) {
    return static_cast<std::size_t>(
        std::count_if(data.records().begin(), data.records().end(), [&](const RowRange& range) {
          const estimation::Record& record = base.prepared.records[range.record];
          return !record.at_rest && std::isfinite(value_in(e, record.name).second);
        }));
  };
  RecordFriction friction;
  for (const Estimate& e : base.estimates) {
    const catalogue::Entry& entry = *base.terms[e.ref.term].entry;
    if (entry.info->balance != data.balance() || entry.info->surface.empty() || e.fixed) continue;
    if (entry.parameters[e.ref.parameter].kind == effects::Kind::linear && identified(e) >= fewest)
      friction.parameters.push_back(&e);
  }
  const auto parameters = static_cast<Eigen::Index>(friction.parameters.size());
  auto& [theta, variance] = friction.values;
  theta.resize(static_cast<Eigen::Index>(data.records().size()), parameters);
  variance.resize(theta.rows(), parameters);
  for (const RowRange& range : data.records()) {
    const estimation::Record& record = base.prepared.records[range.record];
    const auto row = static_cast<Eigen::Index>(friction.records.size());
    for (Eigen::Index j = 0; j < parameters; ++j)
      std::tie(theta(row, j), variance(row, j)) =
          value_in(*friction.parameters[static_cast<std::size_t>(j)], record.name);
    if (!record.at_rest && variance.row(row).array().isFinite().any()) friction.records.push_back(range);
  }
  theta.conservativeResize(static_cast<Eigen::Index>(friction.records.size()), parameters);
  variance.conservativeResize(theta.rows(), parameters);
  take_lag_off(base, data, friction);
  return friction;
}

std::vector<RecordSubset> ranges_of_speed(const RecordFriction& own, const std::vector<double>& speeds) {
  std::vector<Eigen::Index> order = every_record(own.values).records;
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return speeds[static_cast<std::size_t>(a)] < speeds[static_cast<std::size_t>(b)];
  });
  std::vector<RecordSubset> ranges;
  const auto add = [&](auto first, auto last) {
    RecordSubset range{{first, last}, {}};
    for (const Eigen::Index j : every_record(own.values).parameters) {
      const auto identify =
          std::count_if(first, last, [&](Eigen::Index i) { return std::isfinite(own.values.variance(i, j)); });
      if (static_cast<std::size_t>(identify) >= kPolicy.fewest_of_trend) range.parameters.push_back(j);
    }
    if (!range.parameters.empty()) ranges.push_back(std::move(range));
  };
  for (std::ptrdiff_t tenth = 1; tenth < 10; ++tenth) {
    const auto at = order.begin() + std::ssize(order) * tenth / 10;
    add(order.begin(), at);
    add(at, order.end());
  }
  return ranges;
}

std::vector<Law> laws(const estimation::Identification& base, const SearchedBalance& motor, const RecordFriction& own) {
  const RegressionProblem& data = *motor.search.data;
  std::vector<Law> all;
  for (const CandidateFit& candidate : motor.candidates) {
    estimation::Terms terms = candidate.model.terms;
    Term& law = terms.back();
    std::vector<std::size_t> nonlinear;
    for (std::size_t p = 0; p < law.values.size(); ++p) {
      if (law.free_nonlinear(p)) nonlinear.push_back(p);
      if (law.free_linear(p)) law.values[p] = law.entry->parameters[p].usual;
    }
    // An order over the angle averages out over a record.
    if (candidate.model.order || law.entry->count(effects::Kind::linear) == 0 || nonlinear.size() > 1) continue;
    std::vector<double> grid{0.0};
    if (!nonlinear.empty())
      grid = estimation::parameter_grid(estimation::parameter_range(data, law, nonlinear[0]), kGridPoints);
    for (const double value : grid) {
      if (!nonlinear.empty()) law.values[nonlinear[0]] = value;
      const Eigen::VectorXd torque = data.term_torque(terms, terms.size() - 1);
      AsFriction taken = as_friction(data, base.terms, own, torque, motor.search.base.root_weights);
      // Where more is left than a term needs to be chosen, the record shows the law itself.
      if (taken.most_left <= kPolicy.line_share) all.push_back({&candidate, law.values, std::move(taken.added)});
    }
  }
  return all;
}

}  // namespace flexspline::selection
