#include "host/diagnosis/score.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numeric>

#include "host/regression/balance_fit.hpp"
#include "host/regression/least_squares.hpp"
#include "host/regression/shapes.hpp"

namespace flexspline::diagnosis {
namespace {

// Parts that each record is cut into: part k of all records is predicted from the other parts. Whole records cannot be
// left out, because some parameters are shown by a single one (a record at rest, a warm one).
constexpr std::size_t kFolds = 5;

Eigen::MatrixXd design(BalanceData& data, const Terms& terms, const std::vector<Slot>& linear) {
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  const std::vector<Slot> shapes = regression::free_shape_slots(terms, on_balance);
  Eigen::MatrixXd X(data.rows(), static_cast<Eigen::Index>(linear.size() + shapes.size() + 1));
  X << regression::columns_of(data, terms, linear), regression::shape_columns(data, terms, on_balance, shapes),
      data.delay_column();
  return X;
}

void predict_left_out(const BalanceData& data, const Eigen::MatrixXd& X, const Eigen::VectorXd& y, Judged& judged) {
  const auto folds = data.folds(kFolds);
  const Eigen::Index columns = X.cols();
  // Columns of like size, so that the factorisation can tell a small column from a needless one.
  const Eigen::VectorXd size = X.colwise().norm().transpose().array().max(1e-300);
  // One triangle for each fold; a fit without a fold stacks the others.
  std::vector<Eigen::MatrixXd> triangles;
  for (const auto& fold : folds) {
    Eigen::Index rows = 0;
    for (const RowRange& range : fold) rows += range.size();
    Eigen::MatrixXd block(std::max(rows, columns + 1), columns + 1);
    block.setZero();
    Eigen::Index at = 0;
    for (const RowRange& range : fold) {
      const auto weights = judged.root_weights.segment(range.first, range.size()).asDiagonal();
      block.block(at, 0, range.size(), columns) =
          weights * (X.middleRows(range.first, range.size()) * size.cwiseInverse().asDiagonal());
      block.block(at, columns, range.size(), 1) = weights * y.segment(range.first, range.size());
      at += range.size();
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(block);
    triangles.emplace_back(qr.matrixQR().topRows(columns + 1).triangularView<Eigen::Upper>());
  }
  judged.cv_squares.assign(data.records().size(), 0.0);
  judged.cv_rows.assign(data.records().size(), 0.0);
  for (std::size_t out = 0; out < folds.size(); ++out) {
    Eigen::MatrixXd stack((columns + 1) * static_cast<Eigen::Index>(kFolds - 1), columns + 1);
    Eigen::Index at = 0;
    for (std::size_t f = 0; f < folds.size(); ++f)
      if (f != out) {
        stack.middleRows(at, columns + 1) = triangles[f];
        at += columns + 1;
      }
    const Eigen::VectorXd theta = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(stack.leftCols(columns))
                                      .setThreshold(1e-7)
                                      .solve(stack.col(columns))
                                      .cwiseQuotient(size);
    for (std::size_t i = 0; i < folds[out].size(); ++i) {
      const RowRange& range = folds[out][i];
      const Eigen::VectorXd r = y.segment(range.first, range.size()) - X.middleRows(range.first, range.size()) * theta;
      for (Eigen::Index k = 0; k < range.size(); ++k)
        if (judged.root_weights[range.first + k] > 0.0) {
          judged.cv_squares[i] += r[k] * r[k];
          judged.cv_rows[i] += 1.0;
        }
    }
  }
}

double total(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0);
}

// Noise of each record, with a floor under records that are nearly silent.
std::vector<double> variances(const Judged& judged) {
  std::vector<double> variance;
  for (std::size_t i = 0; i < judged.cv_rows.size(); ++i)
    variance.push_back(judged.cv_squares[i] / std::max(1.0, judged.cv_rows[i]));
  return variance;
}

}  // namespace

double Judged::rmse() const {
  const double rows = (root_weights.array() > 0.0).count();
  return std::sqrt((root_weights.array() > 0.0).select(residual.array().square(), 0.0).sum() / std::max(1.0, rows));
}

double Judged::rmse_cv() const {
  return std::sqrt(total(cv_squares) / std::max(1.0, total(cv_rows)));
}

Judged judge(BalanceData& data, Terms terms, const Eigen::VectorXd& keep) {
  Judged judged;
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  judged.linear = regression::free_linear_slots(terms, on_balance);
  const Eigen::VectorXd y = data.target() - data.known_torque(terms, on_balance);
  judged.root_weights = keep;
  regression::LinearFit fit;
  Eigen::MatrixXd X;
  for (int round = 0; round < 3; ++round) {
    // Slopes by shapes need the linear parameters, so the first round sets those.
    X = round == 0 ? regression::columns_of(data, terms, judged.linear) : design(data, terms, judged.linear);
    fit = regression::least_squares(X, y, judged.root_weights);
    for (std::size_t j = 0; j < judged.linear.size(); ++j)
      terms[judged.linear[j].term].values[judged.linear[j].parameter] = fit.theta[static_cast<Eigen::Index>(j)];
    if (round < 2) {
      const Eigen::VectorXd counted = keep.cwiseProduct(fit.residual);
      judged.root_weights = keep.cwiseProduct(regression::record_weights(data.records(), counted));
    }
  }
  judged.theta = fit.theta;
  judged.own_share = fit.own_share;
  judged.residual = fit.residual;
  const Eigen::VectorXd weighted = judged.root_weights.cwiseProduct(fit.residual);
  judged.autocorrelation_time =
      std::max(regression::autocorrelation_time(data.records(), weighted), data.filter_autocorrelation_time());
  const double variance = weighted.squaredNorm() / std::max(1.0, static_cast<double>(data.rows() - X.cols()));
  judged.std = (fit.unit_covariance.diagonal() * variance * judged.autocorrelation_time).cwiseSqrt();
  // What the whole data do not determine, a part of them does still less.
  std::vector<Eigen::Index> determined;
  for (Eigen::Index j = 0; j < X.cols(); ++j)
    if (fit.own_share[j] >= regression::kUndetermined) determined.push_back(j);
  predict_left_out(data, X(Eigen::all, determined), y, judged);
  judged.terms = std::move(terms);
  return judged;
}

Fall fall_of(const Judged& base, const Judged& extended, double added) {
  const std::vector<double> before = variances(base), after = variances(extended);
  std::vector<double> sorted = after;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double least = 0.01 * sorted[sorted.size() / 2];
  double ratio = 0.0, chi2_before = 0.0, chi2_after = 0.0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const double noise = std::max({after[i], least, 1e-300});
    ratio += base.cv_rows[i] * std::log(std::max(before[i], noise) / noise);
    // A record that got worse counts against the extension.
    if (before[i] < after[i]) ratio -= base.cv_rows[i] * std::log(noise / std::max({before[i], least, 1e-300}));
    chi2_before += base.cv_squares[i] / noise;
    chi2_after += extended.cv_squares[i] / noise;
  }
  const double tau = std::max(1.0, std::min(base.autocorrelation_time, extended.autocorrelation_time));
  const double effective = total(base.cv_rows) / tau;
  Fall fall;
  fall.score = ratio / tau - added * std::log(std::max(2.0, effective));
  fall.chi2_percent = chi2_before > 0.0 ? 100.0 * (1.0 - chi2_after / chi2_before) : 0.0;
  const boost::math::chi_squared_distribution<double> distribution(std::max(1.0, added));
  fall.p_value = ratio > 0.0 ? boost::math::cdf(boost::math::complement(distribution, ratio / tau)) : 1.0;
  return fall;
}

}  // namespace flexspline::diagnosis
