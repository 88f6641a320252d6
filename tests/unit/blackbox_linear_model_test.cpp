// FIR and ARX models against difference equations that are known, and the choice of orders.
#include "host/engine/blackbox/linear_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace flexspline::blackbox::blackbox_linear_model_test {
namespace {

// y_k = -a y_{k-1} ... + b u_{k-nk} ... + c with white input, started at rest.
Record record_of(const std::vector<double>& a, const std::vector<std::vector<double>>& b, int nk, double c,
                 std::size_t n, std::uint64_t seed, double noise = 0.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Record r;
  r.output.resize(n);
  for (std::size_t u = 0; u < b.size(); ++u) {
    r.inputs.emplace_back(n);
    for (double& x : r.inputs.back()) x = normal(random);
  }
  for (std::size_t k = 0; k < n; ++k) {
    double y = c;
    for (std::size_t i = 1; i <= a.size() && i <= k; ++i) y -= a[i - 1] * r.output[k - i];
    for (std::size_t u = 0; u < b.size(); ++u)
      for (std::size_t i = 0; i < b[u].size(); ++i) {
        const std::size_t back = static_cast<std::size_t>(nk) + i;
        if (back <= k) y += b[u][i] * r.inputs[u][k - back];
      }
    r.output[k] = y;
  }
  for (double& y : r.output) y += noise * normal(random);
  return r;
}

const std::vector<double> kA = {-1.5, 0.7};  // poles 0.75 +- 0.37j, modulus sqrt(0.7)
const std::vector<std::vector<double>> kB = {{1.0, 0.5}};

TEST(LinearModel, AnArxWithoutNoiseIsFoundToTheLastDigits) {
  const std::vector<Record> records = {record_of(kA, kB, 1, 0.3, 200, 1), record_of(kA, kB, 1, 0.3, 150, 2)};
  const LinearModel m = fit(records, {2, 2, 1, true});
  EXPECT_NEAR(m.a[0], -1.5, 1e-12);
  EXPECT_NEAR(m.a[1], 0.7, 1e-12);
  EXPECT_NEAR(m.b[0][0], 1.0, 1e-12);
  EXPECT_NEAR(m.b[0][1], 0.5, 1e-12);
  EXPECT_NEAR(m.constant, 0.3, 1e-12);
  EXPECT_EQ(m.parameters, 5u);
  EXPECT_EQ(m.rows, 198u + 148u);
  EXPECT_NEAR(m.largest_pole(), std::sqrt(0.7), 1e-12);
  EXPECT_TRUE(m.stable());
  EXPECT_NEAR(m.static_gain(0), 1.5 / 0.2, 1e-10);
  EXPECT_LT(errors_of(m, records).rms(), 1e-10);
  EXPECT_LT(m.condition_number, 100.0);
}

TEST(LinearModel, AFirWithSeveralInputsAndADelayIsFound) {
  const std::vector<std::vector<double>> b = {{0.2, -1.0, 0.4}, {3.0, 0.0, 1.0}};
  const LinearModel m = fit({record_of({}, b, 3, 0.0, 300, 3)}, {0, 3, 3, false});
  EXPECT_EQ(m.parameters, 6u);
  for (int u = 0; u < 2; ++u)
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(m.b[static_cast<std::size_t>(u)][i], b[static_cast<std::size_t>(u)][static_cast<std::size_t>(i)],
                  1e-12);
  EXPECT_EQ(m.largest_pole(), 0.0);
  EXPECT_EQ(m.orders.memory(), 5u);
}

TEST(LinearModel, SamplesThatAreNotJudgedAreNeitherFittedNorScored) {
  Record r = record_of(kA, kB, 1, 0.0, 300, 4);
  r.scored.assign(300, 1);
  // A disturbed output spoils the equations that hold it: its own and the two after.
  r.output[100] += 50.0;
  EXPECT_GT(std::abs(fit({r}, {2, 2, 1, false}).a[0] + 1.5), 1e-3);
  for (std::size_t k = 100; k < 103; ++k) r.scored[k] = 0;
  const LinearModel m = fit({r}, {2, 2, 1, false});
  EXPECT_NEAR(m.a[0], -1.5, 1e-12);
  EXPECT_EQ(m.rows, 298u - 3u);
  EXPECT_EQ(errors_of(m, r).samples, 295u);
  EXPECT_LT(errors_of(m, r).rms_one_step(), 1e-10);
}

TEST(LinearModel, OneStepUsesMeasuredOutputsAndTheFreeRunItsOwn) {
  const Record r = record_of(kA, kB, 1, 0.0, 400, 5);
  LinearModel m = fit({r}, {2, 2, 1, false});
  m.constant = 0.1;  // wrong by that much a step
  const std::vector<double> one = m.one_step(r), run = m.simulate(r);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(one[k], r.output[k]);
    EXPECT_EQ(run[k], r.output[k]);
  }
  for (std::size_t k = 2; k < 400; ++k) EXPECT_NEAR(one[k] - r.output[k], 0.1, 1e-10);
  EXPECT_NEAR(run[399] - r.output[399], 0.1 / 0.2, 1e-9);  // the static gain of a constant
  const Errors e = errors_of(m, r);
  EXPECT_NEAR(e.rms_one_step(), 0.1, 1e-9);
  EXPECT_NEAR(e.rms(), 0.5, 0.01);
}

TEST(LinearModel, FitInPercentIsZeroForTheMeanAndAHundredForAPerfectModel) {
  const Record r = record_of(kA, kB, 1, 0.7, 4000, 6);
  EXPECT_NEAR(errors_of(fit({r}, {2, 2, 1, true}), r).fit_percent(), 100.0, 1e-6);
  EXPECT_NEAR(errors_of(fit({r}, {0, 0, 1, true}), r).fit_percent(), 0.0, 1e-6);
  Record still = r;
  std::fill(still.output.begin(), still.output.end(), 2.0);
  EXPECT_TRUE(std::isnan(errors_of(fit({still}, {0, 1, 1, true}), still).fit_percent()));
}

TEST(LinearModel, AnUnstableSystemIsFoundAndSaidToBeUnstable) {
  const LinearModel m = fit({record_of({-1.05}, {{1.0}}, 1, 0.0, 100, 7)}, {1, 1, 1, false});
  EXPECT_NEAR(m.largest_pole(), 1.05, 1e-9);
  EXPECT_FALSE(m.stable());
  const Record long_one = record_of({-0.5}, {{1.0}}, 1, 0.0, 20000, 8);
  EXPECT_TRUE(std::isnan(errors_of(m, long_one).rms()));
  EXPECT_TRUE(std::isfinite(errors_of(m, long_one).rms_one_step()));
}

TEST(LinearModel, InputsThatSayTheSameShareTheEffect) {
  Record r = record_of({}, {{2.0}}, 1, 0.0, 100, 9);
  r.inputs.push_back(r.inputs[0]);
  r.inputs.emplace_back(100, 0.0);
  const LinearModel m = fit({r}, {0, 1, 1, false});
  EXPECT_NEAR(m.b[0][0], 1.0, 1e-9);
  EXPECT_NEAR(m.b[1][0], 1.0, 1e-9);
  EXPECT_EQ(m.b[2][0], 0.0);
  EXPECT_TRUE(std::isinf(m.condition_number));
}

TEST(LinearModel, NoiseOnTheOutputPullsThePolesOfAnArxIn) {
  // y = 0.9 y + u, and white noise of variance s^2 on what is measured: least squares tends to 0.9 P / (P + s^2), with
  // P = 1 / (1 - 0.81), as u is independent of the past.
  const LinearModel m = fit({record_of({-0.9}, {{1.0}}, 1, 0.0, 200000, 10, 1.0)}, {1, 1, 1, false});
  const double power = 1.0 / (1.0 - 0.81);
  EXPECT_NEAR(-m.a[0], 0.9 * power / (power + 1.0), 0.01);
}

TEST(LinearModel, RefusesWhatCannotBeFitted) {
  const Record r = record_of(kA, kB, 1, 0.0, 20, 11);
  EXPECT_THROW(fit({}, {0, 1, 1, true}), std::invalid_argument);
  EXPECT_THROW(fit({r}, {0, 30, 1, true}), std::invalid_argument);
  EXPECT_THROW(fit({r}, {-1, 2, 1, true}), std::invalid_argument);
  EXPECT_THROW(fit({r}, {0, 0, 1, false}), std::invalid_argument);
  Record other = r;
  other.inputs[0].pop_back();
  EXPECT_THROW(fit({r, other}, {0, 1, 1, true}), std::invalid_argument);
  other = r;
  other.inputs.clear();
  EXPECT_THROW(fit({r, other}, {0, 1, 1, true}), std::invalid_argument);
  other = r;
  other.output[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fit({other}, {0, 1, 1, true}), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::blackbox::blackbox_linear_model_test
