#include "host/engine/estimation/evidence.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/record_variance.hpp"

namespace flexspline::estimation {

Eigen::MatrixXd cross_balance_columns(const RegressionProblem& data, const Terms& terms, std::size_t t,
                                      const std::vector<std::size_t>& parameters) {
  constexpr double kStep = 1e-3;  // of the usual value
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(data.rows(), static_cast<Eigen::Index>(parameters.size()));
  if (!terms[t].entry->adds_to(data.balance())) return columns;
  const Eigen::VectorXd at = data.term_torque(terms, t);
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    Terms moved = terms;
    const double usual = std::abs(terms[t].entry->parameters[parameters[k]].usual);
    double step = kStep * std::max(usual, std::abs(terms[t].values[parameters[k]]));
    // The cosine or sine part of a wave that is usually zero has the scale of the other.
    for (const auto& info : terms[t].entry->parameters)
      if (info.kind == terms[t].entry->parameters[parameters[k]].kind)
        step = std::max(step, kStep * std::abs(info.usual));
    moved[t].values[parameters[k]] += step;
    columns.col(static_cast<Eigen::Index>(k)) = (data.term_torque(moved, t) - at) / step;
  }
  return columns;
}

ScoreAndInformation score_and_information(const Eigen::MatrixXd& cross_columns, const Eigen::MatrixXd& own,
                                          const Eigen::VectorXd& residual, const NoiseCovariance& error_covariance,
                                          double autocorrelation_time) {
  Eigen::MatrixXd left = error_covariance.whiten(cross_columns);
  Eigen::MatrixXd scaled = error_covariance.whiten(own);
  for (auto column : scaled.colwise()) column /= std::max(column.norm(), 1e-300);
  if (scaled.cols() > 0) {
    const Eigen::MatrixXd span = algebra::PivotedQr(scaled, 1e-7).span();
    left -= span * (span.transpose() * left);
  }
  return {left.transpose() * error_covariance.whiten(residual).col(0) / autocorrelation_time,
          left.transpose() * left / autocorrelation_time};
}

NoiseModel noise_model(const Eigen::MatrixXd& cross_columns, const Eigen::MatrixXd& own, const RegressionProblem& data,
                       const Terms& terms, const BalanceFit& fit, const Eigen::VectorXd& residual) {
  Eigen::MatrixXd all(own.rows(), own.cols() + cross_columns.cols());
  all << own, cross_columns;
  Eigen::VectorXd weights = fit.root_weights;
  LinearFit moved = least_squares(all, residual, weights);
  weights = root_record_weights(data.records(), moved.residual);
  moved = least_squares(all, residual, weights);
  const NoiseModel alike{weights, autocorrelation_time(data, weights.cwiseProduct(moved.residual))};
  const auto friction = [&] {
    Eigen::VectorXd theta = moved.theta.head(own.cols());
    for (std::size_t j = 0; j < fit.linear.size(); ++j)
      theta[static_cast<Eigen::Index>(j)] += terms[fit.linear[j].term].values[fit.linear[j].parameter];
    return friction_torques(own, theta, terms, fit.linear, fit.nonlinear);
  };
  const auto differences = [&](const Eigen::MatrixXd& torques) {
    return paule_mandel(data, weights.asDiagonal() * torques, weights.cwiseProduct(moved.residual));
  };
  Eigen::MatrixXd torques = friction();
  RecordVariance between = differences(torques);
  NoiseCovariance error_covariance = weights;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds && between.std.size() > 0 && between.std.maxCoeff() > 0.0; ++round) {
    weights = root_record_weights(data.records(), between.left.cwiseQuotient(weights));
    error_covariance =
        noise_covariance(data, weights, weights.asDiagonal() * torques, between.std, between.autocorrelation_time);
    moved = generalised_least_squares(all, residual, error_covariance);
    torques = friction();
    between = differences(torques);
  }
  if (error_covariance.is_diagonal() || !between.leaves_noise) return alike;
  return {error_covariance, between.autocorrelation_time};
}

Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& symmetric) {
  const Eigen::VectorXd scale = symmetric.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  return scale.asDiagonal() * algebra::inverse_of(scale.asDiagonal() * symmetric * scale.asDiagonal()) *
         scale.asDiagonal();
}

CombinedEstimate combine(const Eigen::MatrixXd& precision, const ScoreAndInformation& other) {
  CombinedEstimate result;
  result.covariance = scaled_inverse(precision + other.information);
  result.change = result.covariance * other.score;
  result.cost = result.change.dot(precision * result.change);
  return result;
}

}  // namespace flexspline::estimation
