// Friction that differs from record to record: random effects of a generalised least-squares fit.
#pragma once

#include <vector>

#include "host/engine/selection/forward_selection.hpp"

namespace flexspline::selection {

// How friction differs between records, on scaled columns.
struct FrictionRandomEffects {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd variance;
  double noise = 0.0;  // variance of a sample times the samples that count as one

  bool any() const { return variance.size() > 0 && variance.maxCoeff() > 0.0; }
};

// Eliminates them from a record's cross products (Schur complement): what is left are the products of generalised least
// squares with the differences' covariance.
void eliminate_friction_effects(Eigen::MatrixXd& products, const FrictionRandomEffects& differences);
// Columns that differ between records at all.
std::vector<Eigen::Index> columns_that_differ(const FrictionRandomEffects& differences);
// The factor L of what elimination takes off a record's products, L L', from the products with the columns that differ
// (`along`, one column each): the products of all other columns are not needed for it.
Eigen::MatrixXd eliminated_factor(const Eigen::MatrixXd& along, const FrictionRandomEffects& differences);

// Variance components by record of the model's friction; columns scaled as the table has them. What all records have in
// common is no difference: the columns of the differences are fixed effects as well as random ones, so that an
// asymmetry that the model lacks does not pass for friction that differs.
Eigen::VectorXd friction_effects_of(const RegressorTable& table, const Setting& setting, Direction direction,
                                    const std::vector<double>& weights, double noise, const SelectionPolicy& policy);

// What a fit leaves of the samples, times the root of the record's weight. Each record's own friction is taken off as
// its best linear unbiased prediction.
Eigen::VectorXd weighted_residual(const Setting& setting, Direction direction, const TermFit& fitted,
                                  const std::vector<double>& weights, const FrictionRandomEffects& differences);

}  // namespace flexspline::selection
