#include "host/engine/estimation/instruments.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/free_motion.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::estimation {
namespace {

constexpr int kFreeRuns = 3;
constexpr int kInstrumentSteps = 4;

// Adds to a parameter, within its bounds.
void move(const RegressionProblem& data, Terms& terms, const ParameterRef& ref, double by, bool nonlinear_ref) {
  Term& term = terms[ref.term];
  double& value = term.values[ref.parameter];
  if (nonlinear_ref) {
    const ParameterRange range = parameter_range(data, term, ref.parameter);
    value = std::clamp(value + by, range.low, range.high);
  } else {
    const auto& info = term.entry->parameters[ref.parameter];
    value = std::clamp(value + by, info.low, info.high);
  }
}

// Returns whether the instruments determine the parameters; else the fit stays as it was.
bool refit(const RegressionProblem& data, const FreeMotion& motion, Terms& terms, BalanceFit& fit) {
  RegressionProblem simulated(motion.prepared, data.balance());
  if (data.empty() || simulated.rows() != data.rows()) return false;
  std::vector<Eigen::Index> kept;  // what the data determine
  for (Eigen::Index j = 0; j < fit.root_tolerance.size(); ++j)
    if (fit.root_tolerance[j] >= kUndetermined) kept.push_back(j);
  if (kept.empty()) return false;
  const auto count = static_cast<Eigen::Index>(kept.size());
  const auto linear = static_cast<Eigen::Index>(fit.linear.size());
  Eigen::MatrixXd A(data.rows(), count), Z(data.rows(), count);
  for (int step = 0; step < kInstrumentSteps; ++step) {
    const Eigen::MatrixXd own = data.slopes(terms, fit.on_balance, fit.linear, fit.nonlinear);
    Eigen::MatrixXd instruments = simulated.slopes(terms, fit.on_balance, fit.linear, fit.nonlinear);
    for (const RowRange& range : data.records())
      if (!motion.simulated[range.record])
        instruments.middleRows(range.first, range.size()) = own.middleRows(range.first, range.size());
    for (Eigen::Index j = 0; j < count; ++j) {
      A.col(j) = fit.root_weights.cwiseProduct(own.col(kept[static_cast<std::size_t>(j)]));
      Z.col(j) = fit.root_weights.cwiseProduct(instruments.col(kept[static_cast<std::size_t>(j)]));
    }
    fit.residual = data.residual(terms);
    const Eigen::VectorXd size = A.colwise().norm().transpose().array().max(1e-300);
    const Eigen::VectorXd instrument_size = Z.colwise().norm().transpose().array().max(1e-300);
    const Eigen::MatrixXd zs = Z * instrument_size.cwiseInverse().asDiagonal();
    const algebra::FullPivotLu normal(zs.transpose() * A * size.cwiseInverse().asDiagonal());
    if (normal.reciprocal_condition() < 1e-9) return false;  // the free run does not excite a parameter
    const Eigen::VectorXd by = normal.solve(zs.transpose() * fit.root_weights.cwiseProduct(fit.residual));
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Index at = kept[static_cast<std::size_t>(j)];
      const bool nonlinear_ref = at >= linear;
      const auto& refs = nonlinear_ref ? fit.nonlinear : fit.linear;
      move(data, terms, refs[static_cast<std::size_t>(nonlinear_ref ? at - linear : at)], by[j] / size[j],
           nonlinear_ref);
    }
    if (step + 1 < kInstrumentSteps) continue;
    fit.residual = data.residual(terms);
    const Eigen::VectorXd weighted = fit.root_weights.cwiseProduct(fit.residual);
    fit.autocorrelation_time = autocorrelation_time(data, weighted);
    const double freedom = std::max(1.0, static_cast<double>(data.rows() - count));
    const Eigen::MatrixXd inverse = normal.inverse();
    const Eigen::MatrixXd middle =
        newey_west(data.records(), zs, weighted, newey_west_lags(fit.autocorrelation_time, data.rows())) *
        (static_cast<double>(data.rows()) / freedom);
    const Eigen::MatrixXd scaled = inverse * middle * inverse.transpose();
    for (Eigen::Index i = 0; i < count; ++i)
      for (Eigen::Index j = 0; j < count; ++j)
        fit.covariance(kept[static_cast<std::size_t>(i)], kept[static_cast<std::size_t>(j)]) =
            scaled(i, j) / (size[i] * size[j]);
  }
  return true;
}

}  // namespace

void refit_with_instruments(Identification& identification) {
  for (int run = 0; run < kFreeRuns; ++run) {
    const FreeMotion motion = free_motion(identification);
    for (std::size_t b = 0; b < identification.data.size(); ++b) {
      const RegressionProblem& data = identification.data[b];
      if (!refit(data, motion, identification.terms, identification.fits[b]) && run + 1 == kFreeRuns)
        identification.warnings.push_back(fmt::format(
            "the free runs do not determine the parameters of the {} balance: its values are those of least "
            "squares, or of an earlier run",
            catalogue::balance_name(data.balance())));
    }
    if (run + 1 < kFreeRuns) continue;
    std::string without;
    for (std::size_t i = 0; i < motion.simulated.size(); ++i)
      if (!motion.simulated[i]) without += (without.empty() ? "" : ", ") + identification.prepared.records[i].name;
    if (!without.empty())
      identification.warnings.push_back(fmt::format(
          "no free run, and so no instruments, for {}: plain least squares there. An inertia and the effects of the "
          "balance are needed for one",
          without));
  }
}

}  // namespace flexspline::estimation
