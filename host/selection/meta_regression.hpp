// Random-effects meta-regression: parameters of several records over what an effect would add to each of them.
//
// theta_i = mean + coefficient p_i + u_i, u_i ~ N(0, T), T diagonal, by maximum likelihood (Thompson and Higgins 2002).
// Errors within a record are neglected against T, so parameters must be known much better than they differ.
// Significance is by permutation of the records (Higgins and Thompson 2004): it holds for few records, and where the
// parameters of a record differ together, which a diagonal T does not say.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace flexspline::selection {

struct MetaRegression {
  double coefficient = 0.0;
  double coefficient_std = 0.0;
  double likelihood_ratio = 0.0;  // twice the logarithm, against coefficient zero
  double explained_share = 0.0;   // of the variance between records, geometric mean of the parameters: 0 to 1
  Eigen::VectorXd mean;           // of the parameters, without what the effect adds
};

// Rows are records, columns parameters. `theta` and `added` have the same shape; more records than parameters + 1.
MetaRegression meta_regression(const Eigen::MatrixXd& theta, const Eigen::MatrixXd& added);

// Whether a coefficient is positive and leaves all parameters zero or above: friction has a sign.
bool is_possible(const MetaRegression& fit);

// The share of the permutations of the records (drawn, the identity among them) in which the best possible of several
// effects reaches the likelihood ratio that it has as recorded. 1 where none is possible.
double permutation_p_value(const Eigen::MatrixXd& theta, const std::vector<Eigen::MatrixXd>& added, int permutations,
                           std::uint64_t seed);

}  // namespace flexspline::selection
