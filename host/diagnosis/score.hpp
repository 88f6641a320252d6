// How much better an extended model predicts data that it was not fitted on.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host/diagnosis/deviations.hpp"
#include "host/regression/balance_data.hpp"
#include "host/regression/whitening.hpp"

namespace flexspline::diagnosis {

using regression::BalanceData;
using regression::RowRange;
using regression::Slot;
using regression::Terms;

// A record's rows, each predicted from others: parameters from all records without its part, the record's own deviation
// from its other parts.
struct LeftOut {
  double rows = 0.0;
  double squares = 0.0;
};

// What is left of rows that count, as a root mean square.
double rmse_of(const Eigen::VectorXd& residual, const Eigen::VectorXd& root_weights);
double rmse_of(const std::vector<LeftOut>& records);

// The same model where friction is taken to be the same in all records: what a drive that runs it would see. A missing
// effect that differs from record to record may pass for deviations of friction; this is what shows it then.
struct AllAlike {
  Eigen::VectorXd residual;
  Eigen::VectorXd root_weights;
  std::vector<LeftOut> left_out;
};

// A model on one balance, fitted with weights by record and judged by cross-validation. Its shapes are free to first
// order, and so is a delay of the effort.
struct Judged {
  Terms terms;  // with fitted values
  std::vector<Slot> linear;
  Eigen::VectorXd theta;       // linear parameters, then shifts of shapes, then the delay in s
  Eigen::VectorXd std;         // likewise; corrected for autocorrelation
  Eigen::MatrixXd covariance;  // likewise; infinite on what is not determined
  Eigen::VectorXd own_share;
  Eigen::VectorXd residual;      // in-sample, less the records' deviations
  Eigen::VectorXd root_weights;  // nought where a disturbance is left out
  double autocorrelation_time = 1.0;
  std::vector<Group> groups;      // friction that differs from record to record
  Spread deviations;              // in-sample
  std::vector<RecordSums> sums;   // of each record, in-sample, deviations in
  std::vector<LeftOut> left_out;  // of each record
  AllAlike alike;                 // empty where nothing deviates
  double rmse() const { return rmse_of(residual, root_weights); }
  double rmse_cv() const { return rmse_of(left_out); }
  bool deviates() const { return !alike.left_out.empty(); }
  const Eigen::VectorXd& residual_alike() const { return deviates() ? alike.residual : residual; }
  const Eigen::VectorXd& root_weights_alike() const { return deviates() ? alike.root_weights : root_weights; }
  const std::vector<LeftOut>& left_out_alike() const { return deviates() ? alike.left_out : left_out; }
  double rmse_alike() const { return rmse_of(residual_alike(), root_weights); }
  double rmse_cv_alike() const { return rmse_of(left_out_alike()); }
};

// Fits and judges `terms` on `data`. `keep` holds one a row, or nought for rows that must not count.
Judged judge(BalanceData& data, Terms terms, const Eigen::VectorXd& keep);

// What makes the errors of a judged model alike and independent, its records' deviations among them.
regression::Whitening whitening_of(BalanceData& data, const Judged& judged);
// Whitened squares that `terms` leave after their best linear fit, with noise and spread as `judged` has them: enough
// to choose a shape on a grid.
double squares_left(BalanceData& data, const Terms& terms, const Judged& judged);

struct Fall {
  double score =
      0.0;  // twice the log likelihood ratio of left-out rows over the autocorrelation time, less k ln(n_eff)
  double chi2_percent = 0.0;   // of the left-out chi-square
  double alike_percent = 0.0;  // the same with one friction for all records
  double p_value = 1.0;
};
// From `base` to `extended`, which has `added` parameters more. Noise is each record's own, and so is the spread of
// friction each model's; a record that is quieter than a tenth of the median one counts as that.
Fall fall_of(const Judged& base, const Judged& extended, double added);

}  // namespace flexspline::diagnosis
