#include "host/diagnosis/score.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numeric>

#include "host/diagnosis/triangles.hpp"
#include "host/regression/balance_fit.hpp"
#include "host/regression/least_squares.hpp"
#include "host/regression/pivoted_qr.hpp"
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

// Noise below a hundredth of the median record's is taken for that.
double least_of(std::vector<double> variances) {
  if (variances.empty()) return 0.0;
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return 0.01 * *middle;
}

std::vector<double> raw_variances(const std::vector<RecordSums>& records) {
  std::vector<double> variances;
  for (const RecordSums& r : records) variances.push_back(r.squares / std::max(1.0, r.rows));
  return variances;
}

std::vector<RecordSums> sums_of(const Triangles& triangles, const Eigen::VectorXd& theta, const Eigen::MatrixXd& u) {
  std::vector<RecordSums> records(triangles.whole.size());
  for (std::size_t i = 0; i < records.size(); ++i)
    add_sums(triangles.whole[i], theta, u, triangles.rows_of(i), records[i]);
  return records;
}

// Generalised least squares on all records, the spread and the noise of each of them estimated with it. `tau` rows
// count as one.
struct MixedFit {
  regression::LinearFit linear;  // of the scaled columns
  Eigen::MatrixXd u;
  Spread spread;
  double deviance() const { return std::accumulate(spread.deviance.begin(), spread.deviance.end(), 0.0); }
};
// From noise that holds all deviations, or from deviations that are as large as they may be.
enum class Start { alike, apart };
MixedFit fit_from(Start start, const Triangles& triangles, const std::vector<Group>& groups, Eigen::Index first_shape,
                  double tau) {
  MixedFit fit;
  const Eigen::Index columns = triangles.columns();
  const auto solve = [&] {
    std::vector<Eigen::MatrixXd> reduced;
    std::vector<const Eigen::MatrixXd*> blocks;
    for (std::size_t i = 0; i < triangles.whole.size(); ++i)
      reduced.push_back(fit.spread.variance.empty() ? triangles.whole[i]
                                                    : without_deviations(triangles.whole[i], fit.u, fit.spread.std,
                                                                         fit.spread.variance[i] * tau));
    for (const Eigen::MatrixXd& r : reduced) blocks.push_back(&r);
    const Eigen::MatrixXd all = stacked(blocks);
    fit.linear = regression::least_squares(all.leftCols(columns), all.col(columns), Eigen::VectorXd::Ones(all.rows()));
    fit.u = directions(groups, fit.linear.theta, triangles.size, first_shape);
  };
  solve();
  if (start == Start::apart) {
    const std::vector<RecordSums> sums = sums_of(triangles, fit.linear.theta, fit.u);
    fit.spread = with_largest_spread(sums, tau, least_of(raw_variances(sums)));
    solve();
  }
  // Parameters, spread and noise settle each other.
  constexpr int kMostRounds = 12;
  constexpr double kSame = 0.02;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<RecordSums> sums = sums_of(triangles, fit.linear.theta, fit.u);
    // Deviations are no noise: the limit follows what is left without them.
    const double least = least_of(fit.spread.variance.empty() ? raw_variances(sums) : fit.spread.variance);
    const SmallVector before = fit.spread.std;
    fit.spread = estimate_spread(sums, tau, least, fit.spread.variance);
    solve();
    if (round > 1 && (groups.empty() ||
                      (fit.spread.std - before).cwiseAbs().maxCoeff() <= kSame * fit.spread.std.cwiseAbs().maxCoeff()))
      break;
  }
  return fit;
}
// Of both starts the likelier end: what is missing from the model may be noise or deviations to it.
MixedFit fit_all(const Triangles& triangles, const std::vector<Group>& groups, Eigen::Index first_shape, double tau) {
  MixedFit fit = fit_from(Start::alike, triangles, groups, first_shape, tau);
  if (groups.empty()) return fit;
  MixedFit other = fit_from(Start::apart, triangles, groups, first_shape, tau);
  return other.deviance() < fit.deviance() ? other : fit;
}

// Predicts each part of all records from the others. What the whole data do not determine, a part of them does still
// less: `determined` columns alone are fitted.
std::vector<LeftOut> predict_left_out(const Triangles& triangles, const MixedFit& whole, double tau) {
  const Eigen::Index columns = triangles.columns();
  std::vector<Eigen::Index> used;
  for (Eigen::Index j = 0; j < columns; ++j)
    if (whole.linear.own_share[j] >= regression::kUndetermined) used.push_back(j);
  std::vector<LeftOut> records(triangles.whole.size());
  for (std::size_t out = 0; out < kFolds; ++out) {
    std::vector<Eigen::MatrixXd> others, reduced;
    std::vector<const Eigen::MatrixXd*> blocks;
    for (std::size_t i = 0; i < records.size(); ++i) {
      std::vector<const Eigen::MatrixXd*> parts;
      for (std::size_t f = 0; f < kFolds; ++f)
        if (f != out) parts.push_back(&triangles.parts[i][f]);
      others.push_back(stacked(parts));
      reduced.push_back(without_deviations(others.back(), whole.u, whole.spread.std, whole.spread.variance[i] * tau));
    }
    for (const Eigen::MatrixXd& r : reduced) blocks.push_back(&r);
    const Eigen::MatrixXd all = stacked(blocks);
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(columns);
    theta(used) = regression::PivotedQr(all(Eigen::all, used), 1e-5).solve(all.col(columns));
    for (std::size_t i = 0; i < records.size(); ++i) {
      RecordSums seen;
      add_sums(others[i], theta, whole.u, triangles.rows_of(i) - triangles.rows[i][out], seen);
      const Eigen::VectorXd own =
          theta + whole.u * best_deviations(seen, whole.spread.std, whole.spread.variance[i] * tau);
      const Eigen::MatrixXd& part = triangles.parts[i][out];
      records[i].rows += triangles.rows[i][out];
      records[i].squares += (part.col(columns) - part.leftCols(columns) * own).squaredNorm();
    }
  }
  return records;
}

// By the noise of each record; nought where `keep` is.
Eigen::VectorXd root_weights_of(const BalanceData& data, const Eigen::VectorXd& keep,
                                const std::vector<double>& variance) {
  Eigen::VectorXd weights(keep.size());
  for (std::size_t i = 0; i < data.records().size(); ++i) {
    const RowRange& range = data.records()[i];
    weights.segment(range.first, range.size()) = keep.segment(range.first, range.size()) / std::sqrt(variance[i]);
  }
  return weights;
}

double rows_of(const std::vector<LeftOut>& records) {
  return std::accumulate(records.begin(), records.end(), 0.0,
                         [](double sum, const LeftOut& r) { return sum + r.rows; });
}

}  // namespace

double rmse_of(const Eigen::VectorXd& residual, const Eigen::VectorXd& root_weights) {
  const double rows = (root_weights.array() > 0.0).count();
  return std::sqrt((root_weights.array() > 0.0).select(residual.array().square(), 0.0).sum() / std::max(1.0, rows));
}

double rmse_of(const std::vector<LeftOut>& records) {
  const double squares = std::accumulate(records.begin(), records.end(), 0.0,
                                         [](double sum, const LeftOut& r) { return sum + r.squares; });
  return std::sqrt(squares / std::max(1.0, rows_of(records)));
}

Judged judge(BalanceData& data, Terms terms, const Eigen::VectorXd& keep) {
  Judged judged;
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  judged.linear = regression::free_linear_slots(terms, on_balance);
  const std::vector<Slot> shapes = regression::free_shape_slots(terms, on_balance);
  const auto first_shape = static_cast<Eigen::Index>(judged.linear.size());
  judged.groups = friction_groups(terms, judged.linear, shapes);
  const Eigen::VectorXd y = data.target() - data.known_torque(terms, on_balance);
  const auto set = [&](const Eigen::VectorXd& theta) {
    for (std::size_t j = 0; j < judged.linear.size(); ++j)
      terms[judged.linear[j].term].values[judged.linear[j].parameter] = theta[static_cast<Eigen::Index>(j)];
  };
  double tau = data.filter_autocorrelation_time();
  if (!shapes.empty()) {
    // Slopes by shapes need the linear parameters.
    const Triangles linear = triangles_of(data, regression::columns_of(data, terms, judged.linear), y, keep, 1);
    set(fit_all(linear, judged.groups, first_shape, tau).linear.theta.cwiseQuotient(linear.size));
  }
  const Eigen::MatrixXd X = design(data, terms, judged.linear);
  const Triangles triangles = triangles_of(data, X, y, keep, kFolds);
  MixedFit fit;
  // What deviations explain depends on how many rows count, which depends on what they leave.
  for (int round = 0; round < 2; ++round) {
    fit = fit_all(triangles, judged.groups, first_shape, tau);
    judged.theta = fit.linear.theta.cwiseQuotient(triangles.size);
    judged.residual = y - X * judged.theta;
    for (std::size_t i = 0; i < data.records().size(); ++i) {
      const RowRange& range = data.records()[i];
      const SmallVector& b = fit.spread.by_record[i];
      if (b.size() > 0 && b.cwiseAbs().maxCoeff() > 0.0)
        judged.residual.segment(range.first, range.size()) -=
            X.middleRows(range.first, range.size()) * (fit.u * b).cwiseQuotient(triangles.size);
    }
    judged.root_weights = root_weights_of(data, keep, fit.spread.variance);
    judged.autocorrelation_time =
        std::max(regression::autocorrelation_time(data.records(), judged.root_weights.cwiseProduct(judged.residual)),
                 data.filter_autocorrelation_time());
    if (judged.groups.empty() || judged.autocorrelation_time < 1.1 * tau) break;
    tau = judged.autocorrelation_time;
  }
  set(judged.theta);
  judged.own_share = fit.linear.own_share;
  judged.deviations = fit.spread;
  judged.sums = sums_of(triangles, fit.linear.theta, fit.u);
  // Noise counts `tau` rows as one already, in the triangles' weights.
  const double counted = (keep.array() > 0.0).count();
  const double freedom = counted / std::max(1.0, counted - static_cast<double>(X.cols()));
  judged.covariance = triangles.size.cwiseInverse().asDiagonal() * fit.linear.unit_covariance *
                      triangles.size.cwiseInverse().asDiagonal() * (freedom * judged.autocorrelation_time / tau);
  judged.std = (fit.linear.unit_covariance.diagonal() * freedom * (judged.autocorrelation_time / tau))
                   .cwiseSqrt()
                   .cwiseQuotient(triangles.size);
  judged.left_out = predict_left_out(triangles, fit, tau);
  if (!judged.groups.empty() && judged.deviations.std.maxCoeff() > 0.0) {
    const MixedFit alike = fit_all(triangles, {}, first_shape, tau);
    judged.alike.residual = y - X * alike.linear.theta.cwiseQuotient(triangles.size);
    judged.alike.root_weights = root_weights_of(data, keep, alike.spread.variance);
    judged.alike.left_out = predict_left_out(triangles, alike, tau);
  }
  judged.terms = std::move(terms);
  return judged;
}

namespace {

// Standard deviations of `judged` for the groups of another model, by name; a group that it does not have has none.
SmallVector spread_for(const std::vector<Group>& groups, const Judged& judged) {
  SmallVector std = SmallVector::Zero(static_cast<Eigen::Index>(groups.size()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (std::size_t k = 0; k < judged.groups.size(); ++k)
      if (judged.groups[k].name == groups[g].name)
        std[static_cast<Eigen::Index>(g)] = judged.deviations.std[static_cast<Eigen::Index>(k)];
  return std;
}

}  // namespace

regression::Whitening whitening_of(BalanceData& data, const Judged& judged) {
  if (judged.groups.empty()) return judged.root_weights;
  const auto first_shape = static_cast<Eigen::Index>(judged.linear.size());
  const bool stays =
      std::any_of(judged.groups.begin(), judged.groups.end(), [](const Group& g) { return !g.stays.empty(); });
  const Eigen::MatrixXd X =
      stays ? design(data, judged.terms, judged.linear) : regression::columns_of(data, judged.terms, judged.linear);
  const Eigen::MatrixXd u =
      directions(judged.groups, judged.theta.head(X.cols()), Eigen::VectorXd::Ones(X.cols()), first_shape);
  return regression::whitening_of(data, judged.root_weights, judged.root_weights.asDiagonal() * (X * u),
                                  judged.deviations.std, judged.autocorrelation_time);
}

double squares_left(BalanceData& data, const Terms& terms, const Judged& judged) {
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  const auto linear = regression::free_linear_slots(terms, on_balance);
  const Eigen::VectorXd keep = (judged.root_weights.array() > 0.0).cast<double>();
  const Triangles triangles = triangles_of(data, regression::columns_of(data, terms, linear),
                                           data.target() - data.known_torque(terms, on_balance), keep, 1);
  const std::vector<Group> groups = friction_groups(terms, linear);
  const Eigen::Index columns = triangles.columns();
  SmallVector std = SmallVector::Zero(static_cast<Eigen::Index>(groups.size()));
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(columns);
  double left = 0.0;
  // The groups' torques come from a fit without deviations.
  for (int round = 0; round < 2; ++round) {
    const Eigen::MatrixXd u = directions(groups, theta, triangles.size, columns);
    std::vector<Eigen::MatrixXd> reduced;
    std::vector<const Eigen::MatrixXd*> blocks;
    for (std::size_t i = 0; i < triangles.whole.size(); ++i)
      reduced.push_back(
          without_deviations(triangles.whole[i], u, std, judged.deviations.variance[i] * judged.autocorrelation_time));
    for (const Eigen::MatrixXd& r : reduced) blocks.push_back(&r);
    const Eigen::MatrixXd all = stacked(blocks);
    theta = regression::PivotedQr(all.leftCols(columns), 1e-5).solve(all.col(columns));
    left = (all.col(columns) - all.leftCols(columns) * theta).squaredNorm();
    std = spread_for(groups, judged);
    if (groups.empty() || std.maxCoeff() <= 0.0) break;
  }
  return left;
}

namespace {

// Noise is each record's own, as the extended model leaves it.
double fall_alike_percent(const Judged& base, const Judged& extended) {
  const std::vector<LeftOut>&before = base.left_out_alike(), &after = extended.left_out_alike();
  double chi2_before = 0.0, chi2_after = 0.0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const double noise = std::max(after[i].squares / std::max(1.0, after[i].rows), 1e-300);
    chi2_before += before[i].squares / noise;
    chi2_after += after[i].squares / noise;
  }
  return chi2_before > 0.0 ? 100.0 * (1.0 - chi2_after / chi2_before) : 0.0;
}

}  // namespace

Fall fall_of(const Judged& base, const Judged& extended, double added) {
  const double tau = std::max(1.0, std::min(base.autocorrelation_time, extended.autocorrelation_time));
  std::vector<double> after;
  for (const LeftOut& r : extended.left_out) after.push_back(r.squares / std::max(1.0, r.rows));
  const double least = std::max(least_of(after), 1e-300);
  double ratio = 0.0, chi2_before = 0.0, chi2_after = 0.0;
  const auto noise = [&](const LeftOut& r) { return std::max(r.squares / std::max(1.0, r.rows), least); };
  // Minus twice the log likelihood: what the rows leave, and what the records' deviations cost.
  const auto deviance = [&](const Judged& judged, std::size_t i, double& chi2) {
    const LeftOut& r = judged.left_out[i];
    Cost cost;
    if (i < judged.sums.size()) cost = cost_of_deviations(judged.sums[i], judged.deviations.std, noise(r) * tau);
    chi2 += r.squares / noise(extended.left_out[i]) + tau * cost.squares;
    return r.rows / tau * std::log(noise(r)) + cost.squares + cost.log_det;
  };
  for (std::size_t i = 0; i < after.size(); ++i)
    ratio += deviance(base, i, chi2_before) - deviance(extended, i, chi2_after);
  const double effective = rows_of(base.left_out) / tau;
  Fall fall;
  fall.score = ratio - added * std::log(std::max(2.0, effective));
  fall.chi2_percent = chi2_before > 0.0 ? 100.0 * (1.0 - chi2_after / chi2_before) : 0.0;
  fall.alike_percent = fall_alike_percent(base, extended);
  const boost::math::chi_squared_distribution<double> distribution(std::max(1.0, added));
  fall.p_value = ratio > 0.0 ? boost::math::cdf(boost::math::complement(distribution, ratio)) : 1.0;
  return fall;
}

}  // namespace flexspline::diagnosis
