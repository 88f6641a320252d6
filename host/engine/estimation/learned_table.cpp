#include "host/engine/estimation/learned_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::estimation {
namespace {

constexpr std::size_t kFolds = 5;
constexpr std::size_t kCounts[] = {16, 32, 64, 128, 256};
constexpr std::size_t kAlways = 3;
constexpr std::size_t kFirst = 32;
constexpr int kWeighings = 2;
constexpr int kFewSmoothings = 8;
// More points are taken where they take this share off the left-out squares.
constexpr double kWorthMore = 0.02;

bool is_closed(effects::Variable variable) {
  return variable == effects::Variable::motor_angle || variable == effects::Variable::output_angle;
}

// Columns of the other effects, and the target less the torque of known parameters.
struct OtherColumns {
  CurveProblem problem;
  std::vector<std::string> ids;                    // of each column
  std::map<std::size_t, Eigen::MatrixXd> columns;  // of tables, by their points
};

OtherColumns others(const RegressionProblem& data, const Terms& all, const TableSpecification& specification,
                    const Eigen::VectorXd& root_weights, std::string_view but) {
  Terms terms;
  for (const Term& t : all)
    if (but.empty() || t.id != but) terms.push_back(t);
  const auto on_balance = terms_on(terms, data.balance(), data.prepared().output_signals);
  const std::vector<ParameterRef> linear = free_linear_parameters(terms, on_balance),
                                  nonlinear = free_nonlinear_parameters(terms, on_balance);
  OtherColumns b;
  const auto [X, y] = data.regression(terms, on_balance, linear);
  const auto count = static_cast<Eigen::Index>(linear.size() + nonlinear.size()) + (specification.delay_too ? 1 : 0);
  b.problem.others.resize(data.rows(), count);
  b.problem.others.leftCols(X.cols()) = X;
  b.problem.others.middleCols(X.cols(), static_cast<Eigen::Index>(nonlinear.size())) =
      data.nonlinear_columns(terms, on_balance, nonlinear);
  if (specification.delay_too) b.problem.others.rightCols(1) = data.delay_column();
  for (const auto* refs : {&linear, &nonlinear})
    for (const ParameterRef& ref : *refs) b.ids.push_back(terms[ref.term].id);
  if (specification.delay_too) b.ids.emplace_back("a delay of the effort");
  // From what the others leave, so that squares keep their digits.
  b.problem.target = least_squares(X, y, root_weights).residual;
  b.problem.root_weights = root_weights;
  b.problem.folds = static_cast<int>(kFolds);
  b.problem.fold.assign(static_cast<std::size_t>(data.rows()), 0);
  const auto folds = data.folds(kFolds);
  for (std::size_t f = 0; f < folds.size(); ++f)
    for (const RowRange& range : folds[f])
      std::fill(b.problem.fold.begin() + range.first, b.problem.fold.begin() + range.last, static_cast<int>(f));
  b.problem.closed = is_closed(specification.variable);
  return b;
}

struct Fitted {
  Curve curve;
  std::vector<double> at;
  std::vector<std::uint8_t> visited;
  double left() const { return curve.squares_with; }
  double decrease() const { return curve.squares_without - curve.squares_with; }
};

Fitted fit_points(const RegressionProblem& data, const Terms& terms, const TableSpecification& specification,
                  std::vector<double> at, OtherColumns& b, int smoothings = kSmoothings) {
  const RegressorEvaluator::Points points{
      specification.variable, specification.times_direction, specification.balance, at.front(), at.back(), at.size()};
  Eigen::MatrixXd& columns = b.columns[at.size()];
  if (columns.size() == 0) columns = data.evaluator().point_columns(terms, points, specification.filtered);
  b.problem.points = columns;
  Fitted fitted;
  fitted.curve = fit_curve(b.problem, smoothings);
  fitted.at = std::move(at);
  const Eigen::VectorXd length = (b.problem.root_weights.asDiagonal() * b.problem.points).colwise().norm();
  for (Eigen::Index k = 0; k < length.size(); ++k) fitted.visited.push_back(length[k] > 1e-3 * length.maxCoeff());
  return fitted;
}

LearnedTable learned(const RegressionProblem& data, const OtherColumns& b, Fitted fitted) {
  LearnedTable result;
  const Curve& curve = fitted.curve;
  const Eigen::VectorXd weighted = b.problem.root_weights.cwiseProduct(curve.residual);
  const double tau = autocorrelation_time(data, weighted);
  result.table.at = std::move(fitted.at);
  result.table.value.assign(curve.value.begin(), curve.value.end());
  for (Eigen::Index k = 0; k < curve.value.size(); ++k)
    result.table.std.push_back(std::sqrt(std::max(0.0, curve.covariance(k, k)) * tau));
  const double weight = b.problem.root_weights.squaredNorm() / std::max(1.0, curve.rows);
  result.rmse_cv_before = std::sqrt(curve.squares_without / std::max(1.0, curve.rows) / weight);
  result.rmse_cv_after = std::sqrt(curve.squares_with / std::max(1.0, curve.rows) / weight);
  result.decrease_percent = curve.squares_without > 0.0 ? 100.0 * fitted.decrease() / curve.squares_without : 0.0;
  result.score =
      curve.squares_with > 0.0 ? curve.rows / tau * std::log(curve.squares_without / curve.squares_with) : 0.0;
  result.effective_degrees_of_freedom = curve.effective_degrees_of_freedom;
  for (const Eigen::Index column : curve.left_to) {
    const std::string& id = b.ids[static_cast<std::size_t>(column)];
    if (std::find(result.left_to.begin(), result.left_to.end(), id) == result.left_to.end())
      result.left_to.push_back(id);
  }
  result.visited = std::move(fitted.visited);
  result.residual = curve.residual;
  result.autocorrelation_time = tau;
  return result;
}

}  // namespace

SignalRange central_range(const Eigen::VectorXd& signal) {
  if (signal.size() == 0) return {};
  std::vector<double> sorted(signal.begin(), signal.end());
  const auto at = [&](double share) {
    const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + k, sorted.end());
    return sorted[static_cast<std::size_t>(k)];
  };
  return {at(0.001), at(0.999)};
}

std::optional<LearnedTable> learn_table(const RegressionProblem& data, const Terms& terms,
                                        const TableSpecification& specification, const Eigen::VectorXd& root_weights,
                                        std::string_view but) {
  if (data.empty()) return std::nullopt;
  const bool closed = is_closed(specification.variable);
  const SignalRange range = central_range(data.evaluator().signal_at_rows(terms, specification.variable));
  if (!(range.high > range.low)) return std::nullopt;
  OtherColumns b = others(data, terms, specification, root_weights, but);
  const auto points = [&](std::size_t count) {
    return closed ? catalogue::points_of_turn(count) : catalogue::even_points(range.low, range.high, count);
  };
  // Without the curve, records that show it most seem the noisiest and count the least: so they are weighed by what a
  // first curve leaves.
  const std::vector<double> first = !specification.at.empty() ? specification.at
                                    : specification.exactly
                                        ? points(specification.most_points)
                                        : points(std::min<std::size_t>(kFirst, specification.most_points));
  for (int round = specification.filtered ? 0 : 1;
       round < kWeighings && static_cast<Eigen::Index>(2 * first.size()) < data.rows(); ++round) {
    const Fitted fitted = fit_points(data, terms, specification, first, b, kFewSmoothings);
    const Eigen::VectorXd keep = (root_weights.array() > 0.0).cast<double>();
    b.problem.root_weights =
        keep.cwiseProduct(root_record_weights(data.records(), keep.cwiseProduct(fitted.curve.residual)));
  }
  if (!specification.at.empty()) return learned(data, b, fit_points(data, terms, specification, specification.at, b));
  std::vector<Fitted> tried;
  double least = std::numeric_limits<double>::infinity();
  std::vector<std::size_t> counts(std::begin(kCounts), std::end(kCounts));
  if (specification.exactly) counts = {specification.most_points};
  for (const std::size_t count : counts) {
    if (count > specification.most_points || static_cast<Eigen::Index>(4 * count) > data.rows()) break;
    // A bump that is narrow shows only between points that are close, so that the first counts are tried in any case.
    const std::size_t n = tried.size();
    if (n >= kAlways && tried[n - 1].left() > (1.0 - kWorthMore) * tried[n - 2].left()) break;
    tried.push_back(fit_points(data, terms, specification, points(count), b));
    least = std::min(least, tried.back().left());
  }
  for (Fitted& fitted : tried)
    if (fitted.left() <= (1.0 + kWorthMore) * least) return learned(data, b, std::move(fitted));
  return std::nullopt;
}

TableSpecification table_specification(const model::Definition& definition) {
  TableSpecification specification;
  specification.variable = catalogue::find_variable(definition.variable)->variable;
  specification.times_direction = definition.times_direction;
  specification.balance = definition.balance == "transmission" ? Balance::transmission
                          : definition.balance == "load"       ? Balance::load
                                                               : Balance::motor;
  specification.at = definition.table.at;
  return specification;
}

model::Effect effect_of(const TableSpecification& specification, const model::Table& table, std::string id) {
  model::Effect effect;
  effect.type = std::string(catalogue::kTableEffect);
  effect.id = std::move(id);
  model::Definition definition;
  for (const effects::VariableInfo& v : effects::kVariables)
    if (v.variable == specification.variable) definition.variable = std::string(v.name);
  definition.balance = catalogue::balance_name(specification.balance);
  definition.times_direction = specification.times_direction;
  definition.table = table;
  effect.definition = std::move(definition);
  return effect;
}

}  // namespace flexspline::estimation
