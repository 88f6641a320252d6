// The encoder's Kalman filter: its gains against three solutions of their own, its numbers against double, its bounds
// against the worst readings there are, and what it makes of motions of which everything is known.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <random>
#include <vector>

#include "host/common/numbers/real.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/observers/encoder_kalman.hpp"

namespace flexspline::tests::observers_kalman_test {
namespace {

using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;
using observers::EncoderKalman;
using observers::KalmanGains;

constexpr double kCounts = 4096.0;
constexpr double kTickS = 1.0 / 16000.0;

effects::DriveConstants<double> drive(double tick_s = kTickS) {
  effects::DriveConstants<double> d;
  d.velocity_base = d.rated_velocity = 200.0;
  d.acceleration_base = 4000.0;
  d.angle_base = kTurn;
  d.time_base = tick_s;
  return d;
}
template <class N>
EncoderKalman::Coefficients<N> filter(double corner_hz, const effects::DriveConstants<double>& d = drive()) {
  return EncoderKalman::derive<N>(observers::setup_for_corner(kCounts, kTurn * corner_hz, d), d);
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
double real(fixed::State x) {
  return std::ldexp(static_cast<double>(x.raw), -fixed::kStateBits);
}
// Where the shaft stands in turns, as a drive counts it, and as the encoder shows it.
fixed::Angle fine(double turns) {
  return {std::llround(std::ldexp(turns, fixed::kAngleBits))};
}
fixed::Angle counted(double turns) {
  return fine(std::floor(turns * kCounts) / kCounts);
}
double turns_of(fixed::Angle angle) {
  return std::ldexp(static_cast<double>(angle.raw), -fixed::kAngleBits);
}

// The filter's equations step by step in SI units, until nothing changes: not scaled, not doubled.
std::array<long double, 3> gains_by_recursion(long double tick_s, long double jerk_density, long double variance) {
  using Matrix = Eigen::Matrix<long double, 3, 3>;
  const long double t = tick_s;
  Matrix a, q;
  a << 1, t, t * t / 2, 0, 1, t, 0, 0, 1;
  q << powl(t, 5) / 20, powl(t, 4) / 8, powl(t, 3) / 6, powl(t, 4) / 8, powl(t, 3) / 3, t * t / 2, powl(t, 3) / 6,
      t * t / 2, t;
  Matrix p = Matrix::Zero();
  p.diagonal() << variance, variance / (t * t), variance / powl(t, 4);
  Eigen::Matrix<long double, 3, 1> gain;
  for (int k = 0; k < 20'000; ++k) {
    gain = p.col(0) / (p(0, 0) + variance);
    const Matrix after = p - gain * p.row(0);
    p = a * (after + after.transpose()) * a.transpose() / 2 + jerk_density * q;
  }
  return {gain[0], gain[1], gain[2]};
}

TEST(EncoderKalman, GainsAreThoseOfTheRiccatiRecursionInSiUnits) {
  for (const double corner_tick : {0.01, 0.05, 0.3, 1.0}) {
    const double w = corner_tick / kTickS;
    const double variance = std::pow(kTurn / kCounts, 2) / 12.0;
    const auto expected =
        gains_by_recursion(kTickS, kTickS * variance * std::pow(w, 6), static_cast<long double>(variance));
    const KalmanGains<double> g = observers::kalman_gains(corner_tick);
    EXPECT_NEAR(g.position / static_cast<double>(expected[0]), 1.0, 1e-11) << corner_tick;
    EXPECT_NEAR(g.velocity * w / static_cast<double>(expected[1]), 1.0, 1e-11) << corner_tick;
    EXPECT_NEAR(g.acceleration * w * w / static_cast<double>(expected[2]), 1.0, 1e-11) << corner_tick;
  }
}

// The stable half of the symplectic matrix' eigenvectors.
TEST(EncoderKalman, TheCovarianceIsThatOfTheSymplecticEigenvectors) {
  for (const double h : {0.1, 0.5, 1.0}) {
    Eigen::Matrix3d a, q, g = Eigen::Matrix3d::Zero();
    a << 1, h, h * h / 2, 0, 1, h, 0, 0, 1;
    q << std::pow(h, 6) / 20, std::pow(h, 5) / 8, std::pow(h, 4) / 6, std::pow(h, 5) / 8, std::pow(h, 4) / 3,
        std::pow(h, 3) / 2, std::pow(h, 4) / 6, std::pow(h, 3) / 2, h * h;
    g(0, 0) = 1.0;
    observers::Matrix3<double> model{}, noise{};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        model[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = a(i, j);
        noise[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = q(i, j);
      }
    }
    const Eigen::Matrix3d f = a.transpose(), back = a.inverse();  // back: f to the minus one, transposed
    Eigen::Matrix<double, 6, 6> z;
    z << f + g * back * q, -g * back, -back * q, back;
    const Eigen::EigenSolver<Eigen::Matrix<double, 6, 6>> eigen(z);
    Eigen::Matrix<std::complex<double>, 6, 3> stable;
    int found = 0;
    for (int k = 0; k < 6 && found < 3; ++k)
      if (std::abs(eigen.eigenvalues()[k]) < 1.0) stable.col(found++) = eigen.eigenvectors().col(k);
    ASSERT_EQ(found, 3);
    const Eigen::Matrix3d expected = (stable.bottomRows<3>() * stable.topRows<3>().inverse()).real();
    const auto p = observers::steady_covariance(model, noise, 1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(p[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] / expected(i, j), 1.0, 1e-9) << h;
  }
}

// Kalata's alpha-beta-gamma filter: acceleration changes by a random step at each tick.
TEST(EncoderKalman, ItsSolverGivesKalatasClosedFormOfTheTrackingIndex) {
  const observers::Matrix3<double> model{{{1.0, 1.0, 0.5}, {0.0, 1.0, 1.0}, {0.0, 0.0, 1.0}}};
  for (const double index : {1e-5, 1e-3, 0.1, 1.0, 10.0}) {
    const std::array<double, 3> step{0.5 * index, index, index};
    observers::Matrix3<double> noise{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) noise[i][j] = step[i] * step[j];
    const auto gain = observers::steady_gain(observers::steady_covariance(model, noise, 1.0), 1.0);
    const double alpha = gain[0];
    const double beta = 2.0 * (2.0 - alpha) - 4.0 * std::sqrt(1.0 - alpha);
    EXPECT_NEAR(gain[1] / beta, 1.0, 1e-8) << index;
    EXPECT_NEAR(gain[2] / (beta * beta / (2.0 * alpha)), 1.0, 1e-8) << index;
    EXPECT_NEAR(gain[2] / std::sqrt(1.0 - alpha) / index, 1.0, 1e-8) << index;
  }
}

TEST(EncoderKalman, CornerAndJerkDensityAreTwoNamesOfOneSetup) {
  const auto d = drive();
  const double corner = kTurn * 25.0;
  const auto setup = observers::setup_for_corner(kCounts, corner, d);
  // sigma^2 = q^2/12, S = T sigma^2 w^6
  EXPECT_NEAR(setup.jerk_density / (kTickS * std::pow(kTurn / kCounts, 2) / 12.0 * std::pow(corner, 6)), 1.0, 1e-12);
  // Shares count in 2^-31, the tick in twice that.
  EXPECT_NEAR((EncoderKalman::derive<Real>(setup, d).tick) / (corner * kTickS), 1.0, 0x1p-31 / (corner * kTickS));
}

TEST(EncoderKalman, ACornerAboveOneRadianATickIsFound) {
  OverflowLog::clear();
  filter<Fixed>(0.99 / kTickS / kTurn);
  EXPECT_EQ(OverflowLog::count(), 0);
  filter<Fixed>(1.01 / kTickS / kTurn);
  EXPECT_GT(OverflowLog::count(), 0);
}

// Turns at time t of a motion that has everything: fast, slow, at rest, reversals.
double motion(double t) {
  return 30.0 * std::sin(0.9 * t) + 0.4 * std::sin(23.0 * t) + 0.003 * std::sin(300.0 * t);
}

TEST(EncoderKalman, OnADriveAgreesWithDoubleForAHundredThousandTicks) {
  for (const double corner_hz : {0.5, 5.0, 50.0, 500.0, 2500.0}) {
    const auto c = filter<Fixed>(corner_hz);
    const auto c_checked = filter<Checked>(corner_hz);
    const auto c_real = filter<Real>(corner_hz);
    EncoderKalman::State<Fixed> s;
    EncoderKalman::State<Checked> s_checked;
    EncoderKalman::State<Real> s_real;
    OverflowLog::clear();
    double worst_velocity = 0.0, worst_acceleration = 0.0, largest = 0.0;
    for (int k = 0; k < 100'000; ++k) {
      const fixed::Angle reading = counted(motion(k * kTickS));
      const auto now = EncoderKalman::update<Fixed>(s, c, reading);
      const auto checked = EncoderKalman::update<Checked>(s_checked, c_checked, reading);
      const auto exact = EncoderKalman::update<Real>(s_real, c_real, turns_of(reading));
      ASSERT_EQ(now.velocity.raw, checked.velocity.raw);
      ASSERT_EQ(now.acceleration.raw, checked.acceleration.raw);
      worst_velocity = std::max(worst_velocity, std::abs(real(now.velocity) - exact.velocity));
      if (std::abs(exact.acceleration) < 15.0)
        worst_acceleration = std::max(worst_acceleration, std::abs(real(now.acceleration) - exact.acceleration));
      largest = std::max(largest, std::abs(exact.velocity));
    }
    EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
    EXPECT_GT(largest, 0.5);
    EXPECT_LT(worst_velocity, 1e-8) << corner_hz;
    // Half a unit of the state's signal, scaled by w v_base/a_base, and half a unit of the result.
    EXPECT_LT(worst_acceleration, 1e-8 * (1.0 + kTurn * corner_hz * 200.0 / 4000.0)) << corner_hz;
    EXPECT_GT(worst_velocity, 0.0);
  }
}

TEST(EncoderKalman, ReachesTheBoundOfItsVelocityAndNeverPassesIt) {
  for (const double corner_tick : {0.01, 0.1, 1.0}) {
    const KalmanGains<double> g = observers::kalman_gains(corner_tick);
    const observers::KalmanBounds bounds = observers::kalman_bounds(g);
    ASSERT_TRUE(bounds.fit);
    effects::DriveConstants<double> d = drive();
    // A base of 2^17 units of angle a tick, so that two bases a tick are a whole number of them.
    const std::int64_t base = std::int64_t{1} << 17;
    d.velocity_base = kTurn * std::ldexp(1.0, 17 - 32) / kTickS;
    const auto c = EncoderKalman::coefficients<Checked>(g, d);
    const auto c_real = EncoderKalman::coefficients<Real>(g, d);
    std::vector<double> response;
    EncoderKalman::State<Real> impulse;
    EncoderKalman::update<Real>(impulse, c_real, 0.0);
    const int ticks = static_cast<int>(40.0 / corner_tick);
    for (int k = 0; k < ticks; ++k)
      response.push_back(EncoderKalman::update<Real>(impulse, c_real, std::ldexp(1.0, 17 - 32)).velocity);
    EncoderKalman::State<Checked> s;
    fixed::Angle reading{};
    EncoderKalman::update<Checked>(s, c, reading);
    OverflowLog::clear();
    double largest = 0.0;
    for (int k = ticks; k-- > 0;) {
      // Ten times the envelope: it is limited at entry.
      reading.raw += response[static_cast<std::size_t>(k)] > 0.0 ? 20 * base : -20 * base;
      EncoderKalman::update<Checked>(s, c, reading);
      largest = std::max(largest, std::abs(real(s.velocity)));
      ASSERT_LE(std::abs(real(s.velocity)), bounds.velocity);
      ASSERT_LE(std::abs(real(s.acceleration)), bounds.acceleration);
      ASSERT_LE(std::abs(real(s.position_error)), bounds.innovation);
    }
    EXPECT_GT(largest, 0.9999 * bounds.velocity) << corner_tick;
    EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  }
}

// The bound depends on the corner times the tick alone, so this is all setups there are.
TEST(EncoderKalman, EveryFilterThatCanBeMadeKeepsWithinItsStates) {
  for (double h = 1e-4; h <= 1.0; h *= 1.3) EXPECT_TRUE(observers::kalman_bounds(observers::kalman_gains(h)).fit) << h;
  EXPECT_TRUE(observers::kalman_bounds(observers::kalman_gains(1.0)).fit);
  KalmanGains<double> wild = observers::kalman_gains(0.1);
  wild.acceleration *= 20.0;  // an unstable filter: the bound is not there for show
  EXPECT_FALSE(observers::kalman_bounds(wild).fit);
}

TEST(EncoderKalman, ConstantVelocityAndARampComeOutWithoutAnyLag) {
  const auto c = filter<Fixed>(20.0);
  for (const double acceleration : {0.0, 3.0, -3.0}) {  // turns/s^2
    EncoderKalman::State<Fixed> s;
    EncoderKalman::Estimate<Fixed> now;
    const double start = 5.0;  // turns/s
    double t = 0.0;
    for (int k = 0; k < 16'000; ++k) {
      t = k * kTickS;
      now = EncoderKalman::update<Fixed>(s, c, fine((start + 0.5 * acceleration * t) * t));
    }
    EXPECT_NEAR(real(now.velocity), kTurn * (start + acceleration * t) / 200.0, 2e-8) << acceleration;
    EXPECT_NEAR(real(now.acceleration), kTurn * acceleration / 4000.0, 1e-6) << acceleration;
  }
}

// A ten-thousandth of a count a tick, in readings as fine as the drive's angle.
TEST(EncoderKalman, AMillionthOfRatedSpeedComesOutToAPartInAThousand) {
  const auto c = filter<Fixed>(5.0);
  EncoderKalman::State<Fixed> s;
  const double rated_units = 200.0 / kTurn * kTickS * std::ldexp(1.0, 32);  // of angle, a tick
  double sum = 0.0;
  const int settled = 20'000, ticks = 100'000;
  for (int k = 0; k < settled + ticks; ++k) {
    const fixed::Angle reading{static_cast<std::int64_t>(std::floor(1e-6 * rated_units * k))};
    EncoderKalman::update<Fixed>(s, c, reading);
    if (k >= settled) sum += real(s.velocity);
    if (k >= settled) {
      ASSERT_NEAR(real(s.velocity), 1e-6, 1e-9);
    }
  }
  EXPECT_NEAR(sum / ticks, 1e-6, 1e-11);
}

// One count every eight seconds: what the velocity adds up to is where the encoder is.
TEST(EncoderKalman, LosesNoCountAtAMillionthOfRatedSpeed) {
  const double tick_s = 1e-3;
  const auto d = drive(tick_s);
  const auto c = filter<Fixed>(5.0, d);
  EncoderKalman::State<Fixed> s;
  const double count_bases = kTurn / kCounts / (200.0 * tick_s);  // travel in bases times ticks
  double travelled = 0.0;
  int counts = 0;
  for (int k = 0; k < 200'000; ++k) {
    const double turns = 200e-6 / kTurn * tick_s * k;
    counts = static_cast<int>(std::floor(turns * kCounts));
    EncoderKalman::update<Fixed>(s, c, counted(turns));
    travelled += real(s.velocity);
  }
  EXPECT_EQ(counts, 26);
  EXPECT_NEAR(travelled / count_bases, 26.0, 1e-3);
}

TEST(EncoderKalman, DoesNotSeeTheWrapOfTheAngle) {
  const auto c = filter<Fixed>(50.0);
  EncoderKalman::State<Fixed> plain, wrapped;
  const std::uint64_t near_the_end = (std::uint64_t{1} << 63) - 5'000'000'000;
  double largest = 0.0;
  for (std::uint64_t k = 0; k < 2000; ++k) {
    const std::uint64_t at = k * 7'000'000;
    const auto now = EncoderKalman::update<Fixed>(plain, c, {static_cast<std::int64_t>(at)});
    const auto over = EncoderKalman::update<Fixed>(wrapped, c, {static_cast<std::int64_t>(near_the_end + at)});
    ASSERT_EQ(now.velocity.raw, over.velocity.raw);
    ASSERT_EQ(now.acceleration.raw, over.acceleration.raw);
    largest = std::max(largest, real(now.velocity));
  }
  EXPECT_GT(largest, 0.8);
}

}  // namespace
}  // namespace flexspline::tests::observers_kalman_test
