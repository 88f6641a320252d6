#include "host/engine/blackbox/linear_model.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "host/common/algebra/decompositions.hpp"

namespace flexspline::blackbox {
namespace {

using Eigen::Index;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// Columns that differ by less than this from a combination of the others are taken as collinear; the data have six
// digits.
constexpr double kRank = 1e-10;

void require_same_shape(const std::vector<Record>& records, const Orders& orders) {
  if (orders.na < 0 || orders.nb < 0 || orders.nk < 0 || orders.parameters(1) == 0)
    throw std::invalid_argument(
        fmt::format("black box: orders na = {}, nb = {}, nk = {} must not be negative, nor all zero", orders.na,
                    orders.nb, orders.nk));
  if (records.empty()) throw std::invalid_argument("black box: there is no record to fit");
  for (const Record& r : records) {
    if (r.inputs.size() != records[0].inputs.size())
      throw std::invalid_argument(fmt::format("black box: a record has {} inputs, the first one has {}",
                                              r.inputs.size(), records[0].inputs.size()));
    for (const std::vector<double>& u : r.inputs)
      if (u.size() != r.output.size())
        throw std::invalid_argument(
            fmt::format("black box: an input has {} samples, its output {}", u.size(), r.output.size()));
    if (!r.scored.empty() && r.scored.size() != r.output.size())
      throw std::invalid_argument(
          fmt::format("black box: {} samples are marked, the output has {}", r.scored.size(), r.output.size()));
  }
}

// Regressors of sample k (eq. 16), with the past outputs taken from `output`.
template <class Row>
void fill(Row&& row, const Orders& o, const Record& r, const std::vector<double>& output, std::size_t k) {
  Index at = 0;
  for (int i = 1; i <= o.na; ++i) row[at++] = -output[k - static_cast<std::size_t>(i)];
  for (const std::vector<double>& u : r.inputs)
    for (int i = 0; i < o.nb; ++i) row[at++] = u[k - static_cast<std::size_t>(o.nk + i)];
  if (o.constant) row[at++] = 1.0;
}

std::vector<double> predicted(const LinearModel& model, const Record& r, bool free_run) {
  const Orders& o = model.orders;
  std::vector<double> result = r.output;
  const std::vector<double>& past = free_run ? result : r.output;
  for (std::size_t k = o.memory(); k < result.size(); ++k) {
    double y = model.constant;
    for (int i = 1; i <= o.na; ++i) y -= model.a[i - 1] * past[k - static_cast<std::size_t>(i)];
    for (std::size_t u = 0; u < r.inputs.size(); ++u)
      for (int i = 0; i < o.nb; ++i) y += model.b[u][i] * r.inputs[u][k - static_cast<std::size_t>(o.nk + i)];
    result[k] = y;
  }
  return result;
}

}  // namespace

std::size_t Orders::memory() const {
  return static_cast<std::size_t>(std::max({na, nb > 0 ? nb + nk - 1 : 0, 0}));
}

LinearModel fit(const std::vector<Record>& records, const Orders& orders) {
  require_same_shape(records, orders);
  const std::size_t inputs = records[0].inputs.size();
  const std::size_t columns = orders.parameters(inputs);
  std::size_t rows = 0;
  for (const Record& r : records)
    for (std::size_t k = orders.memory(); k < r.output.size(); ++k) rows += r.is_scored(k) ? 1 : 0;
  if (rows < columns)
    throw std::invalid_argument(fmt::format("{} parameters cannot be fitted on {} samples", columns, rows));

  Eigen::MatrixXd A(static_cast<Index>(rows), static_cast<Index>(columns));
  Eigen::VectorXd y(static_cast<Index>(rows));
  Index row = 0;
  for (const Record& r : records)
    for (std::size_t k = orders.memory(); k < r.output.size(); ++k) {
      if (!r.is_scored(k)) continue;
      fill(A.row(row), orders, r, r.output, k);
      y[row++] = r.output[k];
    }
  if (!A.allFinite() || !y.allFinite())
    throw std::invalid_argument("black box: a sample is not finite; flexspline check names it");
  Eigen::VectorXd length = A.colwise().norm();
  for (Index j = 0; j < length.size(); ++j)
    if (!(length[j] > 0.0)) length[j] = 1.0;
  for (Index j = 0; j < length.size(); ++j) A.col(j) /= length[j];
  const algebra::LeastNormSolver solver(A, kRank);
  const Eigen::VectorXd solution = solver.solve(y);
  const Eigen::VectorXd theta = solution.cwiseQuotient(length);

  LinearModel model;
  model.orders = orders;
  model.parameters = columns;
  model.rows = rows;
  model.condition_number = solver.rank() < A.cols() ? std::numeric_limits<double>::infinity() : solver.pivot_ratio();
  model.a = theta.head(orders.na);
  for (std::size_t u = 0; u < inputs; ++u)
    model.b.emplace_back(theta.segment(orders.na + static_cast<Index>(u) * orders.nb, orders.nb));
  model.constant = orders.constant ? theta[theta.size() - 1] : 0.0;
  return model;
}

double LinearModel::largest_pole() const {
  // Trailing zeros are poles at zero.
  Index n = a.size();
  while (n > 0 && a[n - 1] == 0.0) --n;
  if (n == 0) return 0.0;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  companion.row(0) = -a.head(n).transpose();
  for (Index k = 1; k < n; ++k) companion(k, k - 1) = 1.0;
  return algebra::complex_eigenvalues(companion).cwiseAbs().maxCoeff();
}

double LinearModel::static_gain(std::size_t input) const {
  return b.at(input).sum() / (1.0 + a.sum());
}

std::vector<double> LinearModel::one_step(const Record& record) const {
  return predicted(*this, record, false);
}

std::vector<double> LinearModel::simulate(const Record& record) const {
  return predicted(*this, record, true);
}

void Errors::add(const Errors& other) {
  if (other.samples == 0) return;
  const auto m = static_cast<double>(samples), n = static_cast<double>(other.samples);
  const double step = other.mean - mean;
  spread += other.spread + step * step * m * n / (m + n);
  mean += step * n / (m + n);
  samples += other.samples;
  squared += other.squared;
  squared_one_step += other.squared_one_step;
}

double Errors::rms() const {
  const double value = samples ? std::sqrt(squared / static_cast<double>(samples)) : kUnknown;
  return std::isfinite(value) ? value : kUnknown;
}

double Errors::rms_one_step() const {
  return samples ? std::sqrt(squared_one_step / static_cast<double>(samples)) : kUnknown;
}

double Errors::nrms() const {
  return spread > 0.0 ? rms() / std::sqrt(spread / static_cast<double>(samples)) : kUnknown;
}

double Errors::fit_percent() const {
  return 100.0 * (1.0 - nrms());
}

Errors errors_of(const LinearModel& model, const Record& record) {
  const std::vector<double> free_run = model.simulate(record), one_step = model.one_step(record);
  Errors errors;
  for (std::size_t k = model.orders.memory(); k < record.output.size(); ++k) {
    if (!record.is_scored(k)) continue;
    const double y = record.output[k];
    Errors one;
    one.samples = 1;
    one.mean = y;
    one.squared = (y - free_run[k]) * (y - free_run[k]);
    one.squared_one_step = (y - one_step[k]) * (y - one_step[k]);
    errors.add(one);
  }
  return errors;
}

Errors errors_of(const LinearModel& model, const std::vector<Record>& records) {
  Errors errors;
  for (const Record& r : records) errors.add(errors_of(model, r));
  return errors;
}

}  // namespace flexspline::blackbox
