#include "host/engine/estimation/variable_projection.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/numbers/quantile.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/minimise.hpp"
#include "host/engine/estimation/strokes.hpp"

namespace flexspline::estimation {
namespace {

using effects::Limit;

using numbers::quantile;

// Magnitudes of a signal over the samples of the balance.
template <class Signal>
std::vector<double> magnitudes(const RegressionProblem& data, Signal signal) {
  std::vector<double> values;
  for (const RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    if (r.at_rest) continue;
    for (const std::size_t k : r.rows[index(data.balance())].samples) values.push_back(std::abs(signal(r.inputs[k])));
  }
  return values;
}

// A short stroke of all records: those that are shorter make a tenth of the travel.
double short_stroke(const RegressionProblem& data) {
  std::vector<double> all;
  for (const RowRange& range : data.records()) {
    const std::vector<double> own = strokes(data.prepared().records[range.record]);
    all.insert(all.end(), own.begin(), own.end());
  }
  return stroke_quantile(std::move(all), 0.1);
}

// Travel after a reversal that the data cannot resolve: some counts of the encoder, and what is covered under the mask,
// or, where reversals are kept, between two rows, of which four are kept in a period of the cut-off.
double unseen_travel(const RegressionProblem& data) {
  std::vector<double> travel;
  double counts = 0.0;
  const Pipeline& pipeline = data.prepared().pipeline;
  const bool is_masked = pipeline.mask && !pipeline.keep_motor_reversals;
  const double unseen_s = (is_masked ? 1.0 : 0.25) / pipeline.row_cutoff_hz;
  for (const RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    counts = std::max(counts, 4.0 * r.motor_quantum.value_or(0.0));
    for (std::size_t k = 1; k < r.inputs.size(); ++k)
      if (r.inputs.velocity_at(k) * r.inputs.velocity_at(k - 1) < 0.0)
        travel.push_back(0.5 * std::abs(r.inputs[k].acceleration) * unseen_s * unseen_s);
  }
  return std::max(counts, quantile(travel, 0.1));
}

double largest_torsion(const RegressionProblem& data) {
  return quantile(magnitudes(data, [](const auto& in) { return in.torsion; }), 0.99);
}

std::vector<double> usual_reduced(const catalogue::Entry& entry) {
  std::vector<double> usual;
  for (const auto& info : entry.parameters) usual.push_back(info.usual);
  return catalogue::reduced(entry, usual);
}

// Weighted columns of like size, so that the factorisation does not drop a small one (a cubed torsion).
struct ScaledColumns {
  Eigen::MatrixXd A;
  Eigen::VectorXd size;
};
ScaledColumns scaled_columns(const Eigen::MatrixXd& X, const NoiseCovariance& error_covariance) {
  ScaledColumns s{error_covariance.whiten(X), {}};
  s.size = s.A.colwise().norm().transpose().array().max(1e-300);
  s.A *= s.size.cwiseInverse().asDiagonal();
  return s;
}

// The sum over samples of weighted squares after the best linear parameters.
double projected_cost(const RegressionProblem::Regression& regression, const NoiseCovariance& error_covariance) {
  const Eigen::MatrixXd A = scaled_columns(regression.X, error_covariance).A;
  const Eigen::VectorXd b = error_covariance.whiten(regression.y);
  return (b - A * algebra::PivotedQr(A).solve(b)).squaredNorm();
}

}  // namespace

double ParameterRange::at(double share_of_range) const {
  return logarithmic ? low * std::pow(high / low, share_of_range) : low + (high - low) * share_of_range;
}

double ParameterRange::share(double value) const {
  const double s =
      logarithmic ? std::log(std::max(value, 1e-300) / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(s, 0.0, 1.0);
}

namespace {

// Quantities with a scale, between two values of the data and within what is possible.
ParameterRange scale_between(const effects::ParameterInfo& info, double low, double high) {
  ParameterRange range;
  range.low = std::max(low, info.low);
  range.high = std::min(std::max(high, 2.0 * range.low), info.high);
  range.logarithmic = true;
  return range;
}

constexpr double kNegligible = 1e-9;

ParameterRange torsion_range(const RegressionProblem& data, const effects::ParameterInfo& info) {
  const double largest = largest_torsion(data);
  switch (info.limit) {
    case Limit::torsion:
      if (info.low < 0.0) return {-largest / 3.0, largest / 3.0, false};  // of either sign
      return scale_between(info, largest * 3e-3, largest / 3.0);
    case Limit::corner:
      return scale_between(info, largest * 3e-3, largest * 1.5);
    case Limit::span:
      return {std::max(0.5 * largest, info.low), 1.3 * largest, false};
    default:  // inverse_torsion
      return scale_between(info, 0.5 / std::max(largest, 1e-300), 1.0 / (3e-3 * std::max(largest, 1e-300)));
  }
}

// Speeds of the samples that move: where an axis dwells, its speed is what the filter leaves of noise.
std::vector<double> speeds(const RegressionProblem& data) {
  std::vector<double> moving;
  for (const RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    for (const std::size_t k : r.rows[index(data.balance())].samples)
      if (const double speed = std::abs(r.inputs.velocity_at(k));
          !r.at_rest && speed > r.velocity_noise[index(Balance::motor)])
        moving.push_back(speed);
  }
  return moving;
}

ParameterRange velocity_range(const RegressionProblem& data, const effects::ParameterInfo& info) {
  const std::vector<double> all = speeds(data);
  // The unmasked samples must cover the term: its width is at least the slowest hundredth of the samples.
  if (info.limit == Limit::velocity)
    return scale_between(info, std::max(quantile(all, 0.01), kNegligible), 0.25 * quantile(all, 0.95));
  return scale_between(info, 1e-3 / std::max(quantile(all, 0.95), kNegligible),
                       1.0 / std::max(quantile(all, 0.01), kNegligible));
}

ParameterRange current_range(const RegressionProblem& data, const effects::ParameterInfo& info) {
  const std::vector<double> all = magnitudes(data, [](const auto& in) { return in.current; });
  const double largest = quantile(all, 1.0);
  // A limit shows as a plateau at the peaks. A limit below half of the log could reproduce any measured signal.
  return {std::max({0.25 * largest, quantile(all, 0.5), info.low}), largest, false};
}

}  // namespace

ParameterRange parameter_range(const RegressionProblem& data, const Term& term, std::size_t parameter) {
  const auto& info = term.entry->parameters[parameter];
  switch (info.limit) {
    case Limit::stated:
      break;
    case Limit::scale:
      return {info.low, info.high, true};
    case Limit::velocity:
    case Limit::inverse_velocity:
      return velocity_range(data, info);
    case Limit::travel:
      return scale_between(info, std::max(unseen_travel(data), kNegligible), short_stroke(data));
    case Limit::torsion:
    case Limit::corner:
    case Limit::span:
    case Limit::inverse_torsion:
      return torsion_range(data, info);
    case Limit::current:
      return current_range(data, info);
    case Limit::inverse_travel: {
      const double least = std::max(unseen_travel(data), kNegligible);
      return scale_between(info, 1.0 / std::max(short_stroke(data), 2.0 * least), 1.0 / least);
    }
    case Limit::inverse_torque: {
      const double largest =
          std::max(quantile(magnitudes(data, [](const auto& in) { return in.torque; }), 0.99), 1e-300);
      return scale_between(info, 0.01 / largest, 30.0 / largest);
    }
  }
  return {info.low, info.high, false};
}

void set_grid_values(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& which) {
  for (const std::size_t t : which)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p) {
      const auto& info = terms[t].entry->parameters[p];
      if (info.kind != effects::Kind::grid || terms[t].stated[p]) continue;
      terms[t].values[p] = info.share_of_range * largest_torsion(data);
      terms[t].stated[p] = 1;
    }
}

std::vector<double> parameter_grid(const ParameterRange& range, std::size_t count) {
  std::vector<double> values;
  for (std::size_t k = 0; k < count; ++k)
    values.push_back(range.at((static_cast<double>(k) + 0.5) / static_cast<double>(count)));
  return values;
}

void sweep_nonlinear(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                     const NoiseCovariance& error_covariance, SweepFrom from) {
  const std::vector<ParameterRef> nonlinear = free_nonlinear_parameters(terms, on_balance);
  const std::vector<ParameterRef> linear = free_linear_parameters(terms, on_balance);
  std::vector<ParameterRef> open;
  for (const ParameterRef& s : nonlinear) {
    if (terms[s.term].stated[s.parameter]) continue;
    open.push_back(s);
    if (from == SweepFrom::values) continue;
    const auto& info = terms[s.term].entry->parameters[s.parameter];
    // A ratio or an exponent begins at its usual value, other parameters in the middle of their range.
    terms[s.term].values[s.parameter] = info.limit == Limit::stated || info.limit == Limit::scale
                                            ? usual_reduced(*terms[s.term].entry)[s.parameter]
                                            : parameter_range(data, terms[s.term], s.parameter).at(0.5);
  }
  constexpr std::size_t kGrid = 6;
  const auto cost_now = [&] { return projected_cost(data.regression(terms, on_balance, linear), error_covariance); };
  for (int around = 0; around < (open.size() > 1 ? 2 : 1); ++around)
    for (const ParameterRef& s : open) {
      double& value = terms[s.term].values[s.parameter];
      double best = value, least = cost_now();
      for (const double tried : parameter_grid(parameter_range(data, terms[s.term], s.parameter), kGrid)) {
        value = tried;
        const double cost = cost_now();
        if (cost < least) {
          least = cost;
          best = tried;
        }
      }
      value = best;
    }
}

double refine_nonlinear(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                        const NoiseCovariance& error_covariance) {
  constexpr double kTolerance = 1e-9;
  return refine_nonlinear(data, terms, on_balance, error_covariance, kTolerance);
}

namespace {

// Residual of the best linear fit as a function of the nonlinear parameters alone, each as a share of its range.
class ProjectedResidual {
 public:
  ProjectedResidual(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                    const NoiseCovariance& error_covariance)
      : terms_(terms),
        on_balance_(on_balance),
        error_covariance_(error_covariance),
        nonlinear_(free_nonlinear_parameters(terms, on_balance)),
        linear_(free_linear_parameters(terms, on_balance)) {
    for (const ParameterRef& s : nonlinear_) ranges_.push_back(parameter_range(data, terms[s.term], s.parameter));
  }

  std::size_t nonlinear() const { return nonlinear_.size(); }
  // The present values of the terms, not at the very ends.
  std::vector<double> start() const {
    std::vector<double> shares;
    for (std::size_t j = 0; j < nonlinear_.size(); ++j)
      shares.push_back(
          std::clamp(ranges_[j].share(terms_[nonlinear_[j].term].values[nonlinear_[j].parameter]), 0.01, 0.99));
    return shares;
  }
  void set(const std::vector<double>& shares) {
    for (std::size_t j = 0; j < nonlinear_.size(); ++j)
      terms_[nonlinear_[j].term].values[nonlinear_[j].parameter] = ranges_[j].at(shares[j]);
  }
  // Columns come from this from now on.
  void use(const RegressionProblem& data) {
    on_ = &data;
    factored_at_.clear();
  }

  // The solver needs slopes where it had values: the factors are stored until then.
  bool operator()(const std::vector<double>& shares, Eigen::VectorXd& residual, Eigen::MatrixXd* slopes) {
    set(shares);
    if (shares != factored_at_) factor(shares);
    residual = left_;
    if (slopes) take_slopes(shares, *slopes);
    return true;
  }

 private:
  void factor(const std::vector<double>& shares) {
    const RegressionProblem::Regression regression = on_->regression(terms_, on_balance_, linear_);
    ScaledColumns columns = scaled_columns(regression.X, error_covariance_);
    A_ = std::move(columns.A);
    size_ = std::move(columns.size);
    const Eigen::VectorXd b = error_covariance_.whiten(regression.y);
    qr_ = algebra::PivotedQr(A_);
    theta_ = qr_.solve(b);
    left_ = b - A_ * theta_;
    factored_at_ = shares;
  }
  // After Kaufman (1975).
  void take_slopes(const std::vector<double>& shares, Eigen::MatrixXd& slopes) {
    for (std::size_t j = 0; j < linear_.size(); ++j)
      terms_[linear_[j].term].values[linear_[j].parameter] =
          theta_[static_cast<Eigen::Index>(j)] / size_[static_cast<Eigen::Index>(j)];
    slopes.resize(left_.size(), static_cast<Eigen::Index>(nonlinear_.size()));
    constexpr double kDifference = 1e-6;
    const Eigen::MatrixXd columns = error_covariance_.whiten(on_->nonlinear_columns(terms_, on_balance_, nonlinear_));
    for (std::size_t j = 0; j < nonlinear_.size(); ++j) {
      const double per_share =
          (ranges_[j].at(shares[j] + kDifference) - ranges_[j].at(shares[j] - kDifference)) / (2.0 * kDifference);
      const Eigen::VectorXd slope = columns.col(static_cast<Eigen::Index>(j)) * per_share;
      slopes.col(static_cast<Eigen::Index>(j)) = -(slope - A_ * qr_.solve(slope));
    }
  }

  Terms& terms_;
  const std::vector<std::size_t>& on_balance_;
  const NoiseCovariance& error_covariance_;
  std::vector<ParameterRef> nonlinear_, linear_;
  std::vector<ParameterRange> ranges_;
  const RegressionProblem* on_ = nullptr;
  std::vector<double> factored_at_;
  Eigen::MatrixXd A_;
  Eigen::VectorXd size_, theta_, left_;
  algebra::PivotedQr qr_;
};

}  // namespace

double refine_nonlinear(const RegressionProblem& data, Terms& terms, const std::vector<std::size_t>& on_balance,
                        const NoiseCovariance& error_covariance, double tolerance, const RegressionProblem* coarse) {
  ProjectedResidual projected(data, terms, on_balance, error_covariance);
  if (projected.nonlinear() == 0 || data.empty())
    return projected_cost(data.regression(terms, on_balance, free_linear_parameters(terms, on_balance)),
                          error_covariance);
  Minimisation how;
  how.low.assign(projected.nonlinear(), 0.0);
  how.high.assign(projected.nonlinear(), 1.0);
  how.function_tolerance = tolerance;
  std::vector<double> shares = projected.start();
  // The decimated samples give a start from which all samples need one or two steps.
  double cost = 0.0;
  for (const RegressionProblem* const stage : {coarse, &data}) {
    if (!stage) continue;
    projected.use(*stage);
    cost = minimise(shares, data.rows(), std::ref(projected), how);
  }
  projected.set(shares);
  return 2.0 * cost;
}

}  // namespace flexspline::estimation
