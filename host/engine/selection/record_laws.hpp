// Laws of friction between records: what each would add to the friction that the model finds in each record.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/meta_regression.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// What each record says of the model's friction.
struct RecordFriction {
  std::vector<const estimation::Estimate*> parameters;
  std::vector<estimation::RowRange> records;
  RecordParameters values;
};

// A slow record does not identify viscous friction: each counts with what it identifies. A parameter needs `fewest`
// records that identify it.
RecordFriction friction_by_record(const estimation::Identification& base, const estimation::RegressionProblem& data,
                                  std::size_t fewest);

// The slower and the faster records, parted at each tenth of them; only those parts that identify a parameter as a
// trend does. `speeds`: one a record.
std::vector<RecordSubset> ranges_of_speed(const RecordFriction& own, const std::vector<double>& speeds);

// A law at one value of its nonlinear parameters: what it adds to the friction of each record.
struct Law {
  const CandidateFit* candidate;
  std::vector<double> values;  // of all its parameters, those that scale the torque at their usual ones
  Eigen::MatrixXd added;
};

// All candidates that a record's own friction fits as well, at each value of a grid of their nonlinear parameter; not
// those that scale friction.
std::vector<Law> laws(const estimation::Identification& base, const SearchedBalance& motor, const RecordFriction& own);

// The friction that the model takes for a torque in each record, and the largest share of the torque's squares in a
// record that this leaves.
struct AsFriction {
  Eigen::MatrixXd added;
  double most_left = 0.0;
};
AsFriction as_friction(const estimation::RegressionProblem& data, const estimation::Terms& base,
                       const RecordFriction& own, const Eigen::VectorXd& torque, const Eigen::VectorXd& root_weights);

}  // namespace flexspline::selection
