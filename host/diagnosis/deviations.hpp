// Friction that differs from run to run: a factor of each friction group in each record, of which only the spread is
// known. Deviations are eliminated from each record's triangle (a Schur complement, done orthogonally), so that the
// parameters are those of generalised least squares with the deviations' covariance.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/diagnosis/triangles.hpp"
#include "host/regression/between_records.hpp"

namespace flexspline::diagnosis {

using regression::directions;
using regression::friction_groups;
using regression::Group;
using regression::kFewestRecords;
using regression::kMostGroups;

using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostGroups, 1>;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostGroups, kMostGroups>;

// A record's error e against the groups' torques Z: all that its likelihood needs.
struct RecordSums {
  double rows = 0.0;
  double squares = 0.0;  // e'e
  SmallVector along;     // Z'e
  SmallMatrix own;       // Z'Z
};

// Spread and noise that explain the records' errors best.
struct Spread {
  SmallVector std;                     // of each group, relative
  std::vector<double> variance;        // noise of each record, deviations taken off, (N m)^2
  std::vector<SmallVector> by_record;  // the deviations, relative
  std::vector<double> squares;         // e'e with the deviations taken off
  // Minus twice the log likelihood of each record, with rows over `tau` that count: n/tau ln(variance) and what the
  // deviations cost.
  std::vector<double> deviance;
};
// Maximises the likelihood of e ~ N(0, variance tau + Z std^2 Z') over the spreads and the records' variances, which
// are not taken smaller than `least_variance`. Fewer than kFewestRecords records with the group have a spread of
// nought. The search begins at `variance`, or at errors that are all noise where that is empty.
Spread estimate_spread(const std::vector<RecordSums>& records, double tau, double least_variance,
                       const std::vector<double>& variance = {});
// The same with the spreads given.
Spread with_spread(const std::vector<RecordSums>& records, const SmallVector& std, double tau, double least_variance);
// With the largest that a spread may be, of all groups that have enough records.
Spread with_largest_spread(const std::vector<RecordSums>& records, double tau, double least_variance);
// The deviations that are likeliest in noise of this variance (tau in it).
SmallVector best_deviations(const RecordSums& record, const SmallVector& std, double noise_variance);
// What they cost: their squares over those of the spread, and the log determinant of the spread over the noise.
struct Cost {
  double squares = 0.0;
  double log_det = 0.0;
};
Cost cost_of_deviations(const RecordSums& record, const SmallVector& std, double noise_variance);

// A record's triangle of [X y] over the root of its noise, with deviations along X u of this standard deviation (the
// columns of `u`) eliminated: the triangle of generalised least squares.
Eigen::MatrixXd without_deviations(const Eigen::MatrixXd& triangle, const Eigen::MatrixXd& u, const SmallVector& std,
                                   double noise_variance);

// Sums of the error that `theta` (of the scaled columns) leaves in a triangle; adds to `sums`.
void add_sums(const Eigen::MatrixXd& triangle, const Eigen::VectorXd& theta, const Eigen::MatrixXd& u, double rows,
              RecordSums& sums);

}  // namespace flexspline::diagnosis
