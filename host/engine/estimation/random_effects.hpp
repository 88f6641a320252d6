// Friction that differs from run to run, as random effects: a factor of each friction group in each record, of which
// only the standard deviation is known. They are eliminated from each record's R factor (a Schur complement, done
// orthogonally), so that the parameters are those of generalised least squares with the random effects' covariance.
#pragma once

#include <Eigen/Core>
#include <numeric>
#include <vector>

#include "host/engine/estimation/friction_groups.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/record_factors.hpp"

namespace flexspline::estimation {

using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostGroups, 1>;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostGroups, kMostGroups>;

// Cross products of a record's error e with the groups' torques Z: all that its likelihood needs.
struct RecordErrors {
  double rows = 0.0;
  double ee = 0.0;
  SmallVector ze;
  SmallMatrix zz;
};

// Standard deviations and noise of greatest likelihood.
struct RandomEffects {
  SmallVector std;                       // of each group, relative
  std::vector<double> variance;          // noise of each record, random effects taken off, (N m)^2
  std::vector<SmallVector> predictions;  // by record: best linear unbiased predictions, relative
  std::vector<double> squares;           // e'e with the predictions taken off
  // Minus twice the log likelihood of each record, with samples over `tau` that count: n/tau ln(variance) and what the
  // random effects cost.
  std::vector<double> deviance;
};
// Maximises the likelihood of e ~ N(0, variance tau + Z std^2 Z') over the standard deviations and the records'
// variances, which are not taken smaller than `least_variance`. A group that fewer than kFewestRecords records have
// gets zero. The search begins at `variance`, or at errors that are all noise where that is empty.
RandomEffects fit_random_effects(const std::vector<RecordErrors>& records, double tau, double least_variance,
                                 const std::vector<double>& variance = {});
// The same with the standard deviations given.
RandomEffects random_effects_at(const std::vector<RecordErrors>& records, const SmallVector& std, double tau,
                                double least_variance);
// With the largest standard deviation that is allowed, for all groups that enough records have.
RandomEffects largest_random_effects(const std::vector<RecordErrors>& records, double tau, double least_variance);
// Best linear unbiased predictions (Henderson 1975) in noise of this variance (tau in it).
SmallVector best_linear_predictions(const RecordErrors& record, const SmallVector& std, double noise_variance);
// What they add to minus twice the log likelihood: their squares over those of the standard deviations, and the log
// determinant of their covariance over the noise.
struct RandomEffectCost {
  double squares = 0.0;
  double log_det = 0.0;
};
RandomEffectCost random_effect_cost(const RecordErrors& record, const SmallVector& std, double noise_variance);

// A record's R factor of [X y] over the root of its noise, with random effects along X u of this standard deviation
// (the columns of `u`) eliminated: the R factor of generalised least squares.
Eigen::MatrixXd eliminate_random_effects(const Eigen::MatrixXd& factor, const Eigen::MatrixXd& u,
                                         const SmallVector& std, double noise_variance);

// Adds the cross products of the error that `theta` (of the scaled columns) leaves in an R factor.
void add_errors(const Eigen::MatrixXd& factor, const Eigen::VectorXd& theta, const Eigen::MatrixXd& u, double rows,
                RecordErrors& record);

// A linear mixed model by maximum likelihood: parameters by generalised least squares, friction that differs between
// records as random effects, and the noise of each record.
struct MixedFit {
  LinearFit linear;   // of the scaled columns
  Eigen::MatrixXd u;  // a group's torque is X times its column
  RandomEffects effects;
  double deviance() const { return std::accumulate(effects.deviance.begin(), effects.deviance.end(), 0.0); }
};

// `tau` samples count as one. Columns of free nonlinear parameters begin at `first_nonlinear`. Two searches begin with
// all that is left as noise and with all of it as random effects; the likelier end counts.
MixedFit fit_mixed_model(const RecordFactors& factors, const std::vector<FrictionGroup>& groups,
                         Eigen::Index first_nonlinear, double tau);

// Of each record, the cross products of the error that `theta` leaves.
std::vector<RecordErrors> record_errors(const RecordFactors& factors, const Eigen::VectorXd& theta,
                                        const Eigen::MatrixXd& u);

// A hundredth of the median record's: noise below that is taken for that.
double least_variance_of(std::vector<double> variances);

// The R factor of all records together, `reduced` a record each.
Eigen::MatrixXd combined_factor(const std::vector<Eigen::MatrixXd>& reduced);

}  // namespace flexspline::estimation
