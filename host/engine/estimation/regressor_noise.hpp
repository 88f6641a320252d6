// Bias and additional variance of the estimates that noise of the regressors causes (errors in variables), by SIMEX.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

// Least squares takes its columns for exact. Noise of positions biases them all the same (a noisy column makes its
// parameter smaller; hysteresis that follows noise turns at reversals that did not happen), and its errors may last
// longer than the residual's autocorrelation shows, as those of a hysteresis state do until the next reversal.
struct RegressorNoise {
  Eigen::VectorXd bias;     // of the parameters of a fit: linear, then nonlinear
  Eigen::MatrixXd chance;   // their covariance by this noise alone
  Eigen::MatrixXd counted;  // what of that their standard errors have counted
};

// For each balance, by simulation and extrapolation (Cook and Stefanski 1994): noise as that of each position, and of
// the torque where an effect of the motor's balance reads it, is drawn and added to what was measured, so that its
// variance is twice and four times as large; the change is taken for a power of the variance, and extrapolated to none.
// The same noise is added and subtracted: half the difference of both changes is what is proportional to it, chance;
// half their sum has no such part (antithetic variates, Hammersley and Morton 1956). Each is one Gauss-Newton step from
// the estimates.
//
// A balance whose values rest on the evidence of another one as well is left out.
//
// Noise of a position is what the encoder's steps leave of its smooth motion, with another zero of the encoder; white,
// where it has more than that.
std::vector<RegressorNoise> regressor_noise(const Identification& identification);

// A bias that grows with a power of the noise's variance from one half (noise that adds up by its magnitude) to one,
// from the changes at twice and four times the variance.
double extrapolated_bias(double at_twice, double at_four_times);

}  // namespace flexspline::estimation
