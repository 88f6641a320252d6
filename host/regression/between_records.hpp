// Friction that differs from record to record (temperature, grease, run-in): by how much, and what that does to
// estimates that were made as if it did not.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/regression/balance_data.hpp"
#include "host/regression/whitening.hpp"

namespace flexspline::regression {

// Friction that varies as one: its columns of the regression.
struct Group {
  std::string name;  // "viscous friction"
  std::vector<Eigen::Index> columns;
  // Shapes that are searched for by unit of a friction that varies, and do not vary with it: the stiffness of the
  // contacts remains what it is where they slide harder, so that its ratio to the friction falls.
  struct Stays {
    Eigen::Index shape;  // its place among the free shapes
    double ratio;        // its value
  };
  std::vector<Stays> stays;
};
inline constexpr Eigen::Index kMostGroups = 4;
// Fewer records than that do not tell a spread.
inline constexpr std::size_t kFewestRecords = 3;

// Groups among the linear parameters that a regression estimates; `shapes` are those that it estimates besides.
std::vector<Group> friction_groups(const Terms& terms, const std::vector<Slot>& linear,
                                   const std::vector<Slot>& shapes = {});

// What a factor of each group does to the torque is X times these, `theta` being the values of the columns of X times
// `size`, which X was divided by. Columns of free shapes, where there are any, begin at `first_shape`.
Eigen::MatrixXd directions(const std::vector<Group>& groups, const Eigen::VectorXd& theta, const Eigen::VectorXd& size,
                           Eigen::Index first_shape);

// Each record has a factor 1 + b on the torque of each group, b of mean nought.
struct BetweenRecords {
  Eigen::VectorXd std;                // of b, by group; nought where records do not differ for certain
  Eigen::VectorXd freedom;            // of that estimate: records that tell it, less one
  Eigen::VectorXd left;               // residual without the records' own factors
  double autocorrelation_time = 1.0;  // of what is left
};

// From a fit's residual and the friction torques (a column a group), both weighted. The variance of b is the one at
// which the factors of the records scatter as they should, after their own errors (Paule and Mandel, 1982).
BetweenRecords between_records(const BalanceData& data, const Eigen::MatrixXd& torques,
                               const Eigen::VectorXd& residual);

// Whether differences of friction leave nothing but noise. A missing effect differs from record to record, too, and to
// take that for friction ruins what the model knows of friction.
bool leaves_noise(const BetweenRecords& between, const BalanceData& data);

// Errors of rows at these weights that records have in common by their own friction: `torques` (weighted, a column a
// group) vary by `std`, noise of which `autocorrelation_time` rows count as one by one.
Whitening whitening_of(const BalanceData& data, const Eigen::VectorXd& root_weights, const Eigen::MatrixXd& torques,
                       const Eigen::VectorXd& std, double autocorrelation_time);

// Covariance of the estimates (`unit` is (X'WX)^-1, `columns` W^1/2 X), `within` being what it is without differences
// between records: what those add, and all of it widened so far that 1.96 standard errors hold 95 % although the
// spread is known from few records (Student's t, degrees of freedom after Satterthwaite).
Eigen::MatrixXd with_differences(const BetweenRecords& between, const BalanceData& data, const Eigen::MatrixXd& torques,
                                 const Eigen::MatrixXd& columns, const Eigen::MatrixXd& unit,
                                 const Eigen::MatrixXd& within);

}  // namespace flexspline::regression
