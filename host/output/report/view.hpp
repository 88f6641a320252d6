// Model and measurement on the samples of each balance: the source of all parts of a page.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/regression_problem.hpp"
#include "host/output/report/document.hpp"

namespace flexspline::report {

struct BalanceView {
  estimation::Balance balance = estimation::Balance::motor;
  std::unique_ptr<estimation::RegressionProblem> data;
  std::string signal;  // "motor_balance"
  std::string unit;
  Eigen::VectorXd residual;               // measured minus model, one a sample
  std::optional<Eigen::VectorXd> before;  // of the model before
  Eigen::VectorXd floor_squared;          // of the sample's record; NaN where its noise is not known
  double autocorrelation_time = 1.0;      // samples that count as one, of `residual`
  double filter_time = 1.0;               // likewise of white noise behind the filter
};

// Stays where it is: balances refer to `prepared`.
struct View {
  explicit View(const Subject& subject);
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  data::Axis axis() const { return model.drive.axis; }
  std::string unit_of(data::Column column) const { return data::unit_of(column, axis()); }
  // Residual that the page is about: before, where there is one; the missing effect shows there.
  static const Eigen::VectorXd& shown(const BalanceView& balance) {
    return balance.before ? *balance.before : balance.residual;
  }
  const comparison::SignalResult* result(std::size_t record, const std::string& signal) const;

  const data::Dataset& dataset;
  model::Model model;
  std::optional<model::Model> model_before;
  // What is compared, too: computed once, and not at all where the subject's pipeline brings it along.
  std::shared_ptr<const estimation::PreparedData> ready;
  const estimation::PreparedData& prepared;
  comparison::Comparison comparison;
  std::optional<comparison::Comparison> comparison_before;
  estimation::Terms terms;
  std::optional<estimation::Terms> terms_before;
  std::vector<BalanceView> balances;
};

}  // namespace flexspline::report
