// Section 1.3.4 of the report, equations 20 to 24: which way to a derivative does what, in numbers.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "hil/thesis_models/friction_block.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/runge_kutta.hpp"
#include "host/common/signals/differentiators.hpp"

namespace flexspline::differentiation_test {
namespace {

using signals::Derivatives;
using signals::DifferentiatingFilter;
using signals::Differentiator;
using std::numbers::pi;

constexpr double kSample = report::published::kSampleS;

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

// Equation 21 under three sines, in its steady state: M y'' + B y' + K y = u.
struct SecondOrder {
  double mass = 0.5, damping = 4.0, stiffness = 60.0;
  std::vector<double> y, u;
  double peak = 0.0;

  explicit SecondOrder(std::size_t n, double noise_share = 0.0, std::uint64_t seed = 7001) : y(n, 0.0), u(n, 0.0) {
    for (std::size_t k = 0; k < n; ++k)
      for (const auto& [hz, phase] : {std::pair{0.4, 0.0}, std::pair{1.3, 1.0}, std::pair{3.1, 2.0}}) {
        const double w = 2.0 * pi * hz, angle = w * kSample * static_cast<double>(k) + phase;
        const std::complex<double> plant(stiffness - mass * w * w, damping * w);
        u[k] += std::sin(angle);
        y[k] += std::sin(angle - std::arg(plant)) / std::abs(plant);
      }
    for (const double x : y) peak = std::max(peak, std::abs(x));
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, noise_share * peak);
    if (noise_share > 0.0)
      for (double& x : y) x += noise(random);
  }
};

// Mass, damping and stiffness by equation 23 (with H1 its middle term has sqrt(2) in place of 2), after the first
// second.
Eigen::Vector3d by_equation_23(const SecondOrder& system, Differentiator method, double twice_damping, double hz) {
  const DifferentiatingFilter filter(method, hz, kSample);
  const Derivatives y = filter.apply(system.y), u = filter.apply(system.u);
  const double w0 = 2.0 * pi * hz;
  const auto rows = static_cast<Eigen::Index>(system.y.size()) - 1000;
  Eigen::MatrixXd A(rows, 3);
  Eigen::VectorXd b(rows);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const auto k = static_cast<std::size_t>(r) + 1000;
    A(r, 0) = w0 * w0 * system.y[k] - twice_damping * w0 * y.velocity[k] - w0 * w0 * y.position[k];
    A(r, 1) = y.velocity[k];
    A(r, 2) = y.position[k];
    b[r] = u.position[k];
  }
  return least_squares(A, b);
}

// Likewise from the derivatives that a method gives, all of the same filter.
Eigen::Vector3d by_derivatives(const SecondOrder& system, Differentiator method, double hz) {
  const DifferentiatingFilter filter(method, hz, kSample);
  const Derivatives y = filter.apply(system.y), u = filter.apply(system.u);
  const auto rows = static_cast<Eigen::Index>(system.y.size()) - 2000;
  Eigen::MatrixXd A(rows, 3);
  Eigen::VectorXd b(rows);
  for (Eigen::Index r = 0; r < rows; ++r) {
    const auto k = static_cast<std::size_t>(r) + 1000;
    A.row(r) << y.acceleration[k], y.velocity[k], y.position[k];
    b[r] = u.position[k];
  }
  return least_squares(A, b);
}

double largest_error(const SecondOrder& s, const Eigen::Vector3d& found) {
  return std::max({std::abs(found[0] / s.mass - 1.0), std::abs(found[1] / s.damping - 1.0),
                   std::abs(found[2] / s.stiffness - 1.0)});
}

TEST(Equation20, TheBilinearRuleHasTheRightPhaseAtEveryFrequencyAndAGainThatGrowsTooFast) {
  const DifferentiatingFilter filter(Differentiator::bilinear, 0.0, kSample);
  for (const double hz : {1.0, 50.0, 250.0, 450.0}) {
    EXPECT_NEAR(std::arg(filter.response(1, hz)), 0.5 * pi, 1e-12);
    EXPECT_NEAR(filter.gain_error(1, hz), std::tan(pi * hz * kSample) / (pi * hz * kSample) - 1.0, 1e-12);
  }
  EXPECT_NEAR(filter.gain_error(1, 250.0), 4.0 / pi - 1.0, 1e-12);  // 27 % at a quarter of the sample rate
}

TEST(Equation20, WithoutAFilterNoiseIsMagnifiedAndByTheBilinearRuleWithoutBound) {
  // An encoder of 4000 counts a turn, and the rated 180 rad/s.
  const double noise = 2.0 * pi / 4000.0 / std::sqrt(12.0);
  const auto velocity_noise = [&](Differentiator which) {
    return noise * DifferentiatingFilter(which, 20.0, kSample).noise_gain(1);
  };
  EXPECT_NEAR(velocity_noise(Differentiator::backward), 0.641, 0.001);
  EXPECT_TRUE(std::isinf(velocity_noise(Differentiator::bilinear)));
  EXPECT_TRUE(std::isinf(velocity_noise(Differentiator::bilinear_prewarped)));
  // At 20 Hz H1 leaves 1/56 of it, H2 1/67, and the zero-phase filter, without their delay, 1/108.
  const double backward = velocity_noise(Differentiator::backward);
  for (const Differentiator which : {Differentiator::h1_bilinear, Differentiator::h1_matched,
                                     Differentiator::h2_bilinear, Differentiator::h2_matched})
    EXPECT_GT(backward / velocity_noise(which), 50.0);
  EXPECT_GT(backward / velocity_noise(Differentiator::butterworth), 100.0);
}

TEST(Equation21, SecondDifferencesOfANoisyPositionFindNoMass) {
  // "This is not an appropriate method in presence of noise": half a percent of the peak, as in section 3.5.
  const SecondOrder clean(20000), noisy(20000, 0.005);
  EXPECT_LT(largest_error(clean, by_derivatives(clean, Differentiator::backward, 0.0)), 0.02);
  const Eigen::Vector3d found = by_derivatives(noisy, Differentiator::backward, 0.0);
  EXPECT_LT(std::abs(found[0]), 0.01 * noisy.mass);
  EXPECT_LT(std::abs(found[1]), 0.6 * noisy.damping);
}

TEST(Equation22, BothFiltersAreOneAtStandstillAndLateByAQuarterTurnAtTheCutOff) {
  // At a thousandth of the sample rate the discrete filters are the analog ones to (w0 T)^2 / 12.
  const double hz = 1.0, s = 1e-4;
  const DifferentiatingFilter h1(Differentiator::h1_bilinear, hz, s), h2(Differentiator::h2_bilinear, hz, s);
  EXPECT_NEAR(std::abs(h1.response(0, 0.0)), 1.0, 1e-8);
  EXPECT_NEAR(std::abs(h2.response(0, 0.0)), 1.0, 1e-8);
  EXPECT_NEAR(std::abs(h1.response(0, hz)), std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(std::abs(h2.response(0, hz)), 0.5, 1e-6);
  EXPECT_NEAR(std::arg(h1.response(0, hz)), -0.5 * pi, 1e-6);
  EXPECT_NEAR(std::arg(h2.response(0, hz)), -0.5 * pi, 1e-6);
  // Both fall by a hundred in a decade.
  for (const DifferentiatingFilter* h : {&h1, &h2}) EXPECT_NEAR(std::abs(h->response(0, 100.0 * hz)) * 1e4, 1.0, 0.01);
}

TEST(Equation22, OfSecondOrderIsJustEnoughForAnAcceleration) {
  // s^2 H tends to w0^2 at high frequency: proper, but what is there is not damped any more.
  const double w0 = 2.0 * pi * 20.0;
  for (const Differentiator which : {Differentiator::h1_bilinear, Differentiator::h2_bilinear}) {
    const DifferentiatingFilter filter(which, 20.0, kSample);
    EXPECT_NEAR(std::abs(filter.response(2, 0.499999 / kSample)) / (w0 * w0), 1.0, 1e-3);
    EXPECT_NEAR(std::abs(filter.response(1, 0.499999 / kSample)), 0.0, 1e-1);
  }
}

TEST(Equation23, HoldsForTheBilinearFiltersToRoundingOnAnySignal) {
  // w0^2 (y - y_f) - 2 w0 y_fd is the filtered acceleration (with H1: sqrt(2) w0 y_fd).
  std::mt19937_64 random(7002);
  std::normal_distribution<double> normal;
  std::vector<double> y(500);
  for (double& x : y) x = normal(random);
  for (const auto& [which, twice_damping] :
       {std::pair{Differentiator::h2_bilinear, 2.0}, std::pair{Differentiator::h1_bilinear, std::sqrt(2.0)},
        std::pair{Differentiator::h2_backward, 2.0}, std::pair{Differentiator::h1_backward, std::sqrt(2.0)}}) {
    const double w0 = 2.0 * pi * 15.0;
    const Derivatives d = DifferentiatingFilter(which, 15.0, kSample).apply(y);
    for (std::size_t k = 0; k < y.size(); ++k)
      ASSERT_NEAR(w0 * w0 * (y[k] - d.position[k]) - twice_damping * w0 * d.velocity[k], d.acceleration[k], 1e-6);
  }
}

TEST(Equation23, FindsMassDampingAndStiffness) {
  const SecondOrder clean(20000);
  EXPECT_LT(largest_error(clean, by_equation_23(clean, Differentiator::h2_bilinear, 2.0, 5.0)), 1e-3);
  EXPECT_LT(largest_error(clean, by_equation_23(clean, Differentiator::h1_bilinear, std::sqrt(2.0), 5.0)), 1e-3);
}

TEST(Equation23, StillFindsThemWhereSecondDifferencesFail) {
  double worst_filtered = 0.0, best_naive = 1.0;
  for (std::uint64_t seed = 7001; seed < 7006; ++seed) {
    const SecondOrder noisy(20000, 0.005, seed);
    worst_filtered =
        std::max(worst_filtered, largest_error(noisy, by_equation_23(noisy, Differentiator::h2_bilinear, 2.0, 5.0)));
    best_naive = std::min(best_naive, largest_error(noisy, by_derivatives(noisy, Differentiator::backward, 0.0)));
  }
  EXPECT_LT(worst_filtered, 0.05);
  EXPECT_GT(best_naive, 0.9);
}

TEST(Equation24, TheFilteredDerivativeIsTheDerivativeOfTheFilteredSignal) {
  for (const Differentiator which : {Differentiator::h1_bilinear, Differentiator::h2_bilinear}) {
    const DifferentiatingFilter filter(which, 20.0, kSample), plain(Differentiator::bilinear, 20.0, kSample);
    for (const double hz : {1.0, 20.0, 200.0})
      EXPECT_LT(std::abs(filter.response(1, hz) - plain.response(1, hz) * filter.response(0, hz)),
                1e-9 * std::abs(filter.response(1, hz)));
  }
}

TEST(Section134, ThereIsAlwaysAPhaseDistortionExceptForwardAndBackward) {
  // At half the cut-off: degrees by which each velocity comes late.
  const auto lag_deg = [](Differentiator which) {
    const DifferentiatingFilter filter(which, 20.0, kSample);
    return 90.0 - std::arg(filter.response(1, 10.0)) * 180.0 / pi;
  };
  EXPECT_NEAR(lag_deg(Differentiator::h1_bilinear), 43.3, 0.2);  // atan(sqrt(2) 0.5 / 0.75)
  EXPECT_NEAR(lag_deg(Differentiator::h2_bilinear), 53.1, 0.2);  // 2 atan(0.5)
  EXPECT_NEAR(lag_deg(Differentiator::backward), 1.8, 1e-9);     // half a sample
  EXPECT_NEAR(lag_deg(Differentiator::butterworth), 0.0, 1e-9);
}

TEST(Footnote1, TheFifthOrderFilterForwardAndBackwardPassesASineWithoutShiftAndSquaredGain) {
  const DifferentiatingFilter filter(Differentiator::butterworth, 20.0, kSample);
  for (const double hz : {2.0, 10.0, 20.0}) {
    const std::complex<double> g = filter.response(0, hz);
    const double r = std::tan(pi * hz * kSample) / std::tan(pi * 20.0 * kSample);
    EXPECT_NEAR(g.real(), 1.0 / (1.0 + std::pow(r, 10.0)), 1e-9);
    EXPECT_EQ(g.imag(), 0.0);
  }
}

// The motor of table 3 under the composite current of equation 60, its angle read by an encoder.
struct Turned {
  std::vector<double> angle, velocity, current;
};
Turned turned_motor(double seconds) {
  report::DcMotor motor = report::published::identified_motor();
  const auto friction = report::make_friction_block(report::FrictionMethod::boundary_layer,
                                                    {motor.inertia, {motor.friction}}, kSample / 16.0);
  Turned t;
  std::array<double, 2> y{0.0, 0.0};
  const double count = 2.0 * pi / 4000.0;
  for (int k = 0; k < static_cast<int>(seconds / kSample); ++k) {
    const double now = 3.0 * k * kSample;
    const double current = 0.35 * (std::cos(now) + 0.5 * std::sin(2.0 * now) + std::sin(3.0 * now));
    t.angle.push_back(count * std::round(y[0] / count));
    t.velocity.push_back(y[1]);
    t.current.push_back(current);
    const auto rate = [&](double, const std::array<double, 2>& state) {
      const double driving = motor.driving_torque(current, 0.0);
      return std::array{state[1], motor.acceleration(current, 0.0, friction->torque(state[1], driving))};
    };
    for (int step = 0; step < 16; ++step) y = report::rk4_step(rate, 0.0, y, kSample / 16.0);
  }
  return t;
}

// Equation 51 with the inertia given: Km i - Tv v - Ts sign(v) = J a, with the current filtered as the position is, or
// raw. The largest relative error of Km, Tv and both Ts.
double motor_error(const Turned& t, Differentiator method, double hz, bool filter_current) {
  const DifferentiatingFilter filter(method, hz, kSample);
  const Derivatives d = filter.apply(t.angle);
  // The current is held from sample to sample; half a sample earlier it stands where positions are read.
  std::vector<double> current = t.current;
  for (std::size_t k = current.size(); k-- > 1;) current[k] = 0.5 * (t.current[k] + t.current[k - 1]);
  const std::vector<double> i = filter_current ? filter.apply(current).position : current;
  // Around reversals and where the shaft sticks friction is not Ts sign(v), whatever the method.
  std::vector<std::size_t> rows;
  for (std::size_t k = 1000; k + 1000 < t.angle.size(); ++k) {
    bool moves = true;
    for (std::size_t j = k - 60; moves && j <= k + 60; ++j) moves = t.velocity[j] * t.velocity[k] > 0.0;
    if (moves && std::abs(t.velocity[k]) > 2.0) rows.push_back(k);
  }
  Eigen::MatrixXd A(static_cast<Eigen::Index>(rows.size()), 4);
  Eigen::VectorXd b(A.rows());
  const report::DcMotor motor = report::published::identified_motor();
  for (Eigen::Index r = 0; r < A.rows(); ++r) {
    const std::size_t k = rows[static_cast<std::size_t>(r)];
    A.row(r) << i[k], -d.velocity[k], -(d.velocity[k] > 0.0 ? 1.0 : 0.0), d.velocity[k] < 0.0 ? 1.0 : 0.0;
    b[r] = motor.inertia * d.acceleration[k];
  }
  const Eigen::VectorXd found = least_squares(A, b);
  return std::max({std::abs(found[0] / motor.torque_constant - 1.0), std::abs(found[1] / 4.2e-5 - 1.0),
                   std::abs(found[2] / 1.1e-2 - 1.0), std::abs(found[3] / 1.0e-2 - 1.0)});
}

TEST(Section134, OnAMotorWithDryFrictionEveryFilterHelpsIfTheCurrentGoesThroughItToo) {
  const Turned t = turned_motor(20.0);
  EXPECT_GT(motor_error(t, Differentiator::backward, 0.0, true), 0.5);
  for (const Differentiator which : {Differentiator::h1_bilinear, Differentiator::h2_bilinear,
                                     Differentiator::h2_matched, Differentiator::butterworth})
    EXPECT_LT(motor_error(t, which, 20.0, true), 0.01) << signals::info_of(which).name;
}

TEST(Section134, OnlyTheZeroPhaseFilterMayStandBesideASignalThatIsNotFiltered) {
  const Turned t = turned_motor(20.0);
  const double h1 = motor_error(t, Differentiator::h1_bilinear, 20.0, false);
  const double h2 = motor_error(t, Differentiator::h2_bilinear, 20.0, false);
  const double zero_phase = motor_error(t, Differentiator::butterworth, 20.0, false);
  EXPECT_LT(zero_phase, 0.01);
  EXPECT_GT(h1, 10.0 * zero_phase);
  EXPECT_GT(h2, 10.0 * zero_phase);
}

}  // namespace
}  // namespace flexspline::differentiation_test
