#include "host/common/signals/kalman_smoother.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "host/common/numbers/golden_section.hpp"

namespace flexspline::signals {
namespace {

using Matrix = Eigen::Matrix3d;
using Vector = Eigen::Vector3d;

// Corner frequency times sample time that the search covers.
constexpr double kLowest = 1e-4, kHighest = 3.0;
constexpr std::size_t kFewestForLikelihood = 16, kFewestToSmooth = 3, kLongestForLikelihood = 40000;
constexpr double kStationary = 1e-12;

// With h = w T and the states position, velocity / w, acceleration / w^2 all covariances are of one size; they are over
// the variance of the position.
struct MotionModel {
  Matrix step, noise;

  explicit MotionModel(double h) {
    const double h2 = h * h;
    step << 1.0, h, 0.5 * h2, 0.0, 1.0, h, 0.0, 0.0, 1.0;
    noise << h2 * h2 * h2 / 20.0, h2 * h2 * h / 8.0, h2 * h2 / 6.0,  //
        h2 * h2 * h / 8.0, h2 * h2 / 3.0, h2 * h / 2.0,              //
        h2 * h2 / 6.0, h2 * h / 2.0, h2;
  }
};

// The covariances of the filter from sample to sample, until they change no more.
class Covariances {
 public:
  // The first two samples give the position and the velocity; the acceleration is unknown.
  explicit Covariances(double h)
      : model_(h), filtered_(Vector(1.0, 4.0 / (h * h), 1e4 / (h * h * h * h)).asDiagonal()) {
    predict();
  }
  const Matrix& predicted() const { return predicted_; }
  const Matrix& filtered() const { return filtered_; }
  const Vector& gain() const { return gain_; }
  double innovation() const { return innovation_; }
  bool is_stationary() const { return stationary_; }
  const MotionModel& model() const { return model_; }
  // From what is filtered back to the sample before.
  Matrix smoother_gain() const { return predicted_.ldlt().solve(model_.step * filtered_).transpose(); }
  // Takes a sample: from `predicted` to `filtered`.
  void update() {
    const Vector before = gain_;
    innovation_ = predicted_(0, 0) + 1.0;
    gain_ = predicted_.col(0) / innovation_;
    const Matrix left = Matrix::Identity() - gain_ * Vector::UnitX().transpose();
    filtered_ = left * predicted_ * left.transpose() + gain_ * gain_.transpose();
    stationary_ = (gain_ - before).cwiseAbs().maxCoeff() < kStationary * gain_.cwiseAbs().maxCoeff();
  }
  void predict() {
    predicted_ = model_.step * filtered_ * model_.step.transpose() + model_.noise;
    predicted_ = 0.5 * (predicted_ + predicted_.transpose().eval());
  }

 private:
  MotionModel model_;
  Matrix filtered_, predicted_;
  Vector gain_ = Vector::Zero();
  double innovation_ = 1.0;
  bool stationary_ = false;
};

Vector first_state(std::span<const double> position, double h) {
  return {0.0, (position[1] - position[0]) / h, 0.0};
}

// Mean of the squared innovations over their variance, and of that variance's logarithm; both for a variance of one of
// the position.
struct Innovations {
  double square = 0.0, log_variance = 0.0;

  // Minus twice the mean logarithm of the likelihood at the most likely variance, or at a given one.
  double cost() const { return std::log(std::max(square, 1e-300)) + log_variance + 1.0; }
  double cost(double variance) const { return std::log(variance) + log_variance + square / variance; }
};

Innovations innovations_at(std::span<const double> position, double h) {
  Covariances now(h);
  const Matrix step = now.model().step;
  Vector state = step * first_state(position, h);
  Innovations found;
  std::size_t count = 0;
  for (std::size_t k = 1; k < position.size(); ++k) {
    if (!now.is_stationary()) now.update();
    const double error = position[k] - position[0] - state[0];
    if (k > kFewestToSmooth) {  // the samples that the first state was made of show nothing
      found.square += error * error / now.innovation();
      found.log_variance += std::log(now.innovation());
      ++count;
    }
    state = step * (state + now.gain() * error);
    if (!now.is_stationary()) now.predict();
  }
  found.square /= static_cast<double>(count);
  found.log_variance /= static_cast<double>(count);
  return found;
}

// The least of a function of the logarithm of h: on a grid, then by golden sections.
template <class Cost>
double best_corner(const Cost& cost) {
  constexpr int kGrid = 24, kSections = 20;
  const double low = std::log(kLowest), step = (std::log(kHighest) - low) / kGrid;
  double best = low, least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kGrid; ++k)
    if (const double c = cost(std::exp(low + k * step)); c < least) {
      least = c;
      best = low + k * step;
    }
  return std::exp(numbers::golden_section(best - step, best + step, kSections,
                                          [&](double log_corner) { return cost(std::exp(log_corner)); }));
}

void require(std::span<const double> position, double sample_s, std::size_t fewest) {
  if (!(sample_s > 0.0))
    throw std::invalid_argument(
        fmt::format("Kalman smoother: sample time {} s is not positive; check the time column", sample_s));
  if (position.size() < fewest)
    throw std::invalid_argument(
        fmt::format("Kalman smoother: {} samples, and it takes {}; record longer", position.size(), fewest));
}

double corner_of(const MotionCovariances& c, double sample_s) {
  const double h = std::pow(c.jerk_density * std::pow(sample_s, 5) / c.position_variance, 1.0 / 6.0);
  return std::clamp(h, kLowest, kHighest);
}

}  // namespace

double MotionCovariances::corner_hz(double sample_s) const {
  return corner_of(*this, sample_s) / (2.0 * std::numbers::pi * sample_s);
}

MotionCovariances most_likely_covariances(std::span<const double> position, double sample_s, double least_variance) {
  require(position, sample_s, kFewestForLikelihood);
  if (position.size() > kLongestForLikelihood)
    position = position.subspan((position.size() - kLongestForLikelihood) / 2, kLongestForLikelihood);
  double h = best_corner([&](double tried) { return innovations_at(position, tried).cost(); });
  double variance = innovations_at(position, h).square;
  if (variance < least_variance) {
    variance = least_variance;
    h = best_corner([&](double tried) { return innovations_at(position, tried).cost(variance); });
  }
  if (!(variance > 0.0)) variance = std::numeric_limits<double>::min();  // a position that stays, without a step
  return {variance, variance * std::pow(h, 6) / std::pow(sample_s, 5)};
}

SmoothedMotion rauch_tung_striebel(std::span<const double> position, double sample_s,
                                   const MotionCovariances& covariances) {
  require(position, sample_s, kFewestToSmooth);
  const double h = corner_of(covariances, sample_s);
  const std::size_t n = position.size();
  Covariances now(h);
  const Matrix step = now.model().step;
  // Forward. The gains that lead back are kept until they are stationary; the last of them holds from there on.
  std::vector<Vector> filtered(n);
  std::vector<Matrix> back;
  filtered[0] = first_state(position, h);
  Matrix stationary_filtered = now.filtered(), stationary_predicted = now.predicted();
  back.push_back(now.smoother_gain());
  for (std::size_t k = 1; k < n; ++k) {
    const Vector predicted = step * filtered[k - 1];
    const bool changes = !now.is_stationary();
    if (changes) now.update();
    filtered[k] = predicted + now.gain() * (position[k] - position[0] - predicted[0]);
    if (!changes) continue;
    stationary_filtered = now.filtered();
    now.predict();
    stationary_predicted = now.predicted();
    back.push_back(now.smoother_gain());
  }
  // Backward.
  SmoothedMotion found;
  for (std::vector<double>* signal : {&found.position, &found.velocity, &found.acceleration}) signal->resize(n);
  const double w = h / sample_s;
  Vector state = filtered[n - 1];
  for (std::size_t k = n; k-- > 0;) {
    if (k + 1 < n) state = filtered[k] + back[std::min(k, back.size() - 1)] * (state - step * filtered[k]);
    found.position[k] = position[0] + state[0];
    found.velocity[k] = w * state[1];
    found.acceleration[k] = w * w * state[2];
  }
  const Matrix& gain = back.back();
  Matrix smoothed = stationary_filtered;
  for (int round = 0; round < 100000; ++round) {
    const Matrix next = stationary_filtered + gain * (smoothed - stationary_predicted) * gain.transpose();
    const bool same = (next - smoothed).cwiseAbs().maxCoeff() < kStationary * next.cwiseAbs().maxCoeff();
    smoothed = next;
    if (same) break;
  }
  const Vector std = smoothed.diagonal().cwiseMax(0.0).cwiseSqrt() * std::sqrt(covariances.position_variance);
  found.position_std = std[0];
  found.velocity_std = w * std[1];
  found.acceleration_std = w * w * std[2];
  return found;
}

SmootherNoise smoother_noise(double sample_s, const MotionCovariances& covariances) {
  const double h = corner_of(covariances, sample_s);
  const auto reach = static_cast<std::size_t>(std::min(200000.0, std::ceil(40.0 / h) + 100.0));
  std::vector<double> impulse(2 * reach + 1, 0.0);
  impulse[reach] = 1.0;
  const SmoothedMotion response = rauch_tung_striebel(impulse, sample_s, covariances);
  const auto length = [](const std::vector<double>& x) {
    double sum = 0.0;
    for (const double v : x) sum += v * v;
    return std::sqrt(sum);
  };
  return {length(response.velocity), length(response.acceleration)};
}

}  // namespace flexspline::signals
