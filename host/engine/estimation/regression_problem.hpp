// Linear regression on one torque balance over all records: the target, and a column for any parameter of any effect.
// It never changes; columns that several fits ask for are computed once (ColumnStore), from any thread.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "host/engine/estimation/column_store.hpp"
#include "host/engine/estimation/regressor_evaluator.hpp"

namespace flexspline::estimation {

class RegressionProblem {
 public:
  // Keeps a reference to `prepared`. Records that lack what the balance needs have no samples.
  RegressionProblem(const PreparedData& prepared, Balance balance);

  Balance balance() const { return evaluator_.balance(); }
  bool empty() const { return target_.size() == 0; }
  Eigen::Index rows() const { return target_.size(); }
  const PreparedData& prepared() const { return evaluator_.prepared(); }
  const std::vector<RowRange>& records() const { return evaluator_.records(); }
  const RegressorEvaluator& evaluator() const { return evaluator_; }
  // Each record's samples cut into `parts` pieces of equal length: part k of all records is fold k of a
  // cross-validation.
  std::vector<std::vector<RowRange>> folds(std::size_t parts) const;
  // Index within its record, at full rate, of the sample in this row.
  std::size_t sample_of(const RowRange& range, Eigen::Index row) const;
  // Samples that count as one for white noise, because the filter correlates neighbours: their rate over twice the
  // filter's noise bandwidth. A short residual underestimates this.
  double filter_autocorrelation_time() const { return filter_autocorrelation_time_; }

  // Measured left side, filtered, N m: Km i - T/N (motor; Km i without a torque sensor), T, T - load torque.
  const Eigen::VectorXd& target() const { return target_; }
  // What a delay of one second adds to the target, to first order: its negative slope; on the motor's balance that of
  // the effort Km i alone, which comes late against motion and torque sensor.
  const Eigen::VectorXd& delay_column() const { return delay_; }

  // Torque per unit of a linear parameter, with nonlinear parameters, shifts and modulations as in `terms`, filtered. N
  // m per unit.
  Eigen::VectorXd column(const Terms& terms, ParameterRef ref) const;
  // Those of many parameters side by side.
  Eigen::MatrixXd columns(const Terms& terms, const std::vector<ParameterRef>& refs) const;
  // Slopes of the model's torque by nonlinear parameters, at the linear parameters of `terms`, filtered.
  Eigen::MatrixXd nonlinear_columns(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                    const std::vector<ParameterRef>& nonlinear) const;
  // Slopes by linear, then by nonlinear parameters: columns that let a linear fit move nonlinear parameters to first
  // order.
  Eigen::MatrixXd slopes(const Terms& terms, const std::vector<std::size_t>& on_balance,
                         const std::vector<ParameterRef>& linear, const std::vector<ParameterRef>& nonlinear) const;
  // Torque of terms with known linear parameters, of those that no linear parameter scales at their nonlinear
  // parameters as they stand, and of those that only reach this balance, filtered: belongs on the left side. It moves
  // with the nonlinear parameters.
  Eigen::VectorXd known_torque(const Terms& terms, const std::vector<std::size_t>& on_balance) const;
  // The linear regression y = X theta at the nonlinear parameters of `terms`: columns of the linear parameters, and the
  // target less what is known.
  struct Regression {
    Eigen::MatrixXd X;
    Eigen::VectorXd y;
  };
  Regression regression(const Terms& terms, const std::vector<std::size_t>& on_balance,
                        const std::vector<ParameterRef>& linear) const;
  // Torque of one term at its values, all parameters in, filtered.
  Eigen::VectorXd term_torque(const Terms& terms, std::size_t term) const;
  // The target less the torques of all terms at their values, N m.
  Eigen::VectorXd residual(const Terms& terms) const;

  // The same samples and target, with columns from decimated signals; see RegressorEvaluator::decimated.
  RegressionProblem decimated() const;

 private:
  RegressionProblem(const RegressionProblem& original, RegressorEvaluator evaluator);
  // Stored columns of these parameters, made where they are not there yet.
  std::vector<ColumnStore::Column> stored_columns(const Terms& terms, const std::vector<ParameterRef>& refs) const;
  // The linear parameter that alone scales a term, where slopes of it are kept per unit of that: a search asks for
  // those of the model with each candidate again.
  static std::optional<std::size_t> scaled_by_one(const Term& term);
  ColumnStore::Column stored_slope(const Terms& terms, ParameterRef nonlinear, std::size_t linear) const;

  RegressorEvaluator evaluator_;
  Eigen::VectorXd target_;
  Eigen::VectorXd delay_;
  double filter_autocorrelation_time_ = 1.0;
  std::shared_ptr<ColumnStore> store_;  // shared by copies
};

}  // namespace flexspline::estimation
