// A smooth curve, given by points, and other columns in one regression: penalised least squares. Cross-validation
// chooses the smoothness.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace flexspline::estimation {

// Samples of a regression, weighted: target = others * beta + points * t + noise, where t are the values of a curve at
// even points. `fold` says which part each sample belongs to; a sample of weight zero is not used.
struct CurveProblem {
  Eigen::MatrixXd others;
  Eigen::MatrixXd points;  // one column a point: what one unit there adds
  Eigen::VectorXd target;
  Eigen::VectorXd root_weights;
  std::vector<int> fold;  // 0 to folds - 1
  int folds = 5;
  bool closed = false;  // the first point follows the last: an angle
};

struct Curve {
  Eigen::VectorXd value;       // at each point
  Eigen::MatrixXd covariance;  // of the values, for white noise; times the autocorrelation time for other noise
  Eigen::VectorXd beta;
  Eigen::VectorXd residual;                   // unweighted
  double smoothing = 0.0;                     // factor of the squared second differences
  double effective_degrees_of_freedom = 0.0;  // trace of the curve's part of the hat matrix
  double squares_without = 0.0;               // weighted, of samples left out of the fit of the others alone
  double squares_with = 0.0;                  // the same with the curve
  double rows = 0.0;                          // that count
  // What the other columns can draw themselves was left to them: the curve's torque has no part in it. How many
  // directions of the curve that were, and for each the other column that is most like it.
  std::vector<Eigen::Index> left_to;
};

// Minimises |W^(1/2) (target - others beta - points t)|^2 + smoothing |D t|^2 with D the second differences (Whittaker
// 1923; Eilers and Marx 1996 for the view as P-splines of degree one), where t's torque is held orthogonal, in the
// data, to what `others` represent to more than `kCollinear` of its length. The smoothing is the one whose fits predict
// left-out folds best, of so many values over fourteen decades.
inline constexpr int kSmoothings = 29;
Curve fit_curve(const CurveProblem& problem, int smoothings = kSmoothings);
// The same with a given smoothing.
Curve fit_curve_smoothed(const CurveProblem& problem, double smoothing);

// Cosine between a direction of the curve and the span of the others from which on it is theirs.
inline constexpr double kCollinear = 0.995;

// D: for an open curve one row less than two for the points, for a closed one as many as points.
Eigen::MatrixXd second_differences(Eigen::Index points, bool closed);

}  // namespace flexspline::estimation
