#include "host/engine/estimation/effort_timing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "host/common/signals/interpolate.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/linearised.hpp"
#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/estimation/zero_order_hold.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;

std::vector<Eigen::VectorXd> no_change(const Identification& found) {
  std::vector<Eigen::VectorXd> changes;
  for (const BalanceFit& fit : found.fits) changes.emplace_back(Eigen::VectorXd::Zero(fit.covariance.rows()));
  return changes;
}

std::vector<data::Experiment> with_earlier_effort(const Identification& found, double by_s) {
  std::vector<data::Experiment> experiments;
  for (const Record& record : found.prepared.records) {
    data::Experiment& e = experiments.emplace_back(*record.experiment);
    const Column column = e.has(Column::current) ? Column::current : Column::motor_torque;
    if (!e.has(column)) continue;
    const std::span<double> effort(e[column]);
    for (const data::Segment& s : record.segments) {
      const std::span<double> part = effort.subspan(s.first, s.last - s.first);
      std::ranges::copy(signals::fractional_delay(part, -by_s / record.sample_s), part.begin());
    }
  }
  return experiments;
}

// Estimates and their covariance with errors that last (Newey and West).
struct WithVariance {
  Eigen::VectorXd theta, variance;
};
std::optional<WithVariance> estimated(const Eigen::MatrixXd& columns, const Eigen::VectorXd& target,
                                      const RegressionProblem& data, const BalanceFit& fit) {
  const LinearFit found = generalised_least_squares(columns, target, fit.error_covariance);
  if (!found.unit_covariance.allFinite()) return std::nullopt;
  const Eigen::MatrixXd middle =
      newey_west(data.records(), fit.error_covariance.score_columns(columns),
                 fit.root_weights.cwiseProduct(found.residual), newey_west_lags(fit.autocorrelation_time, data.rows()));
  return WithVariance{found.theta, (found.unit_covariance * middle * found.unit_covariance).diagonal()};
}

}  // namespace

bool EffortLag::is_certain() const {
  constexpr double kCertainErrors = 3.0;
  return std::abs(lag_s) > kCertainErrors * std_s;
}

std::optional<EffortLag> effort_lag(const Identification& found) {
  const auto motor = std::ranges::find(found.data, Balance::motor, &RegressionProblem::balance);
  if (motor == found.data.end() || has_delay_of_current(found.terms)) return std::nullopt;
  const auto b = static_cast<std::size_t>(motor - found.data.begin());
  const auto parameters = parameters_with_errors(found);
  if (parameters[b].empty()) return std::nullopt;
  double step_s = std::numeric_limits<double>::max();
  for (const Record& record : found.prepared.records) step_s = std::min(step_s, 0.5 * record.sample_s);
  const std::vector<data::Experiment> earlier = with_earlier_effort(found, step_s);
  std::vector<const data::Experiment*> experiments;
  for (const data::Experiment& e : earlier) experiments.push_back(&e);
  const Linearised shifted = linearised_with(found, experiments, found.prepared.pipeline, parameters)[b];
  const BalanceFit& fit = found.fits[b];
  const Linearised own = linearised(*motor, fit, found.terms, parameters[b]);
  const Eigen::Index n = own.J.cols();
  Eigen::MatrixXd with_lag(own.J.rows(), n + 1);
  Eigen::VectorXd slope = (own.residual - shifted.residual) / step_s;
  with_lag << own.J, slope;
  const auto without = estimated(own.J, own.residual, *motor, fit),
             with = estimated(with_lag, own.residual, *motor, fit);
  if (!without || !with) return std::nullopt;
  EffortLag lag{with->theta[n], std::sqrt(with->variance[n]), no_change(found), std::move(slope)};
  const Eigen::VectorXd change = with->theta.head(n) - without->theta;
  const Eigen::VectorXd of_noise = (with->variance.head(n) - without->variance).cwiseAbs();
  for (Eigen::Index j = 0; j < n; ++j)
    lag.change[b][parameters[b][static_cast<std::size_t>(j)]] =
        std::copysign(std::sqrt(std::max(change[j] * change[j] - of_noise[j], 0.0)), change[j]);
  return lag;
}

std::vector<Eigen::VectorXd> change_by_held_step(const Identification& found) {
  std::vector<Eigen::VectorXd> changes = no_change(found);
  if (found.prepared.pipeline.torque_per_step != 0.0) return changes;
  const HeldStep step = held_step(found.prepared);
  if (!step.may_lack) return changes;
  Pipeline corrected = found.prepared.pipeline;
  corrected.torque_per_step = step.torque_per_step;
  std::vector<const data::Experiment*> experiments;
  for (const Record& record : found.prepared.records) experiments.push_back(record.experiment);
  const auto parameters = parameters_with_errors(found);
  const std::vector<Linearised> others = linearised_with(found, experiments, corrected, parameters);
  for (std::size_t b = 0; b < found.fits.size(); ++b) {
    if (parameters[b].empty()) continue;
    const Linearised own = linearised(found.data[b], found.fits[b], found.terms, parameters[b]);
    const auto estimate = [&](const Linearised& data) {
      return generalised_least_squares(data.J, data.residual, found.fits[b].error_covariance).theta;
    };
    changes[b](parameters[b]) = estimate(others[b]) - estimate(own);
  }
  return changes;
}

}  // namespace flexspline::estimation
