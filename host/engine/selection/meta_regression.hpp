// Random-effects meta-regression: parameters of several records over what an effect would add to each of them.
//
// theta_i = mean + coefficient p_i + u_i + e_i, u_i ~ N(0, T), e_i ~ N(0, S_i), T and S_i diagonal, S_i known, by
// maximum likelihood (Thompson and Sharp 1999; Thompson and Higgins 2002). A record need not identify all parameters:
// it counts with those that it does (Jackson, Riley and White 2011). Significance is by permutation of the records
// (Higgins and Thompson 2004), among those that identify the same parameters: it holds for few records, and where the
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
  double explained_share = 0.0;   // of T, mean of the parameters: 0 to 1
  // Of the coefficient, by Knapp and Hartung 2003 (the variance by the squares that are left, but not below that by the
  // model), and its degrees of freedom: for few records, of which there are few permutations.
  double t = 0.0, freedom = 0.0;
  Eigen::VectorXd mean;  // of the parameters, without what the effect adds
};

// Parameters of each record (a row) and their variances within it. Infinite: the record does not identify the
// parameter, of which the value is any finite one.
struct RecordParameters {
  Eigen::MatrixXd theta;
  Eigen::MatrixXd variance;
};

// `added` is what a unit of the effect adds to each; three or more records identify each parameter.
MetaRegression meta_regression(const RecordParameters& records, const Eigen::MatrixXd& added);

// Whether a coefficient is positive and leaves all parameters zero or above: friction has a sign.
bool is_possible(const MetaRegression& fit);

// Some of the records, and the parameters of which they are compared.
struct RecordSubset {
  std::vector<Eigen::Index> records, parameters;

  Eigen::MatrixXd operator()(const Eigen::MatrixXd& all) const { return all(records, parameters); }
  RecordParameters operator()(const RecordParameters& all) const { return {(*this)(all.theta), (*this)(all.variance)}; }
};

// The share of the permutations of the records (drawn, the identity among them) in which the best possible of several
// effects, in the best of several parts, reaches the likelihood ratio that it has as recorded (that the part was
// searched for is then in the p-value: Hansen 1996). 1 where none is possible. Drawing ends after twenty that reach it
// (Besag and Clifford 1991): then the share is known to a fifth.
double permutation_p_value(const RecordParameters& records, const std::vector<Eigen::MatrixXd>& added,
                           const std::vector<RecordSubset>& parts, int permutations, std::uint64_t seed);

// The subset that is all of them.
RecordSubset every_record(const RecordParameters& records);

}  // namespace flexspline::selection
