// Parameters by output error: those with which the model, run on the measured current alone, comes nearest to the
// measured velocity. What makes a shaft break away lasts a few samples, which a regression on filtered rows must mask;
// when it breaks away, and how far it jumps, the free run keeps.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "host/signals/butterworth.hpp"
#include "host/simulation/simulation.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::testing {

struct FreeParameter {
  std::vector<std::pair<std::string, std::string>> places;  // effect and parameter; several have one value
  std::vector<double> starts;  // all combinations are tried, and the best is where the search begins
};

struct FreeRunFit {
  std::vector<double> values, std, low, high;  // with 95 % intervals, of the logarithm
  double rmse = 0.0;                           // of the velocity
};

// The free run of one experiment on its current without what is above `current_cutoff_hz`, as noise makes a shaft break
// away early. Positive parameters, searched by their logarithm. The covariance is a jackknife over blocks of a
// `block_s`, as those of one stroke do.
inline FreeRunFit fit_free_run(data::Experiment experiment, model::Model model,
                               const std::vector<FreeParameter>& parameters, double current_cutoff_hz, double block_s) {
  const std::vector<double> measured = experiment[data::Column::motor_velocity];
  const signals::ZeroPhaseFilter filter(5, current_cutoff_hz, 1.0 / experiment.sample_s);
  experiment[data::Column::current] = filter.apply(experiment[data::Column::current]);
  simulation::Options options;
  options.step_s = 0.25e-3;  // 1/16 ms gives the same to 0.1 %
  options.initial_motor_velocity = 0.0;
  const auto n = static_cast<Eigen::Index>(measured.size()), p = static_cast<Eigen::Index>(parameters.size());
  const auto residual = [&](const Eigen::VectorXd& logs) {
    for (Eigen::Index j = 0; j < p; ++j)
      for (const auto& [effect, parameter] : parameters[static_cast<std::size_t>(j)].places)
        fix(model, effect, parameter, std::exp(logs[j]));
    const simulation::FreeRun run = simulation::run(model, experiment, options);
    Eigen::VectorXd r(n);
    for (Eigen::Index k = 0; k < n; ++k)
      r[k] = measured[static_cast<std::size_t>(k)] - run.motor_velocity[static_cast<std::size_t>(k)];
    return r;
  };
  // A friction too large never lets go, and has no slope that would say so.
  Eigen::VectorXd at(p), r;
  std::size_t combinations = 1;
  for (const FreeParameter& one : parameters) combinations *= one.starts.size();
  for (std::size_t c = 0; c < combinations; ++c) {
    Eigen::VectorXd trial(p);
    std::size_t rest = c;
    for (Eigen::Index j = 0; j < p; ++j) {
      const std::vector<double>& starts = parameters[static_cast<std::size_t>(j)].starts;
      trial[j] = std::log(starts[rest % starts.size()]);
      rest /= starts.size();
    }
    const Eigen::VectorXd left = residual(trial);
    if (r.size() != 0 && left.squaredNorm() >= r.squaredNorm()) continue;
    r = left;
    at = trial;
  }
  Eigen::MatrixXd slopes(n, p);
  double damping = 1e-2;
  constexpr double kStep = 1e-3;
  for (int iteration = 0; iteration < 40; ++iteration) {
    for (Eigen::Index j = 0; j < p; ++j) {
      Eigen::VectorXd up = at, down = at;
      up[j] += kStep;
      down[j] -= kStep;
      slopes.col(j) = (residual(up) - residual(down)) / (2.0 * kStep);
    }
    const Eigen::MatrixXd normal = slopes.transpose() * slopes;
    const Eigen::VectorXd gradient = slopes.transpose() * r;
    bool moved = false;
    double step_size = 0.0;
    for (int trial = 0; trial < 8 && !moved; ++trial) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd step = damped.ldlt().solve(-gradient).cwiseMax(-0.7).cwiseMin(0.7);
      const Eigen::VectorXd next = residual(at + step);
      moved = next.squaredNorm() < r.squaredNorm();
      damping *= moved ? 0.2 : 5.0;
      if (!moved) continue;
      step_size = step.cwiseAbs().maxCoeff();
      at += step;
      r = next;
    }
    if (!moved || step_size < 1e-4) break;
  }
  // Delete-a-block jackknife, to first order.
  const Eigen::MatrixXd normal = slopes.transpose() * slopes;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(p, p);
  const auto block = static_cast<Eigen::Index>(std::lround(block_s / experiment.sample_s));
  const Eigen::Index blocks = n / block;
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const auto part = slopes.middleRows(b * block, block);
    const Eigen::VectorXd score = part.transpose() * r.segment(b * block, block);
    const Eigen::VectorXd shift = (normal - part.transpose() * part).ldlt().solve(score);
    covariance += shift * shift.transpose();
  }
  FreeRunFit fit;
  fit.rmse = std::sqrt(r.squaredNorm() / static_cast<double>(n));
  for (Eigen::Index j = 0; j < p; ++j) {
    const double value = std::exp(at[j]), deviation = std::sqrt(covariance(j, j));
    fit.values.push_back(value);
    fit.std.push_back(value * deviation);
    fit.low.push_back(value * std::exp(-2.0 * deviation));
    fit.high.push_back(value * std::exp(2.0 * deviation));
  }
  return fit;
}

}  // namespace flexspline::testing
