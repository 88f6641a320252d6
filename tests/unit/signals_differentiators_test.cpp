// Derivatives by every method of the table: against closed forms, against sines sent through them, and against each
// method's definition in continuous time.
#include "host/common/signals/differentiators.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <set>
#include <string>

namespace flexspline::signals::signals_differentiators_test {
namespace {

using std::numbers::pi;

constexpr double kSample = 1e-3;
constexpr double kCutoff = 20.0;
constexpr double kW0 = 2.0 * pi * kCutoff;

DifferentiatingFilter filter_of(Differentiator which) {
  return {which, kCutoff, kSample};
}
bool leaks(const DifferentiatorInfo& info) {
  return info.filter != AnalogFilter::none && info.discretisation == Discretisation::impulse_invariant;
}
int highest_order(const DifferentiatorInfo& info) {
  return info.gives_acceleration ? 2 : 1;
}

// Amplitude and phase that a filter gives a sine, from the second half of a long record of whole periods.
std::complex<double> seen_response(const DifferentiatingFilter& filter, int order, int periods_per_second) {
  const std::size_t n = 8000;
  std::vector<double> sine(n);
  for (std::size_t k = 0; k < n; ++k)
    sine[k] = std::sin(2.0 * pi * periods_per_second * kSample * static_cast<double>(k));
  const Derivatives d = filter.apply(sine);
  const std::vector<double>& y = order == 0 ? d.position : order == 1 ? d.velocity : d.acceleration;
  std::complex<double> sum = 0.0;
  // 1000 samples are whole periods; the last ones are left to the end effects of the zero-phase filter.
  for (std::size_t k = 5000; k < 6000; ++k)
    sum += y[k] * std::polar(1.0, -2.0 * pi * periods_per_second * kSample * static_cast<double>(k));
  return sum * std::complex<double>(0.0, 1.0) / 500.0;
}

TEST(Differentiators, EachHasANameOfItsOwnThatLeadsBackToIt) {
  std::set<std::string_view> names;
  std::size_t place = 0;
  for (const DifferentiatorInfo& info : differentiators()) {
    EXPECT_EQ(static_cast<std::size_t>(info.which), place++) << info.name;
    EXPECT_EQ(differentiator_from_name(info.name), info.which);
    EXPECT_EQ(&info_of(info.which), &info);
    EXPECT_FALSE(info.explanation.empty());
    EXPECT_FALSE(info.source.empty());
    names.insert(info.name);
  }
  EXPECT_EQ(names.size(), 16u);
  EXPECT_EQ(differentiator_from_name("h3-bilinear"), std::nullopt);
}

class EachMethod : public testing::TestWithParam<DifferentiatorInfo> {};

TEST_P(EachMethod, DoesToASineWhatItsResponseSays) {
  const DifferentiatingFilter filter = filter_of(GetParam().which);
  for (int order = 0; order <= highest_order(GetParam()); ++order)
    for (const int hz : {1, 5, 20, 120}) {
      // The start of a sine sets the bilinear derivatives ringing at half the sample rate for ever, which is
      // orthogonal to the sine; in the second derivative that grows, and is not.
      if (order == 2 && std::isinf(filter.noise_gain(2))) continue;
      const std::complex<double> said = filter.response(order, hz), seen = seen_response(filter, order, hz);
      EXPECT_LT(std::abs(seen - said), 2e-3 * std::abs(said) + 1e-9)
          << "order " << order << " at " << hz << " Hz: " << seen << " instead of " << said;
    }
}

TEST_P(EachMethod, GivesAConstantVelocityFromTheFirstSample) {
  std::vector<double> line(400);
  for (std::size_t k = 0; k < line.size(); ++k) line[k] = 3.0 + 7.0 * kSample * static_cast<double>(k);
  const DifferentiatingFilter filter = filter_of(GetParam().which);
  const Derivatives d = filter.apply(line);
  ASSERT_EQ(d.velocity.size(), line.size());
  ASSERT_EQ(d.acceleration.size(), GetParam().gives_acceleration ? line.size() : 0u);
  if (leaks(GetParam())) {
    const double leak = filter.gain_at_standstill(1);
    for (std::size_t k = 1; k < line.size(); ++k)
      ASSERT_NEAR(d.velocity[k] - leak * line[k], d.velocity[0] - leak * line[0], 1e-9) << k;
    return;
  }
  const double gain = filter.gain_error(1, 1e-3) + 1.0;
  const bool at_ends = GetParam().which == Differentiator::butterworth;  // straight to 1e-6 only
  for (const double v : d.velocity) EXPECT_NEAR(v, 7.0 * gain, at_ends ? 1e-4 : 1e-7);
  for (const double a : d.acceleration) EXPECT_NEAR(a, 0.0, at_ends ? 0.1 : 1e-5);
}

TEST_P(EachMethod, LagsInAConstantAccelerationByItsGroupDelay) {
  std::vector<double> parabola(2000);
  for (std::size_t k = 0; k < parabola.size(); ++k) {
    const double t = kSample * static_cast<double>(k);
    parabola[k] = 0.5 * 11.0 * t * t;
  }
  const DifferentiatingFilter filter = filter_of(GetParam().which);
  const Derivatives d = filter.apply(parabola);
  if (std::isinf(filter.noise_gain(1))) {
    // The start sets it ringing; half of the ripple above, half below.
    const double middle = 0.5 * (d.velocity[1000] + d.velocity[999]);
    EXPECT_NEAR(middle, 11.0 * 0.9995 * (filter.gain_error(1, 1e-3) + 1.0), 1e-6);
    return;
  }
  if (leaks(GetParam())) {
    // The leak of the position is no velocity.
    EXPECT_GT(std::abs(d.velocity[1000] - 11.0), 0.1 * filter.gain_at_standstill(1) * parabola[1000]);
    return;
  }
  const std::size_t at = 1000;  // a second from either end: twenty periods of the cut-off
  const double gain = filter.gain_error(1, 1e-3) + 1.0;
  const double delay = filter.group_delay_samples(1, 1e-3);
  EXPECT_NEAR(d.velocity[at], 11.0 * gain * kSample * (static_cast<double>(at) - delay), 1e-6);
  EXPECT_NEAR(d.acceleration[at], 11.0 * (filter.gain_error(2, 1e-2) + 1.0), 1e-4);
}

TEST_P(EachMethod, KeepsOfWhiteNoiseWhatItsNoiseGainSays) {
  const DifferentiatingFilter filter = filter_of(GetParam().which);
  std::mt19937_64 random(17);
  std::normal_distribution<double> noise;
  std::vector<double> position(60000);
  for (double& x : position) x = noise(random);
  const Derivatives d = filter.apply(position);
  const auto rms = [](const std::vector<double>& x) {
    double mean = 0.0, squares = 0.0;
    const std::size_t from = 1000, to = x.size() - 1000;
    for (std::size_t k = from; k < to; ++k) mean += x[k] / static_cast<double>(to - from);
    for (std::size_t k = from; k < to; ++k) squares += (x[k] - mean) * (x[k] - mean);
    return std::sqrt(squares / static_cast<double>(to - from));
  };
  // The mean of a leaking or low-passed signal is taken out; the smallest band holds some 2000 independent samples.
  for (int order = 0; order <= highest_order(GetParam()); ++order) {
    const double gain = filter.noise_gain(order);
    const double seen = rms(order == 0 ? d.position : order == 1 ? d.velocity : d.acceleration);
    if (std::isinf(gain))
      EXPECT_GT(seen, 50.0 * std::pow(2.0 / kSample, order));  // a random walk of 60000 steps
    else
      EXPECT_NEAR(seen, gain, 0.06 * gain) << "order " << order;
  }
}

INSTANTIATE_TEST_SUITE_P(Differentiators, EachMethod,
                         testing::ValuesIn(differentiators().begin(), differentiators().end()), [](const auto& test) {
                           std::string name(test.param.name);
                           std::erase(name, '-');
                           return name;
                         });

TEST(Differentiators, TheBackwardDifferenceHasItsClosedForms) {
  const DifferentiatingFilter filter = filter_of(Differentiator::backward);
  EXPECT_NEAR(filter.noise_gain(1), std::sqrt(2.0) / kSample, 1e-9);
  EXPECT_NEAR(filter.noise_gain(2), std::sqrt(6.0) / (kSample * kSample), 1e-6);
  EXPECT_NEAR(filter.group_delay_samples(1, 50.0), 0.5, 1e-12);
  EXPECT_NEAR(filter.group_delay_samples(2, 50.0), 1.0, 1e-12);
  const double half = pi * 50.0 * kSample;
  EXPECT_NEAR(filter.gain_error(1, 50.0), std::sin(half) / half - 1.0, 1e-12);
  const Derivatives d = filter.apply(std::vector<double>{1.0, 1.5, 3.0, 3.0});
  const std::vector<double> expected{500.0, 500.0, 1500.0, 0.0};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(d.velocity[k], expected[k], 1e-9);
}

TEST(Differentiators, WithoutAFilterImpulseInvarianceAndMatchedZerosAreTheBackwardDifference) {
  const std::vector<double> position{1.0, 1.5, 3.0, 3.0, -2.0};
  const Derivatives plain = filter_of(Differentiator::backward).apply(position);
  for (const Differentiator which : {Differentiator::impulse_invariant, Differentiator::matched}) {
    const Derivatives d = filter_of(which).apply(position);
    EXPECT_EQ(d.velocity, plain.velocity);
    EXPECT_EQ(d.acceleration, plain.acceleration);
  }
}

TEST(Differentiators, TheBilinearDerivativeUndoesTheTrapezoidalSum) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise;
  std::vector<double> position(300);
  for (double& x : position) x = noise(random);
  const Derivatives d = filter_of(Differentiator::bilinear).apply(position);
  double sum = position[0];
  for (std::size_t k = 1; k < position.size(); ++k) {
    sum += 0.5 * kSample * (d.velocity[k] + d.velocity[k - 1]);
    ASSERT_NEAR(sum, position[k], 1e-10) << k;
  }
  // One disturbed sample never dies away.
  std::vector<double> bump(1000, 0.0);
  bump[10] = 1.0;
  const std::vector<double> v = filter_of(Differentiator::bilinear).apply(bump).velocity;
  EXPECT_NEAR(v[998], 4.0 / kSample, 1e-6);
  EXPECT_NEAR(v[999], -4.0 / kSample, 1e-6);
}

TEST(Differentiators, TheBilinearRuleWarpsFrequencyByATangent) {
  for (const double hz : {1.0, 20.0, 120.0, 400.0}) {
    const double warped = 2.0 / kSample * std::tan(pi * hz * kSample);
    const std::complex<double> s(0.0, warped);
    const std::complex<double> h1 = kW0 * kW0 / (s * s + std::sqrt(2.0) * kW0 * s + kW0 * kW0);
    const std::complex<double> h2 = kW0 * kW0 / ((s + kW0) * (s + kW0));
    for (int order = 0; order <= 2; ++order) {
      const std::complex<double> slope = std::pow(s, order);
      EXPECT_LT(std::abs(filter_of(Differentiator::bilinear).response(order, hz) - slope), 1e-9 * std::abs(slope));
      EXPECT_LT(std::abs(filter_of(Differentiator::h1_bilinear).response(order, hz) - slope * h1),
                1e-9 * std::abs(slope));
      EXPECT_LT(std::abs(filter_of(Differentiator::h2_bilinear).response(order, hz) - slope * h2),
                1e-9 * std::abs(slope));
    }
  }
}

TEST(Differentiators, PreWarpingMakesTheResponseExactAtTheCutOff) {
  const std::complex<double> s(0.0, kW0);
  const std::complex<double> h1(0.0, -1.0 / std::sqrt(2.0)), h2(0.0, -0.5);
  for (int order = 0; order <= 2; ++order) {
    const std::complex<double> slope = std::pow(s, order);
    const double scale = std::abs(slope);
    EXPECT_LT(std::abs(filter_of(Differentiator::bilinear_prewarped).response(order, kCutoff) - slope), 1e-9 * scale);
    EXPECT_LT(std::abs(filter_of(Differentiator::h1_bilinear_prewarped).response(order, kCutoff) - slope * h1),
              1e-9 * scale);
    EXPECT_LT(std::abs(filter_of(Differentiator::h2_bilinear_prewarped).response(order, kCutoff) - slope * h2),
              1e-9 * scale);
  }
  const double taken = kW0 * kSample * kW0 * kSample / 12.0;
  EXPECT_NEAR(filter_of(Differentiator::h2_bilinear_prewarped).gain_error(1, 1e-3), -taken, 0.01 * taken);
}

TEST(Differentiators, ImpulseInvarianceSamplesTheImpulseResponse) {
  std::vector<double> impulse(200, 0.0);
  impulse[3] = 1.0;
  const double wd = kW0 / std::sqrt(2.0);
  const Derivatives h1 = filter_of(Differentiator::h1_impulse_invariant).apply(impulse);
  const Derivatives h2 = filter_of(Differentiator::h2_impulse_invariant).apply(impulse);
  for (std::size_t k = 3; k < impulse.size(); ++k) {
    const double t = kSample * static_cast<double>(k - 3), scale = kSample * kW0 * kW0, start = k == 3 ? 0.5 : 1.0;
    const double e1 = std::exp(-wd * t), e2 = std::exp(-kW0 * t);
    EXPECT_NEAR(h1.position[k], scale * e1 * std::sin(wd * t) / wd, 1e-12);
    EXPECT_NEAR(h1.velocity[k], start * scale * e1 * (std::cos(wd * t) - std::sin(wd * t)), 1e-10);
    EXPECT_NEAR(h2.position[k], scale * e2 * t, 1e-12);
    EXPECT_NEAR(h2.velocity[k], start * scale * e2 * (1.0 - kW0 * t), 1e-10);
  }
}

TEST(Differentiators, ImpulseInvarianceLeaksPosition) {
  const double scale = kW0 * kW0 * kSample * kW0 * kSample;
  const double h1 = filter_of(Differentiator::h1_impulse_invariant).gain_at_standstill(1);
  const double h2 = filter_of(Differentiator::h2_impulse_invariant).gain_at_standstill(1);
  EXPECT_NEAR(h1, std::sqrt(2.0) / 12.0 * scale, 0.02 * scale);
  EXPECT_NEAR(h2, scale / 6.0, 0.02 * scale);
  const Derivatives still = filter_of(Differentiator::h2_impulse_invariant).apply(std::vector<double>(50, 100.0));
  EXPECT_NEAR(still.velocity.back(), 100.0 * h2, 1e-9);
  EXPECT_NEAR(filter_of(Differentiator::h2_matched).gain_at_standstill(1), 0.0, 1e-12);
}

TEST(Differentiators, MatchedFiltersHaveTheAnalogFiltersPoles) {
  std::vector<double> impulse(300, 0.0);
  impulse[2] = 1.0;
  const std::vector<double> y = filter_of(Differentiator::h2_matched).apply(impulse).velocity;
  const double p = std::exp(-kW0 * kSample);
  for (std::size_t k = 6; k < impulse.size(); ++k)
    EXPECT_NEAR(y[k] - 2.0 * p * y[k - 1] + p * p * y[k - 2], 0.0, 1e-9) << k;
}

TEST(Differentiators, AnalogFiltersDelayByTwiceTheirDampingOverTheCutOff) {
  const double samples = 1.0 / (kW0 * kSample);
  EXPECT_NEAR(filter_of(Differentiator::h1_bilinear).group_delay_samples(1, 0.01), std::sqrt(2.0) * samples, 1e-3);
  EXPECT_NEAR(filter_of(Differentiator::h2_bilinear).group_delay_samples(1, 0.01), 2.0 * samples, 1e-3);
  EXPECT_NEAR(filter_of(Differentiator::h2_matched).group_delay_samples(1, 0.01), 2.0 * samples, 0.05);
  EXPECT_EQ(filter_of(Differentiator::butterworth).group_delay_samples(1, 15.0), 0.0);
}

TEST(Differentiators, RefuseWhatTheyCannotDo) {
  EXPECT_THROW(DifferentiatingFilter(Differentiator::backward, 0.0, 0.0), std::invalid_argument);
  EXPECT_NO_THROW(DifferentiatingFilter(Differentiator::backward, 0.0, kSample));
  EXPECT_THROW(DifferentiatingFilter(Differentiator::h1_matched, 500.0, kSample), std::invalid_argument);
  EXPECT_THROW(DifferentiatingFilter(Differentiator::butterworth, 0.0, kSample), std::invalid_argument);
  EXPECT_THROW(filter_of(Differentiator::h1_impulse_invariant).response(2, 1.0), std::invalid_argument);
  EXPECT_THROW(filter_of(Differentiator::backward).response(3, 1.0), std::invalid_argument);
}

TEST(Differentiators, ShortSignalsComeBackAsShort) {
  for (const DifferentiatorInfo& info : differentiators()) {
    const DifferentiatingFilter filter = filter_of(info.which);
    EXPECT_TRUE(filter.apply({}).velocity.empty()) << info.name;
    const Derivatives one = filter.apply(std::vector<double>{5.0});
    ASSERT_EQ(one.velocity.size(), 1u) << info.name;
    if (!leaks(info)) {
      EXPECT_NEAR(one.velocity[0], 0.0, 1e-9) << info.name;
    }
  }
}

}  // namespace
}  // namespace flexspline::signals::signals_differentiators_test
