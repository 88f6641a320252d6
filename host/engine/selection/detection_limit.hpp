// The size of an effect at which its expected score equals the limit: one of that size is named in about half of such
// data sets.
#pragma once

#include <optional>

#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

// What the search is expected to find if an effect is there: its own score (`likelihood_gain`), where the model that
// lacks the effect leaves, in addition to the noise, the orthogonal part of the effect's torque.
class DetectionLimit {
 public:
  explicit DetectionLimit(const BalanceSearch& search);

  // Nothing where the effect has no single size, or none within its bounds would be named.
  std::optional<Detectable> smallest(const CandidateFit& candidate) const;

 private:
  bool named(const CandidateFit& candidate, const Eigen::VectorXd& own, double scale) const;
  std::optional<double> scale_to_name(const CandidateFit& candidate, const Eigen::VectorXd& torque) const;
  std::optional<Detectable> of_linear(const CandidateFit& candidate, estimation::Terms terms) const;
  std::optional<Detectable> of_wave(const CandidateFit& candidate, estimation::Terms terms) const;
  std::optional<Detectable> of_nonlinear(const CandidateFit& candidate, estimation::Terms terms) const;

  const BalanceSearch* search_;
  RegressionProblem coarse_;  // the same samples from decimated signals: near enough for a size
  estimation::ModelProjection projection_;
  Eigen::VectorXd base_torque_;
};

}  // namespace flexspline::selection
