#include "host/engine/estimation/random_effects.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/numbers/golden_section.hpp"

namespace flexspline::estimation {
namespace {

// Bounds of the search, relative: friction does not differ by more from run to run, and less is not seen.
constexpr double kLargestStd = 0.5;
constexpr double kSmallestStd = 1e-4;

// I + S Z'Z S/v: what random effects of standard deviation S add to noise of variance v.
Eigen::LLT<SmallMatrix> inner(const RecordErrors& r, const SmallVector& std, double v) {
  SmallMatrix m = SmallMatrix::Identity(std.size(), std.size());
  m += std.asDiagonal() * r.zz * std.asDiagonal() / v;
  return m.llt();
}

// What a record says of the standard deviation s of one group, the others as they are. Of minus twice its log
// likelihood, ln det V + e'V^-1 e, the part that depends on s is ln(1 + s^2 zz) - s^2 ze^2/(1 + s^2 zz), with the
// others eliminated (Schur complement).
struct OneGroup {
  double zz = 0.0, ze = 0.0;  // over the noise
  double deviance(double s) const {
    const double more = 1.0 + s * s * zz;
    return std::log(more) - s * s * ze * ze / more;
  }
};
OneGroup without_others(const RecordErrors& r, SmallVector std, Eigen::Index group, double v) {
  std[group] = 0.0;
  const SmallVector along = std.cwiseProduct(r.zz.col(group)) / v, error = std.cwiseProduct(r.ze) / v;
  const SmallVector weight = inner(r, std, v).solve(along);
  return {std::max(r.zz(group, group) / v - along.dot(weight), 0.0), r.ze[group] / v - error.dot(weight)};
}

// The likeliest standard deviation of one group, the others as they are: a grid, then golden sections. Zero where that
// is as likely.
void choose_std(const std::vector<RecordErrors>& records, const std::vector<double>& noise, Eigen::Index group,
                SmallVector& std) {
  std::vector<OneGroup> of_records;
  for (std::size_t i = 0; i < records.size(); ++i)
    of_records.push_back(without_others(records[i], std, group, noise[i]));
  const auto total = [&](double s) {
    double sum = 0.0;
    for (const OneGroup& record : of_records) sum += record.deviance(s);
    return sum;
  };
  constexpr int kSteps = 12;
  const double ratio = std::pow(kLargestStd / kSmallestStd, 1.0 / kSteps);
  double best = 0.0, least = total(0.0), at = kSmallestStd;
  for (int k = 0; k <= kSteps; ++k, at *= ratio)
    if (const double c = total(at); c < least) {
      least = c;
      best = at;
    }
  constexpr int kSections = 10;
  if (best > 0.0)
    best = std::exp(numbers::golden_section(std::log(best / ratio), std::log(std::min(best * ratio, kLargestStd)),
                                            kSections, [&](double log_std) { return total(std::exp(log_std)); }));
  std[group] = best;
}

// Predictions of each record's random effects, and the noise that they leave.
void predict(const std::vector<RecordErrors>& records, double tau, double least_variance, RandomEffects& effects) {
  for (std::size_t i = 0; i < records.size(); ++i) {
    const RecordErrors& r = records[i];
    const SmallVector& b = effects.predictions[i] = best_linear_predictions(r, effects.std, effects.variance[i] * tau);
    double squares = r.ee;
    if (b.size() > 0) squares += b.dot(r.zz * b) - 2.0 * b.dot(r.ze);
    effects.squares[i] = std::max(squares, 0.0);
    effects.variance[i] = std::max({effects.squares[i] / std::max(1.0, r.rows), least_variance, 1e-300});
  }
}

// By group, whether enough records have it for its standard deviation to be estimated.
std::vector<std::uint8_t> identifiable_groups(const std::vector<RecordErrors>& records) {
  const Eigen::Index groups = records.empty() ? 0 : records.front().ze.size();
  std::vector<std::uint8_t> identifiable;
  for (Eigen::Index g = 0; g < groups; ++g)
    identifiable.push_back(
        static_cast<std::size_t>(std::count_if(records.begin(), records.end(), [&](const RecordErrors& r) {
          return r.zz(g, g) > 0.0;
        })) >= kFewestRecords);
  return identifiable;
}

RandomEffects maximise_likelihood(const std::vector<RecordErrors>& records, const SmallVector* given, double tau,
                                  double least_variance, const std::vector<double>& variance) {
  RandomEffects effects;
  const Eigen::Index groups = records.empty() ? 0 : records.front().ze.size();
  effects.std = given ? *given : SmallVector(SmallVector::Zero(groups));
  effects.predictions.assign(records.size(), SmallVector::Zero(groups));
  effects.squares.assign(records.size(), 0.0);
  for (std::size_t i = 0; i < records.size(); ++i)
    effects.variance.push_back(std::max(
        {variance.empty() ? records[i].ee / std::max(1.0, records[i].rows) : variance[i], least_variance, 1e-300}));
  for (const RecordErrors& r : records) effects.deviance.push_back(r.rows);
  const std::vector<std::uint8_t> identifiable = identifiable_groups(records);
  constexpr int kPasses = 5;
  for (int pass = 0; pass < (groups > 0 ? kPasses : 1); ++pass) {
    std::vector<double> noise;
    for (const double v : effects.variance) noise.push_back(v * tau);
    if (!given)
      for (Eigen::Index g = 0; g < groups; ++g)
        if (identifiable[static_cast<std::size_t>(g)]) choose_std(records, noise, g, effects.std);
    predict(records, tau, least_variance, effects);
  }
  for (std::size_t i = 0; i < records.size(); ++i) {
    const RandomEffectCost cost = random_effect_cost(records[i], effects.std, effects.variance[i] * tau);
    effects.deviance[i] = records[i].rows / tau * std::log(effects.variance[i]) + cost.squares + cost.log_det;
  }
  return effects;
}

}  // namespace

RandomEffects fit_random_effects(const std::vector<RecordErrors>& records, double tau, double least_variance,
                                 const std::vector<double>& variance) {
  return maximise_likelihood(records, nullptr, tau, least_variance, variance);
}

RandomEffects random_effects_at(const std::vector<RecordErrors>& records, const SmallVector& std, double tau,
                                double least_variance) {
  return maximise_likelihood(records, &std, tau, least_variance, {});
}

RandomEffects largest_random_effects(const std::vector<RecordErrors>& records, double tau, double least_variance) {
  const std::vector<std::uint8_t> identifiable = identifiable_groups(records);
  SmallVector std = SmallVector::Zero(static_cast<Eigen::Index>(identifiable.size()));
  for (std::size_t g = 0; g < identifiable.size(); ++g)
    std[static_cast<Eigen::Index>(g)] = identifiable[g] ? kLargestStd : 0.0;
  return maximise_likelihood(records, &std, tau, least_variance, {});
}

SmallVector best_linear_predictions(const RecordErrors& r, const SmallVector& std, double v) {
  if (std.size() == 0) return std;
  const SmallVector g = std.cwiseProduct(r.ze) / v;
  return std.cwiseProduct(inner(r, std, v).solve(g));
}

RandomEffectCost random_effect_cost(const RecordErrors& r, const SmallVector& std, double v) {
  RandomEffectCost cost;
  const SmallVector b = best_linear_predictions(r, std, v);
  const Eigen::LLT<SmallMatrix> m = inner(r, std, v);
  for (Eigen::Index g = 0; g < std.size(); ++g) {
    cost.log_det += 2.0 * std::log(m.matrixLLT()(g, g));
    if (std[g] > 0.0) cost.squares += b[g] * b[g] / (std[g] * std[g]);
  }
  return cost;
}

Eigen::MatrixXd eliminate_random_effects(const Eigen::MatrixXd& factor, const Eigen::MatrixXd& u,
                                         const SmallVector& std, double noise_variance) {
  const double root = 1.0 / std::sqrt(noise_variance);
  const Eigen::Index groups = u.cols(), width = factor.cols();
  if (groups == 0 || std.maxCoeff() <= 0.0) return root * factor;
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(factor.rows() + groups, groups + width);
  block.topLeftCorner(groups, groups).setIdentity();
  block.bottomLeftCorner(factor.rows(), groups) = root * factor.leftCols(width - 1) * u * std.asDiagonal();
  block.bottomRightCorner(factor.rows(), width) = root * factor;
  return algebra::r_factor(std::move(block)).block(groups, groups, width, width);
}

void add_errors(const Eigen::MatrixXd& factor, const Eigen::VectorXd& theta, const Eigen::MatrixXd& u, double rows,
                RecordErrors& record) {
  const Eigen::Index columns = theta.size();
  if (record.ze.size() != u.cols()) {
    record.ze = SmallVector::Zero(u.cols());
    record.zz = SmallMatrix::Zero(u.cols(), u.cols());
  }
  const Eigen::VectorXd e = factor.col(columns) - factor.leftCols(columns) * theta;
  const Eigen::MatrixXd z = factor.leftCols(columns) * u;
  record.rows += rows;
  record.ee += e.squaredNorm();
  record.ze += z.transpose() * e;
  record.zz += z.transpose() * z;
}

namespace {

std::vector<double> raw_variances(const std::vector<RecordErrors>& records) {
  std::vector<double> variances;
  for (const RecordErrors& r : records) variances.push_back(r.ee / std::max(1.0, r.rows));
  return variances;
}

// Two starts: all differences between records as noise, or the largest random effects that are allowed.
enum class Start { all_noise, largest_effects };

MixedFit fit_from(Start start, const RecordFactors& factors, const std::vector<FrictionGroup>& groups,
                  Eigen::Index first_nonlinear, double tau) {
  MixedFit fit;
  const Eigen::Index columns = factors.columns();
  const auto solve = [&] {
    std::vector<Eigen::MatrixXd> reduced;
    for (std::size_t i = 0; i < factors.whole.size(); ++i)
      reduced.push_back(
          fit.effects.variance.empty()
              ? factors.whole[i]
              : eliminate_random_effects(factors.whole[i], fit.u, fit.effects.std, fit.effects.variance[i] * tau));
    const Eigen::MatrixXd all = combined_factor(reduced);
    fit.linear = least_squares(all.leftCols(columns), all.col(columns), Eigen::VectorXd::Ones(all.rows()));
    fit.u = random_effect_directions(groups, fit.linear.theta, factors.size, first_nonlinear);
  };
  solve();
  if (start == Start::largest_effects) {
    const std::vector<RecordErrors> errors = record_errors(factors, fit.linear.theta, fit.u);
    fit.effects = largest_random_effects(errors, tau, least_variance_of(raw_variances(errors)));
    solve();
  }
  // Parameters, random effects and noise depend on each other.
  constexpr int kMostRounds = 12;
  constexpr double kSame = 0.02;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<RecordErrors> errors = record_errors(factors, fit.linear.theta, fit.u);
    // The limit of the noise follows the residual without random effects.
    const double least = least_variance_of(fit.effects.variance.empty() ? raw_variances(errors) : fit.effects.variance);
    const SmallVector before = fit.effects.std;
    fit.effects = fit_random_effects(errors, tau, least, fit.effects.variance);
    solve();
    if (round > 1 && (groups.empty() || (fit.effects.std - before).cwiseAbs().maxCoeff() <=
                                            kSame * fit.effects.std.cwiseAbs().maxCoeff()))
      break;
  }
  return fit;
}

}  // namespace

MixedFit fit_mixed_model(const RecordFactors& factors, const std::vector<FrictionGroup>& groups,
                         Eigen::Index first_nonlinear, double tau) {
  MixedFit fit = fit_from(Start::all_noise, factors, groups, first_nonlinear, tau);
  if (groups.empty()) return fit;
  MixedFit other = fit_from(Start::largest_effects, factors, groups, first_nonlinear, tau);
  return other.deviance() < fit.deviance() ? other : fit;
}

std::vector<RecordErrors> record_errors(const RecordFactors& factors, const Eigen::VectorXd& theta,
                                        const Eigen::MatrixXd& u) {
  std::vector<RecordErrors> records(factors.whole.size());
  for (std::size_t i = 0; i < records.size(); ++i)
    add_errors(factors.whole[i], theta, u, factors.rows_of(i), records[i]);
  return records;
}

double least_variance_of(std::vector<double> variances) {
  if (variances.empty()) return 0.0;
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return 0.01 * *middle;
}

Eigen::MatrixXd combined_factor(const std::vector<Eigen::MatrixXd>& reduced) {
  std::vector<const Eigen::MatrixXd*> blocks;
  for (const Eigen::MatrixXd& r : reduced) blocks.push_back(&r);
  return combined_factor(blocks);
}

}  // namespace flexspline::estimation
