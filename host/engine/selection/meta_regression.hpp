// Random-effects meta-regression: parameters of several records over what an effect would add to each of them.
//
// theta_i = mean + coefficient p_i + u_i + e_i, u_i ~ N(0, T), e_i ~ N(0, S_i), T and S_i diagonal, S_i known, by
// maximum likelihood (Thompson and Sharp 1999; Thompson and Higgins 2002). Significance is by permutation of the
// records (Higgins and Thompson 2004): it holds for few records, and where the parameters of a record differ together,
// which a diagonal T does not say.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace flexspline::selection {

struct MetaRegression {
  double coefficient = 0.0;
  double coefficient_std = 0.0;
  double likelihood_ratio = 0.0;  // twice the logarithm, against coefficient zero
  double explained_share = 0.0;   // of T, mean of the parameters: 0 to 1
  Eigen::VectorXd mean;           // of the parameters, without what the effect adds
};

// Parameters of each record (a row) and their variances within it.
struct RecordParameters {
  Eigen::MatrixXd theta;
  Eigen::MatrixXd variance;
};

// `added` is what a unit of the effect adds to each; more records than parameters + 1.
MetaRegression meta_regression(const RecordParameters& records, const Eigen::MatrixXd& added);

// Whether a coefficient is positive and leaves all parameters zero or above: friction has a sign.
bool is_possible(const MetaRegression& fit);

// The share of the permutations of the records (drawn, the identity among them) in which the best possible of several
// effects reaches the likelihood ratio that it has as recorded. 1 where none is possible.
double permutation_p_value(const RecordParameters& records, const std::vector<Eigen::MatrixXd>& added, int permutations,
                           std::uint64_t seed);

}  // namespace flexspline::selection
