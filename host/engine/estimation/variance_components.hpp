// Variance components by restricted maximum likelihood: how much coefficients differ from record to record.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace flexspline::estimation {

// Cross products of one record in the model y = X beta + Z b + e, with e of variance `noise` for each sample that
// counts as one, b ~ N(0, diag(variance)) of each record its own.
struct RecordProducts {
  Eigen::MatrixXd xx, xz, zz;
  Eigen::VectorXd xy, zy;
};

struct VarianceComponents {
  Eigen::VectorXd variance;        // of each column of Z
  std::vector<Eigen::VectorXd> b;  // best linear unbiased predictions, by record
  Eigen::VectorXd beta;
};

// What is known of the components before the records: an inverse-gamma density whose mode is about std * std, worth
// `records` of them. A few records alone give zero too often (Chung and others 2013, Psychometrika 78, 685).
struct VariancePrior {
  double std = 0.0;
  double records = 0.0;  // 0: restricted maximum likelihood alone
};

// REML by expectation and maximisation (Dempster, Laird and Rubin 1977; Searle, Casella and McCulloch, Variance
// Components, 8.3), with the noise variance given; with a prior, its posterior mode. Components below `least` (a
// standard deviation) are zero, and all are with fewer than three records, two where there is a prior. Never above
// `most`.
VarianceComponents reml(const std::vector<RecordProducts>& records, double noise, double least, double most,
                        const VariancePrior& prior = {});

}  // namespace flexspline::estimation
