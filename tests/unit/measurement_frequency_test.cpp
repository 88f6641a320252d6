// Frequency response and resonance against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/engine/measurement/frequency_response.hpp"
#include "host/engine/measurement/measure.hpp"
#include "host/engine/measurement/resonance.hpp"
#include "tests/unit/measurement_signals.hpp"

namespace flexspline::measurement::measurement_frequency_test {
namespace {

using namespace std::complex_literals;
using data::Column;
using tests::kTwoPi;

constexpr double kSample = 1e-3;
constexpr double kPeriod = 2.0;
constexpr std::size_t kPeriodSamples = 2000;

// Current to velocity of an inertia on a spring, the locked load: k s / (s^2 + 2 zeta w s + w^2).
std::complex<double> locked_drive(double f) {
  const double w = kTwoPi * 12.4, zeta = 0.06;
  const std::complex<double> s = 1i * kTwoPi * f;
  return 500.0 * s / (s * s + 2.0 * zeta * w * s + w * w);
}

// Current to motor velocity of two inertias with a spring between them and a viscous friction.
constexpr double kAntiHz = 9.0, kAntiDamping = 0.02, kResonanceHz = 14.0, kResonanceDamping = 0.03;
std::complex<double> free_drive(double f) {
  const std::complex<double> s = 1i * kTwoPi * f;
  const double wa = kTwoPi * kAntiHz, wr = kTwoPi * kResonanceHz;
  return 400.0 / (s + 3.0) * (s * s + 2.0 * kAntiDamping * wa * s + wa * wa) /
         (s * s + 2.0 * kResonanceDamping * wr * s + wr * wr) * (wr * wr) / (wa * wa);
}

std::complex<double> integrated(const std::function<std::complex<double>(double)>& g, double f) {
  return g(f) / (1i * kTwoPi * f);
}

// Motor position in steady state, with encoder-like noise.
data::Dataset record_of(const std::function<std::complex<double>(double)>& velocity_response, std::size_t periods,
                        double noise_rad, double drift_rad_s = 0.0) {
  const auto lines = tests::multisine(161, 0.05, 11);
  data::Dataset dataset;
  dataset.experiments.push_back(tests::experiment_of(periods * kPeriodSamples + 300, kSample));
  data::Experiment& e = dataset.experiments.back();
  e[Column::current] = tests::signal_of(lines, kPeriod, kSample, e.size());
  e[Column::motor_position] =
      tests::signal_of(lines, kPeriod, kSample, e.size(), [&](double f) { return integrated(velocity_response, f); });
  for (std::size_t k = 0; k < e.size(); ++k) e[Column::motor_position][k] += drift_rad_s * e.time_s[k];
  if (noise_rad > 0.0) tests::add_noise(e[Column::motor_position], noise_rad, 12);
  return dataset;
}

TEST(FrequencyResponse, OfAMultisineIsTheSystemsOwn) {
  const Measurement m = measure(record_of(locked_drive, 5, 0.0, 20.0));
  ASSERT_EQ(m.records.size(), 1u);
  ASSERT_TRUE(m.records[0].period.has_value());
  EXPECT_EQ(m.records[0].period->samples, kPeriodSamples);
  EXPECT_EQ(m.records[0].period->count, 4u);  // the first one settles
  ASSERT_EQ(m.records[0].responses.size(), 1u);
  const FrequencyResponse& r = m.records[0].responses[0];
  EXPECT_TRUE(r.by_periods);
  EXPECT_EQ(r.unit, "(rad/s)/A");
  ASSERT_GT(r.lines.size(), 50u);
  for (const ResponseLine& line : r.lines) {
    const std::complex<double> truth = locked_drive(line.frequency_hz);
    EXPECT_NEAR(std::abs(line.response / truth - 1.0), 0.0, 1e-4) << line.frequency_hz;
    EXPECT_TRUE(line.trusted);
  }
}

TEST(FrequencyResponse, ConfidenceBandHoldsTheTruthNineteenTimesOfTwenty) {
  std::size_t inside = 0, all = 0, trusted = 0;
  double squares = 0.0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const auto lines = tests::multisine(161, 0.05, seed);
    const std::size_t samples = 7 * kPeriodSamples + 10;
    data::Experiment e = tests::experiment_of(samples, kSample);
    e[Column::current] = tests::signal_of(lines, kPeriod, kSample, samples);
    e[Column::torque] = tests::signal_of(lines, kPeriod, kSample, samples, locked_drive);
    tests::add_noise(e[Column::torque], 3.0, 100 + seed);
    data::Dataset dataset;
    dataset.experiments.push_back(std::move(e));
    const Measurement m = measure(dataset);
    ASSERT_EQ(m.records[0].responses.size(), 1u);
    for (const ResponseLine& line : m.records[0].responses[0].lines) {
      const double error = std::abs(1.0 - locked_drive(line.frequency_hz) / line.response);
      inside += error < line.band ? 1 : 0;
      ++all;
      if (!line.trusted) continue;
      ++trusted;
      squares += error * error / (2.0 * line.std * line.std);
    }
  }
  ASSERT_GT(all, 300u);
  const double share = static_cast<double>(inside) / static_cast<double>(all);
  EXPECT_GT(share, 0.92);
  EXPECT_LT(share, 0.98);
  ASSERT_GT(trusted, 100u);
  // Ten degrees of freedom make 1.25 of it, and choosing the better lines more.
  EXPECT_GT(squares / static_cast<double>(trusted), 0.7);
  EXPECT_LT(squares / static_cast<double>(trusted), 2.0);
}

TEST(FrequencyResponse, BandHoldsTheDistortionThatRepeatsItself) {
  // y = x + 0.3 x^3 without noise: coherence is one, and another realisation gives another response.
  const double cubic = 0.3;
  std::size_t inside = 0, all = 0;
  std::complex<double> mean;
  std::vector<std::complex<double>> found;
  std::vector<double> bands;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    data::Dataset dataset;
    dataset.experiments.push_back(tests::experiment_of(3 * kPeriodSamples, kSample));
    data::Experiment& e = dataset.experiments[0];
    e[Column::current] = tests::signal_of(tests::multisine(161, 0.1, seed), kPeriod, kSample, e.size());
    for (const double x : e[Column::current]) e[Column::torque].push_back(x + cubic * x * x * x);
    const Measurement m = measure(dataset);
    for (const ResponseLine& line : m.records[0].responses.at(0).lines) {
      EXPECT_GT(line.coherence, 1.0 - 1e-9);
      found.push_back(line.response);
      bands.push_back(line.band * std::abs(line.response));
      mean += line.response;
    }
  }
  mean /= static_cast<double>(found.size());
  for (std::size_t k = 0; k < found.size(); ++k, ++all) inside += std::abs(found[k] - mean) < bands[k] ? 1 : 0;
  ASSERT_GT(all, 400u);
  EXPECT_GT(static_cast<double>(inside) / static_cast<double>(all), 0.88);
  EXPECT_LT(static_cast<double>(inside) / static_cast<double>(all), 0.99);
}

TEST(FrequencyResponse, OfUnrelatedSignalsIsNotTrusted) {
  std::vector<double> x(40000, 0.0), y(40000, 0.0);
  tests::add_noise(x, 1.0, 1);
  tests::add_noise(y, 1.0, 2);
  const std::vector<data::Segment> segments = {{0, 40000}};
  const Channel input = tests::channel(std::move(x)), output = tests::channel(std::move(y));
  const auto spectra = spectra_by_welch(input, output, segments, kSample, 2000);
  ASSERT_TRUE(spectra.has_value());
  for (const ResponseLine& line : response_of(*spectra, input, output, kSample)) EXPECT_FALSE(line.trusted);
}

TEST(FrequencyResponse, OfADelayHasItsPhaseAndFullCoherence) {
  // White noise, as it is and 3 samples later.
  const std::size_t n = 40000, delay = 3;
  std::vector<double> x(n, 0.0), y(n, 0.0);
  tests::add_noise(x, 1.0, 1);
  for (std::size_t k = delay; k < n; ++k) y[k] = x[k - delay];
  const std::vector<data::Segment> segments = {{0, n}};
  const Channel input = tests::channel(std::move(x)), output = tests::channel(std::move(y));
  const auto spectra = spectra_by_welch(input, output, segments, kSample, 2000);
  ASSERT_TRUE(spectra.has_value());
  const auto lines = response_of(*spectra, input, output, kSample);
  ASSERT_GT(lines.size(), 790u);  // up to four tenths of the sample rate
  for (const ResponseLine& line : lines) {
    EXPECT_GT(line.coherence, 0.98);
    EXPECT_NEAR(std::abs(line.response), 1.0, 0.03);
    const std::complex<double> truth = std::exp(-1i * kTwoPi * line.frequency_hz * (delay * kSample));
    EXPECT_NEAR(std::arg(line.response / truth), 0.0, 0.03);
  }
}

TEST(FrequencyResponse, OfAHeldCommandIsThatOfThePlantAlone) {
  // v' = 50 u - 4 v with a current held from sample to sample, solved exactly; the velocity is taken from the position.
  const std::size_t n = 60000;
  data::Dataset dataset;
  dataset.experiments.push_back(tests::experiment_of(n, kSample));
  data::Experiment& e = dataset.experiments.back();
  e.current_hold = data::CurrentHold::zoh;
  e[Column::current].assign(n, 0.0);
  tests::add_noise(e[Column::current], 1.0, 5);
  e[Column::motor_position].assign(n, 0.0);
  const double a = 4.0, decay = std::exp(-a * kSample), gain = 50.0 / a;
  double v = 0.0, position = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    e[Column::motor_position][k] = position;
    const double u = gain * e[Column::current][k];
    position += u * kSample + (v - u) * (1.0 - decay) / a;
    v = u + (v - u) * decay;
  }
  const Measurement m = measure(dataset);
  ASSERT_FALSE(m.pooled.empty());
  EXPECT_FALSE(m.pooled[0].response.by_periods);
  std::size_t seen = 0;
  for (const ResponseLine& line : m.pooled[0].response.lines) {
    if (line.frequency_hz < 1.0 || line.frequency_hz > 60.0) continue;
    ++seen;
    const std::complex<double> truth = 50.0 / (1i * kTwoPi * line.frequency_hz + a);
    EXPECT_NEAR(std::abs(line.response / truth - 1.0), 0.0, 0.03) << line.frequency_hz;
  }
  EXPECT_GT(seen, 100u);
}

TEST(FrequencyResponse, CountsOnlyWindowsThatHoldALine) {
  // Noise in the first quarter of the record alone, and all along.
  const std::size_t n = 64000;
  std::vector<double> x(n, 0.0), all(n, 0.0);
  tests::add_noise(all, 1.0, 1);
  std::copy(all.begin(), all.begin() + n / 4, x.begin());
  const std::vector<data::Segment> segments = {{0, n}};
  const auto averages = [&](const std::vector<double>& signal) {
    const Channel channel = tests::channel(signal);
    const auto spectra = spectra_by_welch(channel, channel, segments, kSample, 1000);
    double sum = 0.0;
    for (const double a : spectra->averages) sum += a / static_cast<double>(spectra->averages.size());
    return sum;
  };
  EXPECT_NEAR(averages(x) / averages(all), 0.25, 0.05);
}

TEST(FrequencyResponse, OfASineSaysNothingBesideItsLine) {
  const std::size_t n = 20000;
  const std::vector<tests::Line> lines = {{8, 1.0}};
  const Channel input = tests::channel(tests::signal_of(lines, kPeriod, kSample, n));
  const Channel output = tests::channel(tests::signal_of(lines, kPeriod, kSample, n, locked_drive));
  const std::vector<data::Segment> segments = {{0, n}};
  const auto spectra = spectra_by_welch(input, output, segments, kSample, 4096);
  ASSERT_TRUE(spectra.has_value());
  std::size_t trusted = 0;
  for (const ResponseLine& line : response_of(*spectra, input, output, kSample)) {
    if (!line.trusted) continue;
    ++trusted;
    EXPECT_NEAR(line.frequency_hz, 4.0, 3.0 / 4.096);
  }
  EXPECT_GE(trusted, 1u);
}

TEST(Resonance, OfALockedDriveIsFoundWithinAPercent) {
  const Measurement m = measure(record_of(locked_drive, 6, 1e-4));
  ASSERT_EQ(m.pooled.size(), 1u);
  const ResonanceSearch& search = m.pooled[0].resonances;
  ASSERT_EQ(search.found.size(), 1u);
  const Resonance& r = search.found[0];
  EXPECT_FALSE(r.anti);
  EXPECT_NEAR(r.frequency_hz, 12.4, 0.124);
  EXPECT_LT(std::abs(r.frequency_hz - 12.4), 4.0 * r.frequency_std_hz + 1e-6);
  EXPECT_NEAR(r.damping, 0.06, 0.003);
  EXPECT_FALSE(r.damping_is_upper_limit);
}

TEST(Resonance, AndAntiResonanceOfAFreeDriveAreBothFound) {
  const Measurement m = measure(record_of(free_drive, 6, 2e-5));
  ASSERT_EQ(m.pooled.size(), 1u);
  const auto& found = m.pooled[0].resonances.found;
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(found[0].anti);
  EXPECT_NEAR(found[0].frequency_hz, kAntiHz, 0.01 * kAntiHz);
  EXPECT_NEAR(found[0].damping, kAntiDamping, 0.1 * kAntiDamping);
  EXPECT_FALSE(found[1].anti);
  EXPECT_NEAR(found[1].frequency_hz, kResonanceHz, 0.01 * kResonanceHz);
  EXPECT_NEAR(found[1].damping, kResonanceDamping, 0.1 * kResonanceDamping);
}

TEST(Resonance, StatesAnUncertaintyThatItsErrorsKeepTo) {
  double squares = 0.0;
  const int trials = 12;
  for (int trial = 0; trial < trials; ++trial) {
    data::Dataset dataset = record_of(locked_drive, 6, 0.0);
    tests::add_noise(dataset.experiments[0][Column::motor_position], 3e-3, 50 + static_cast<unsigned>(trial));
    const Measurement m = measure(dataset);
    ASSERT_EQ(m.pooled.at(0).resonances.found.size(), 1u);
    const Resonance& r = m.pooled[0].resonances.found[0];
    squares += std::pow((r.frequency_hz - 12.4) / r.frequency_std_hz, 2) / trials;
  }
  EXPECT_GT(squares, 0.3);
  EXPECT_LT(squares, 2.5);
}

TEST(Resonance, IsNotSeenWhereThereIsNone) {
  const Measurement m = measure(record_of([](double f) { return 50.0 / (1i * kTwoPi * f + 4.0); }, 6, 1e-5));
  ASSERT_EQ(m.pooled.size(), 1u);
  const ResonanceSearch& search = m.pooled[0].resonances;
  EXPECT_TRUE(search.found.empty());
  EXPECT_TRUE(search.why_not.empty());
  EXPECT_NEAR(search.to_hz, 80.5, 0.1);
}

TEST(Resonance, IsSeenByWelchWithNoiseAsExcitation) {
  // x'' + 2 zeta w x' + w^2 x = u in steps of exact solution: a rotation that decays.
  const double w0 = kTwoPi * 12.4, zeta = 0.06, sigma = zeta * w0, wd = std::sqrt(w0 * w0 - sigma * sigma);
  const std::size_t n = 120000;
  data::Dataset dataset;
  dataset.experiments.push_back(tests::experiment_of(n, kSample));
  data::Experiment& e = dataset.experiments.back();
  e.current_hold = data::CurrentHold::zoh;
  e[Column::current].assign(n, 0.0);
  tests::add_noise(e[Column::current], 1.0, 5);
  e[Column::motor_position].assign(n, 0.0);
  double x = 0.0, v = 0.0;
  const double c = std::cos(wd * kSample), s = std::sin(wd * kSample), decay = std::exp(-sigma * kSample);
  for (std::size_t k = 0; k < n; ++k) {
    e[Column::motor_position][k] = x;
    const double rest = 500.0 * e[Column::current][k] / (w0 * w0), y = x - rest;
    x = rest + decay * (y * c + (v + sigma * y) / wd * s);
    v = decay * (v * c - (sigma * v + w0 * w0 * y) / wd * s);
  }
  const Measurement m = measure(dataset);
  ASSERT_EQ(m.pooled.size(), 1u);
  ASSERT_EQ(m.pooled[0].resonances.found.size(), 1u);
  EXPECT_NEAR(m.pooled[0].resonances.found[0].frequency_hz, 12.4, 0.124);
  EXPECT_NEAR(m.pooled[0].resonances.found[0].damping, 0.06, 0.006);
}

}  // namespace
}  // namespace flexspline::measurement::measurement_frequency_test
