// A linear mixed model by maximum likelihood: parameters by generalised least squares, friction that differs between
// records as random effects, and the noise of each record.
#pragma once

#include <Eigen/Core>
#include <numeric>
#include <vector>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/random_effects.hpp"
#include "host/engine/estimation/record_factors.hpp"

namespace flexspline::estimation {

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
