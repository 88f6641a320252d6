// Parameters of friction by record that follow a law of the speed, for meta-regression.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "host/engine/selection/meta_regression.hpp"

namespace flexspline::tests {

// Parameters without errors of their own.
inline selection::RecordParameters exact(const Eigen::MatrixXd& theta) {
  return {theta, Eigen::MatrixXd::Zero(theta.rows(), theta.cols())};
}

// Two parameters a record; `added` is what the law adds to them for a coefficient of one.
struct RecordsWithLaw {
  Eigen::MatrixXd theta, added;
  RecordsWithLaw(Eigen::Index records, double coefficient, unsigned seed) : theta(records, 2), added(records, 2) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (Eigen::Index i = 0; i < records; ++i) {
      const double speed = 1.0 + 0.1 * static_cast<double>(i);
      added.row(i) << 0.5 / std::sqrt(speed), std::sqrt(speed);
      theta.row(i) << 2.0 + coefficient * added(i, 0) + 0.05 * normal(random),
          7.0 + coefficient * added(i, 1) + 0.3 * normal(random);
    }
  }
};

}  // namespace flexspline::tests
