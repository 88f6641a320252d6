#include "host/engine/selection/record_inertia.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;
using estimation::RegressionProblem;

// The columns with one of them divided into one a record.
Eigen::MatrixXd with_own_column(const RegressionProblem& data, const Eigen::MatrixXd& columns, Eigen::Index of) {
  const auto records = std::ssize(data.records());
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(columns.rows(), columns.cols() - 1 + records);
  own.leftCols(of) = columns.leftCols(of);
  own.middleCols(of, columns.cols() - 1 - of) = columns.rightCols(columns.cols() - 1 - of);
  Eigen::Index at = columns.cols() - 1;
  for (const estimation::RowRange& range : data.records())
    own.col(at++).segment(range.first, range.size()) = columns.col(of).segment(range.first, range.size());
  return own;
}

// The least and the largest value of the records that know it well; nothing where they agree.
std::optional<std::pair<double, double>> range_of(const Estimate& parameter) {
  std::optional<std::pair<double, double>> least, most;  // value, variance
  for (const auto& one : parameter.per_experiment) {
    if (!one.value || !one.std || *one.std > kPolicy.known_inertia * std::abs(*one.value)) continue;
    const std::pair<double, double> value{*one.value, *one.std * *one.std};
    if (!least || value.first < least->first) least = value;
    if (!most || value.first > most->first) most = value;
  }
  if (!least || most->first - least->first < kPolicy.inertia_errors * std::sqrt(least->second + most->second))
    return std::nullopt;
  return std::pair{least->first, most->first};
}

}  // namespace

std::optional<RecordInertia> inertia_by_record(const estimation::Identification& base, const BalanceSearch& search) {
  const RegressionProblem& data = *search.data;
  const auto on_balance = estimation::terms_on(base.terms, data.balance(), base.prepared.output_signals);
  const std::vector<estimation::ParameterRef> linear = estimation::free_linear_parameters(base.terms, on_balance);
  if (data.records().size() < estimation::kFewestRecords) return std::nullopt;
  const Eigen::MatrixXd columns = data.columns(base.terms, linear);
  const Eigen::VectorXd target = data.target() - data.known_torque(base.terms, on_balance);
  const Eigen::VectorXd weights = search.base.root_weights;
  const double before = rmse_of(estimation::least_squares(columns, target, weights).residual, weights);
  std::optional<RecordInertia> best;
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const effects::ParameterInfo& info = base.terms[linear[j].term].entry->parameters[linear[j].parameter];
    if (info.unit.rotary != effects::units::kInertia.rotary) continue;
    const auto estimate = std::ranges::find(base.estimates, linear[j], &Estimate::ref);
    if (estimate == base.estimates.end()) continue;
    const auto range = range_of(*estimate);
    if (!range) continue;
    const Eigen::MatrixXd own = with_own_column(data, columns, static_cast<Eigen::Index>(j));
    const double after = rmse_of(estimation::least_squares(own, target, weights).residual, weights);
    const double share = 1.0 - std::pow(after / std::max(before, 1e-300), 2);
    if (share < kPolicy.matters_share || (best && 100.0 * share <= best->explains_percent)) continue;
    best = {fmt::format("{}.{}", estimate->id, estimate->parameter), 100.0 * share, range->first, range->second,
            estimate->unit};
  }
  return best;
}

std::string inertia_text(const RecordInertia& own) {
  return fmt::format(
      "{} differs between records ({:.4g} to {:.4g} {}): with a value for each of them {:.0f} % of the squared error "
      "goes. Was the load changed, or the posture of other joints? Then diagnose records of one together; else an "
      "effect that acts with the "
      "acceleration is missing, or their efforts come late by different times",
      own.parameter, own.least, own.most, own.unit, own.explains_percent);
}

}  // namespace flexspline::selection
