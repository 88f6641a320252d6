// Friction that varies as one from record to record, and what such a variation does to the torque.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/engine/estimation/terms.hpp"

namespace flexspline::estimation {

// Friction that varies as one: its columns of the regression.
struct FrictionGroup {
  std::string name;  // "viscous friction"
  std::vector<Eigen::Index> columns;
  // Nonlinear parameters that are searched for by unit of a friction that varies, and do not vary with it: the
  // stiffness of the contacts remains what it is where they slide harder, so that its ratio to the friction falls.
  struct RatioParameter {
    Eigen::Index nonlinear_ref;  // its place among the free nonlinear parameters
    double ratio;                // its value
  };
  std::vector<RatioParameter> ratio_parameters;
  // What one direction has more of than the other, where the model has a column for that: it varies by a share of the
  // friction, not of itself, as it may have any sign.
  struct Asymmetry {
    Eigen::Index column, of;
  };
  std::vector<Asymmetry> asymmetries;
};
inline constexpr Eigen::Index kMostGroups = 8;
// Fewer records than that do not identify a variance between them.
inline constexpr std::size_t kFewestRecords = 3;

// Groups among the linear parameters that a regression estimates; `nonlinear` are its nonlinear ones.
std::vector<FrictionGroup> friction_groups(const Terms& terms, const std::vector<ParameterRef>& linear,
                                           const std::vector<ParameterRef>& nonlinear = {});

// One column u a group: a relative change b of the friction of that group changes the torque by X u b. `theta` are the
// values of the columns of X, each of which was divided by `size`. Columns of free nonlinear parameters, where there
// are any, begin at `first_nonlinear`.
Eigen::MatrixXd random_effect_directions(const std::vector<FrictionGroup>& groups, const Eigen::VectorXd& theta,
                                         const Eigen::VectorXd& size, Eigen::Index first_nonlinear);

// The torque of each friction group, one column each: of `slopes` by linear, then by nonlinear parameters, at the
// values `theta` of the linear ones (one for each column of `slopes`).
Eigen::MatrixXd friction_torques(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& theta, const Terms& terms,
                                 const std::vector<ParameterRef>& linear, const std::vector<ParameterRef>& nonlinear);

}  // namespace flexspline::estimation
