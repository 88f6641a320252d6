// Parameters by output error: those with which the model, run on the measured current alone, comes nearest to the
// measured velocity. What makes a shaft break away lasts a few samples, which a regression on filtered rows must mask;
// when it breaks away, and how far it jumps, the free run keeps.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/physics/simulation/simulation.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::tests {

struct FreeParameter {
  std::vector<std::pair<std::string, std::string>> places;  // effect and parameter; several have one value
  std::vector<double> starts;
};

struct FreeRunFit {
  std::vector<double> values, low, high;  // with 95 % intervals, of the logarithm
  double rmse = 0.0;                      // of the velocity
};

// Errors of a model's free run as a function of the logarithms of some parameters.
class FreeRunError {
 public:
  // The current is taken without what is above `current_cutoff_hz`, as noise makes a shaft break away early.
  FreeRunError(data::Experiment experiment, model::Model model, const std::vector<FreeParameter>& parameters,
               double current_cutoff_hz)
      : experiment_(std::move(experiment)),
        model_(std::move(model)),
        parameters_(parameters),
        measured_(experiment_[data::Column::motor_velocity]) {
    const signals::ZeroPhaseFilter filter(5, current_cutoff_hz, 1.0 / experiment_.sample_s);
    experiment_[data::Column::current] = filter.apply(experiment_[data::Column::current]);
    options_.step_s = 0.25e-3;  // 1/16 ms gives the same to 0.1 %
    options_.initial_motor_velocity = 0.0;
  }

  Eigen::Index samples() const { return static_cast<Eigen::Index>(measured_.size()); }
  double sample_s() const { return experiment_.sample_s; }

  Eigen::VectorXd at(const Eigen::VectorXd& logs) {
    for (std::size_t j = 0; j < parameters_.size(); ++j)
      for (const auto& [effect, parameter] : parameters_[j].places)
        fix(model_, effect, parameter, std::exp(logs[static_cast<Eigen::Index>(j)]));
    const simulation::FreeRun run = simulation::run(model_, experiment_, options_);
    return Eigen::Map<const Eigen::VectorXd>(measured_.data(), samples()) -
           Eigen::Map<const Eigen::VectorXd>(run.motor_velocity.data(), samples());
  }

  Eigen::MatrixXd slopes(const Eigen::VectorXd& logs) {
    // Wider than the steps in which a simulation on a grid of time breaks away.
    constexpr double kStep = 1e-2;
    Eigen::MatrixXd columns(samples(), logs.size());
    for (Eigen::Index j = 0; j < logs.size(); ++j) {
      const Eigen::VectorXd step = Eigen::VectorXd::Unit(logs.size(), j) * kStep;
      columns.col(j) = (at(logs + step) - at(logs - step)) / (2.0 * kStep);
    }
    return columns;
  }

 private:
  data::Experiment experiment_;
  model::Model model_;
  const std::vector<FreeParameter>& parameters_;
  std::vector<double> measured_;
  simulation::Options options_;
};

// Levenberg and Marquardt's search from `at`, which it moves. Returns the errors there.
inline Eigen::VectorXd descend(FreeRunError& error, Eigen::VectorXd& at) {
  Eigen::VectorXd r = error.at(at);
  double damping = 1e-2;
  for (int iteration = 0; iteration < 40; ++iteration) {
    const Eigen::MatrixXd slopes = error.slopes(at);
    const Eigen::VectorXd gradient = slopes.transpose() * r;
    double moved_by = 0.0;
    for (int trial = 0; trial < 5 && moved_by == 0.0; ++trial) {
      Eigen::MatrixXd damped = slopes.transpose() * slopes;
      damped.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd step = damped.ldlt().solve(-gradient).cwiseMax(-0.7).cwiseMin(0.7);
      const Eigen::VectorXd next = error.at(at + step);
      const bool better = next.squaredNorm() < r.squaredNorm();
      damping *= better ? 0.2 : 5.0;
      if (!better) continue;
      moved_by = step.cwiseAbs().maxCoeff();
      at += step;
      r = next;
    }
    if (moved_by < 3e-3) break;
  }
  return r;
}

// Where a search ended: the parameters' logarithms, the errors there, and a jackknife's deviations.
struct FreeRunEnd {
  Eigen::VectorXd at, errors, deviations;
};

// Deviations by a jackknife over blocks of samples, to first order, as errors of one stroke go together.
inline Eigen::VectorXd jackknife(FreeRunError& error, const FreeRunEnd& end, Eigen::Index block) {
  const Eigen::MatrixXd slopes = error.slopes(end.at), normal = slopes.transpose() * slopes;
  Eigen::VectorXd variances = Eigen::VectorXd::Zero(end.at.size());
  for (Eigen::Index first = 0; first + block <= error.samples(); first += block) {
    const auto part = slopes.middleRows(first, block);
    const Eigen::VectorXd score = part.transpose() * end.errors.segment(first, block);
    variances += (normal - part.transpose() * part).ldlt().solve(score).cwiseAbs2();
  }
  return variances.cwiseSqrt();
}

// Whether the errors of one end are larger than those of another by more than they differ from block to block.
inline bool surely_worse(const FreeRunEnd& end, const FreeRunEnd& best, Eigen::Index block) {
  double sum = 0.0, squares = 0.0;
  for (Eigen::Index first = 0; first + block <= best.errors.size(); first += block) {
    const double more =
        end.errors.segment(first, block).squaredNorm() - best.errors.segment(first, block).squaredNorm();
    sum += more;
    squares += more * more;
  }
  return sum > 2.0 * std::sqrt(squares);
}

// Fits positive parameters. The first one's starts are tried for each combination of the others', which each begin a
// search: a friction too large never lets go and has no slope that would say so, and there are local minima. An
// interval spans those that the data cannot tell from the best.
inline FreeRunFit fit_free_run(const data::Experiment& experiment, const model::Model& model,
                               const std::vector<FreeParameter>& parameters, double current_cutoff_hz, double block_s) {
  FreeRunError error(experiment, model, parameters, current_cutoff_hz);
  const auto p = static_cast<Eigen::Index>(parameters.size());
  const auto block = static_cast<Eigen::Index>(std::lround(block_s / error.sample_s()));
  std::size_t combinations = 1;
  for (std::size_t j = 1; j < parameters.size(); ++j) combinations *= parameters[j].starts.size();
  std::vector<FreeRunEnd> ends;
  for (std::size_t c = 0; c < combinations; ++c) {
    Eigen::VectorXd start(p);
    std::size_t rest = c;
    for (std::size_t j = 1; j < parameters.size(); ++j) {
      start[static_cast<Eigen::Index>(j)] = std::log(parameters[j].starts[rest % parameters[j].starts.size()]);
      rest /= parameters[j].starts.size();
    }
    double least = 0.0, first = 0.0;
    for (const double value : parameters.front().starts) {
      start[0] = std::log(value);
      const double left = error.at(start).squaredNorm();
      if (least != 0.0 && left >= least) continue;
      least = left;
      first = start[0];
    }
    start[0] = first;
    FreeRunEnd end;
    end.errors = descend(error, start);
    end.at = start;
    end.deviations = jackknife(error, end, block);
    ends.push_back(std::move(end));
  }
  const FreeRunEnd best = *std::min_element(ends.begin(), ends.end(), [](const FreeRunEnd& a, const FreeRunEnd& b) {
    return a.errors.squaredNorm() < b.errors.squaredNorm();
  });
  Eigen::VectorXd low = best.at, high = best.at;
  for (const FreeRunEnd& end : ends) {
    if (surely_worse(end, best, block)) continue;
    low = low.cwiseMin(end.at - 2.0 * end.deviations);
    high = high.cwiseMax(end.at + 2.0 * end.deviations);
  }
  FreeRunFit fit;
  fit.rmse = std::sqrt(best.errors.squaredNorm() / static_cast<double>(error.samples()));
  for (Eigen::Index j = 0; j < p; ++j) {
    fit.values.push_back(std::exp(best.at[j]));
    fit.low.push_back(std::exp(low[j]));
    fit.high.push_back(std::exp(high[j]));
  }
  return fit;
}

}  // namespace flexspline::tests
