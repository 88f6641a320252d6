#include "host/engine/estimation/record_constants.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::estimation {

std::vector<ParameterRef> record_constants(const Terms& terms) {
  std::vector<ParameterRef> found;
  for (std::size_t t = 0; t < terms.size(); ++t)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].entry->parameters[p].per_record && !terms[t].known[p]) found.push_back({t, p});
  return found;
}

bool refine_record_constants(PreparedData& prepared, const RegressionProblem& data, const Terms& terms,
                             const std::vector<ParameterRef>& together_with, const Eigen::VectorXd& root_weights) {
  const std::vector<std::size_t> on_balance = terms_on(terms, data.balance(), prepared.output_signals);
  const std::vector<ParameterRef> constants = record_constants(terms);
  const auto here = std::ranges::find_if(
      constants, [&](const ParameterRef& s) { return std::ranges::find(on_balance, s.term) != on_balance.end(); });
  const auto records = static_cast<Eigen::Index>(data.records().size());
  if (here == constants.end() || records < 2) return false;

  std::vector<ParameterRef> others;
  for (const ParameterRef& ref : together_with)
    if (!(ref == *here)) others.push_back(ref);
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(data.rows(), static_cast<Eigen::Index>(others.size()) + records);
  for (std::size_t j = 0; j < others.size(); ++j)
    X.col(static_cast<Eigen::Index>(j)) = terms[others[j].term].free_linear(others[j].parameter)
                                              ? data.column(terms, others[j])
                                              : data.nonlinear_columns(terms, on_balance, {others[j]}).col(0);
  const Eigen::VectorXd slope = data.nonlinear_columns(terms, on_balance, {*here});
  const auto first = static_cast<Eigen::Index>(others.size());
  for (Eigen::Index r = 0; r < records; ++r) {
    const RowRange& range = data.records()[static_cast<std::size_t>(r)];
    X.col(first + r).segment(range.first, range.size()) = slope.segment(range.first, range.size());
  }
  const LinearFit step = least_squares(X, data.residual(terms), root_weights);
  const Eigen::VectorXd constant = step.theta.tail(records);
  if (!(constant.cwiseAbs().maxCoeff() > 0.0)) return false;
  const double mean = constant.mean();
  for (Eigen::Index r = 0; r < records; ++r) {
    Record& record = prepared.records[data.records()[static_cast<std::size_t>(r)].record];
    const double move = constant[r] - mean;
    record.torsion_zero_rad += move;
    record.inputs.torsion_zero += move;
  }
  return true;
}

}  // namespace flexspline::estimation
