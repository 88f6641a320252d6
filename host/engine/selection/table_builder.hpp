// Builds the parts of a regressor table, one after the other. For the sources of make_regressor_table alone.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"
#include "host/engine/selection/regressor_table.hpp"

namespace flexspline::selection {

// The data with one direction of the motor's friction: the expected sign of its velocity, or a state of presliding.
class DirectedData {
 public:
  // `direction` gives that of each sample of a record.
  DirectedData(const estimation::PreparedData& original, Balance balance,
               const std::function<std::vector<double>(const estimation::Record&)>& direction);
  DirectedData(const DirectedData&) = delete;
  DirectedData& operator=(const DirectedData&) = delete;

  const estimation::PreparedData prepared;
  estimation::RegressionProblem data;
  // The model's prediction of the effort, N m. Terms that read the current are built from it, not from the measured
  // current, whose noise is in the target.
  Eigen::VectorXd effort;

  static double direction(const estimation::Record& r, std::size_t k) { return r.inputs.directions[0][k]; }
  // A signal of each record at the samples.
  template <class Value>
  Eigen::VectorXd at_rows(Value value) const {
    Eigen::VectorXd column(data.rows());
    for (const estimation::RowRange& range : data.records()) {
      const estimation::Record& r = prepared.records[range.record];
      const auto& samples = r.rows[estimation::index(data.balance())].samples;
      for (std::size_t k = 0; k < samples.size(); ++k)
        column[range.first + static_cast<Eigen::Index>(k)] = value(r, samples[k]);
    }
    return column;
  }
};

struct TableBuilder {
  DirectedData& sign;
  DirectedData* presliding;  // null: does not compete
  const estimation::Terms& terms;
  const SelectionPolicy& policy;
  RegressorTable& table;
  std::vector<Eigen::VectorXd> columns, presliding_columns, shapes;

  using ColumnsOf = std::function<Eigen::MatrixXd(DirectedData&)>;
  // Columns side by side; those with presliding are empty where they are the same.
  struct DirectedColumns {
    Eigen::MatrixXd sign, presliding;
  };
  DirectedColumns directed_columns(const ColumnsOf& columns_of, bool reads_direction) const;
  // Places of the columns that are added.
  std::vector<Eigen::Index> add(DirectedColumns made);
  // Filters columns along each run, as the columns of effects are.
  Eigen::MatrixXd filtered(Eigen::MatrixXd columns) const;
  std::vector<std::size_t> on_balance() const;
};

// How far the motor travels over all records, and how fast.
struct Motion {
  double turn = 0.0;  // of the motor, in units of its position
  double travel = 0.0;
  double typical_speed = 0.0, top_speed = 0.0;
};
Motion motion_of(const estimation::PreparedData& prepared);

// Slope in time of a column, along each run.
Eigen::VectorXd slope_of(const Eigen::VectorXd& column, const std::vector<Run>& runs);

// The parts, in this order. Columns of the model, and what it makes of the effort; false: there are none.
bool add_model_columns(TableBuilder& builder);
// Effects of the catalogue, and placebo orders of those that come in orders.
void add_catalogue_terms(TableBuilder& builder, const Motion& motion);
// Generic curves: they compete with the effects, and are never named.
void add_generic_curves(TableBuilder& builder, const Motion& motion);
// Dry friction over other travels of presliding less that over the law's.
void add_presliding_shape(TableBuilder& builder, const PreslidingTravels& travels);
// The same for a model that has a law of presliding: what its travel alone cannot follow competes, and is never named.
void add_other_travels(TableBuilder& builder);
// Relative changes of viscous and of dry friction, in common and by direction.
void add_differences(TableBuilder& builder);

}  // namespace flexspline::selection
