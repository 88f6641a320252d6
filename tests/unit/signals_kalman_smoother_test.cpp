// The Kalman smoother: against the least-squares solution of the same model, against motions drawn from it, and against
// sines through an encoder.
#include "host/common/signals/kalman_smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

namespace flexspline::signals::signals_kalman_smoother_test {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSample = 1e-3;

// A motion driven by white jerk, measured with white noise.
struct Drawn {
  std::vector<double> position, velocity, acceleration;
};
Drawn drawn(const MotionCovariances& c, std::size_t samples, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  // White jerk over one sample: its triple, double and single integrals have this covariance.
  const double t = kSample;
  Eigen::Matrix3d noise;
  noise << std::pow(t, 5) / 20.0, std::pow(t, 4) / 8.0, std::pow(t, 3) / 6.0,  //
      std::pow(t, 4) / 8.0, std::pow(t, 3) / 3.0, t * t / 2.0,                 //
      std::pow(t, 3) / 6.0, t * t / 2.0, t;
  const Eigen::Matrix3d root = Eigen::LLT<Eigen::Matrix3d>(c.jerk_density * noise).matrixL();
  Eigen::Vector3d state = Eigen::Vector3d::Zero();
  Eigen::Matrix3d step;
  step << 1.0, t, 0.5 * t * t, 0.0, 1.0, t, 0.0, 0.0, 1.0;
  Drawn d;
  for (std::size_t k = 0; k < samples; ++k) {
    d.position.push_back(state[0] + std::sqrt(c.position_variance) * normal(random));
    d.velocity.push_back(state[1]);
    d.acceleration.push_back(state[2]);
    state = step * state + root * Eigen::Vector3d(normal(random), normal(random), normal(random));
  }
  return d;
}

double rms_difference(const std::vector<double>& a, const std::vector<double>& b, std::size_t edge) {
  double sum = 0.0;
  for (std::size_t k = edge; k + edge < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size() - 2 * edge));
}

// The smoothed states are the least-squares solution of all samples and steps at once, solved here as such.
TEST(KalmanSmoother, IsTheLeastSquaresSolutionOfItsModel) {
  const MotionCovariances c{1e-6, 4e3};
  const std::size_t n = 120;
  const std::vector<double> y = drawn(c, n, 3).position;
  const double t = kSample;
  Eigen::Matrix3d noise, step;
  noise << std::pow(t, 5) / 20.0, std::pow(t, 4) / 8.0, std::pow(t, 3) / 6.0, std::pow(t, 4) / 8.0,
      std::pow(t, 3) / 3.0, t * t / 2.0, std::pow(t, 3) / 6.0, t * t / 2.0, t;
  step << 1.0, t, 0.5 * t * t, 0.0, 1.0, t, 0.0, 0.0, 1.0;
  const Eigen::Vector3d size(1.0, 1.0 / t, 1.0 / (t * t));  // states in samples, for the conditioning
  const Eigen::Matrix3d scale = size.asDiagonal();
  const Eigen::Matrix3d inner = scale.inverse() * step * scale;
  const Eigen::Matrix3d covariance = c.jerk_density * scale.inverse() * noise * scale.inverse();
  const Eigen::Matrix3d root = Eigen::LLT<Eigen::Matrix3d>(covariance).matrixL().solve(Eigen::Matrix3d::Identity());
  const auto states = static_cast<Eigen::Index>(3 * n), steps = static_cast<Eigen::Index>(3 * (n - 1));
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(steps + static_cast<Eigen::Index>(n), states);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(a.rows());
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const auto at = static_cast<Eigen::Index>(3 * k);
    a.block<3, 3>(at, at) = -root * inner;
    a.block<3, 3>(at, at + 3) = root;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const auto row = steps + static_cast<Eigen::Index>(k);
    a(row, static_cast<Eigen::Index>(3 * k)) = 1.0 / std::sqrt(c.position_variance);
    b[row] = y[k] / std::sqrt(c.position_variance);
  }
  const Eigen::VectorXd x = a.colPivHouseholderQr().solve(b);
  const SmoothedMotion found = rauch_tung_striebel(y, kSample, c);
  // The filter begins with a wide but not endless covariance, which the first samples show.
  for (std::size_t k = 40; k < n; ++k) {
    const auto at = static_cast<Eigen::Index>(3 * k);
    EXPECT_NEAR(found.position[k], x[at], 2e-5) << k;
    EXPECT_NEAR(found.velocity[k], x[at + 1] / t, 1e-2 * found.velocity_std + 1e-3) << k;
    EXPECT_NEAR(found.acceleration[k], x[at + 2] / (t * t), 2e-2 * found.acceleration_std) << k;
  }
}

TEST(KalmanSmoother, FindsTheCovariancesOfAMotionDrawnFromThem) {
  for (const MotionCovariances truth : {MotionCovariances{1e-6, 4e3}, MotionCovariances{1e-8, 1e5}}) {
    const Drawn d = drawn(truth, 30000, 7);
    const MotionCovariances found = most_likely_covariances(d.position, kSample, 0.0);
    EXPECT_NEAR(found.position_variance / truth.position_variance, 1.0, 0.05);
    EXPECT_NEAR(std::log(found.jerk_density / truth.jerk_density), 0.0, 0.25);
    const SmoothedMotion s = rauch_tung_striebel(d.position, kSample, truth);
    EXPECT_NEAR(rms_difference(s.velocity, d.velocity, 500) / s.velocity_std, 1.0, 0.1);
    EXPECT_NEAR(rms_difference(s.acceleration, d.acceleration, 500) / s.acceleration_std, 1.0, 0.1);
  }
}

TEST(KalmanSmoother, DoesNotShiftASineAndLeavesLittleOfTheEncodersSteps) {
  const double step = 2.0 * kPi / 4000.0, w = 4.0 * kPi;
  std::vector<double> y, velocity, late;
  for (int k = 0; k < 20000; ++k) {
    const double t = kSample * k;
    y.push_back(step * std::round(5.0 * std::sin(w * t) / step));
    velocity.push_back(5.0 * w * std::cos(w * t));
  }
  const MotionCovariances c = most_likely_covariances(y, kSample, step * step / 12.0);
  EXPECT_NEAR(c.position_variance, step * step / 12.0, 0.1 * step * step);
  const SmoothedMotion s = rauch_tung_striebel(y, kSample, c);
  EXPECT_LT(rms_difference(s.velocity, velocity, 1000), 1e-3 * 5.0 * w);
  EXPECT_NEAR(rms_difference(s.velocity, velocity, 1000),
              smoother_noise(kSample, c).velocity * std::sqrt(c.position_variance), 0.3 * s.velocity_std);
}

// An encoder that stays at one step shows no noise; the least variance keeps it from being taken for exact.
TEST(KalmanSmoother, AnEncoderAtStandstillIsNoBetterThanItsStep) {
  const std::vector<double> y(2000, 1.25);
  const MotionCovariances c = most_likely_covariances(y, kSample, 1e-7);
  EXPECT_EQ(c.position_variance, 1e-7);
  const SmoothedMotion s = rauch_tung_striebel(y, kSample, c);
  EXPECT_EQ(s.position[1000], 1.25);
  EXPECT_EQ(s.velocity[1000], 0.0);
}

TEST(KalmanSmoother, RefusesWhatItCannotSmooth) {
  const std::vector<double> two(2, 0.0), ten(10, 0.0);
  EXPECT_THROW(rauch_tung_striebel(two, kSample, {1e-6, 1.0}), std::invalid_argument);
  EXPECT_THROW(most_likely_covariances(ten, kSample, 1e-7), std::invalid_argument);
  EXPECT_THROW(rauch_tung_striebel(ten, 0.0, {1e-6, 1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::signals::signals_kalman_smoother_test
