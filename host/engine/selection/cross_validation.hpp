// How much better an extended model predicts data that it was not fitted on.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "host/engine/estimation/noise_covariance.hpp"
#include "host/engine/estimation/random_effects.hpp"
#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::selection {

using estimation::FrictionGroup;
using estimation::NoiseCovariance;
using estimation::ParameterRef;
using estimation::RandomEffects;
using estimation::RecordErrors;
using estimation::RegressionProblem;
using estimation::RowRange;
using estimation::SmallVector;
using estimation::Terms;

// Parts that each record is cut into: part k of all records is predicted from the other parts. Whole records cannot be
// left out, because some parameters are shown by a single one (a record at rest, a warm one).
inline constexpr std::size_t kFolds = 5;

// A record's samples, each predicted from others: parameters from all records without its part, the record's own random
// effects from its other parts.
struct LeftOut {
  double rows = 0.0;
  double squares = 0.0;
  std::array<double, kFolds> squares_of_part{};
};

/// By how many standard errors the error of one model on the left-out parts of all records is larger than that of
/// another one: the differences of the squares by part, in units of the record's noise as the other one leaves it. Zero
/// where it is not larger.
double standard_errors_over(const std::vector<LeftOut>& larger, const std::vector<LeftOut>& other);

// Root mean square of the residual over samples with weight.
double rmse_of(const Eigen::VectorXd& residual, const Eigen::VectorXd& root_weights);
double rmse_of(const std::vector<LeftOut>& records);

// The same model without random effects, as a drive would run it. Random effects may hide a missing effect that differs
// between records; this fit shows it.
struct FixedEffectsFit {
  Eigen::VectorXd residual;
  Eigen::VectorXd root_weights;
  std::vector<LeftOut> left_out;
};

// A model on one balance, fitted with weights by record and cross-validated. Its nonlinear parameters are free to first
// order, and so is a delay of the effort.
struct CrossValidatedFit {
  Terms terms;  // with fitted values
  std::vector<ParameterRef> linear;
  Eigen::VectorXd theta;           // linear parameters, then shifts of nonlinear parameters, then the delay in s
  Eigen::VectorXd std;             // likewise; corrected for autocorrelation
  Eigen::MatrixXd covariance;      // likewise; infinite on what is not determined
  Eigen::VectorXd root_tolerance;  // likewise
  Eigen::VectorXd residual;        // in-sample, less the records' random effects
  Eigen::VectorXd root_weights;    // zero where a disturbance is left out
  double autocorrelation_time = 1.0;
  std::vector<FrictionGroup> groups;  // friction that differs from record to record
  RandomEffects random_effects;       // in-sample
  std::vector<RecordErrors> errors;   // of each record, in-sample, random effects in
  std::vector<LeftOut> left_out;      // of each record
  FixedEffectsFit fixed_effects;      // empty where there are no random effects
  double rmse() const { return rmse_of(residual, root_weights); }
  double rmse_cv() const { return rmse_of(left_out); }
  bool has_random_effects() const { return !fixed_effects.left_out.empty(); }
  const Eigen::VectorXd& residual_fixed_effects() const {
    return has_random_effects() ? fixed_effects.residual : residual;
  }
  const Eigen::VectorXd& root_weights_fixed_effects() const {
    return has_random_effects() ? fixed_effects.root_weights : root_weights;
  }
  const std::vector<LeftOut>& left_out_fixed_effects() const {
    return has_random_effects() ? fixed_effects.left_out : left_out;
  }
  double rmse_fixed_effects() const { return rmse_of(residual_fixed_effects(), root_weights); }
  double rmse_cv_fixed_effects() const { return rmse_of(left_out_fixed_effects()); }
};

// Fits `terms` on `data` and cross-validates them by fifths of each record. `keep` holds one a sample, or zero for
// samples that must not count.
CrossValidatedFit cross_validate(const RegressionProblem& data, Terms terms, const Eigen::VectorXd& keep);

// Covariance of the errors of a fit, random effects among them.
NoiseCovariance noise_covariance(const RegressionProblem& data, const CrossValidatedFit& fit);
// Whitened squares that `terms` leave after their best linear fit, with noise and random effects as `fit` has them:
// enough to choose a nonlinear parameter on a grid.
double whitened_squares(const RegressionProblem& data, const Terms& terms, const CrossValidatedFit& fit);

struct LikelihoodGain {
  // Twice the log likelihood ratio of left-out samples over the autocorrelation time, less k ln(n_eff), the penalty of
  // the BIC (Schwarz 1978); in addition to cross-validation it is a margin, calibrated with named_score.hpp.
  double score = 0.0;
  double chi2_percent = 0.0;           // of the left-out chi-square
  double fixed_effects_percent = 0.0;  // the same with one friction for all records
  double p_value = 1.0;
};
// From `base` to `extended`, which has `added` parameters more. Noise is each record's own, and so are each model's
// random effects; a record that is quieter than a tenth of the median one counts as that.
LikelihoodGain likelihood_gain(const CrossValidatedFit& base, const CrossValidatedFit& extended, double added);

}  // namespace flexspline::selection
