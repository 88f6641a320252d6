// The current that a model makes of the motion, and what it is for: an effect that remembers the measured current
// averages its noise.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/policy.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::estimation::estimation_modelled_current_test {
namespace {

using data::Column;

constexpr double kNm = 0.05, kSampleS = 5e-3;

double torque_at(double t, double hz) {
  const double rate = kTurn * hz, q = 30.0 * std::sin(rate * t), w = 30.0 * rate * std::cos(rate * t);
  return -1e-3 * rate * rate * q + 1e-3 * w + std::copysign(0.05, w);
}

// The current acts `delay_s` later than it is logged, and makes less torque by `saturation` times its cube.
std::unique_ptr<Identification> axis(double delay_s, double noise_a, data::Dataset& dataset,
                                     double saturation_per_a2 = 0.0) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, noise_a);
  for (const double hz : {0.3, 0.5, 0.8})
    dataset.experiments.push_back(
        tests::written_experiment(std::to_string(hz), kSampleS, 3000, [&](double t, data::Experiment& e) {
          e[Column::motor_position].push_back(30.0 * std::sin(kTurn * hz * t));
          const double current = torque_at(t + delay_s, hz) / kNm;
          e[Column::current].push_back(current + saturation_per_a2 * std::pow(current, 3) + noise(random));
        }));
  model::Model model = tests::plain_model();
  model.drive.torque_constant_nm_a.value = kNm;
  return identify(dataset, model, {});
}

// What an effect gains on data left out; a delay, beyond a lag that the fit has anyhow.
selection::LikelihoodGain gain_of(std::string_view effect, const Identification& identified) {
  const RegressionProblem& data = identified.data.front();
  selection::BalanceSearch search{&data, Eigen::VectorXd::Ones(data.rows()), {}};
  search.base = selection::cross_validate(data, identified.terms, search.keep);
  const auto candidates = selection::rank_candidates(
      search, [&](const selection::CandidateModel& model) { return model.entry->name() == effect; });
  return candidates.front().gain;
}

TEST(ModelledCurrent, IsTheTorqueOfTheModelOverTheTorqueConstant) {
  data::Dataset dataset;
  const auto identified = axis(0.0, 0.0, dataset);
  take_modelled_current(identified->prepared, identified->terms);
  const RecordSignals& signals = identified->prepared.records[1].inputs;
  ASSERT_EQ(signals.modelled_current.size(), signals.size());
  double squares = 0.0, of_all = 0.0;
  for (std::size_t k = 0; k < signals.size(); ++k) {
    const double t = kSampleS * static_cast<double>(k);
    const double speed = std::cos(kTurn * 0.5 * t);
    if (std::abs(speed) < 0.2) continue;  // around reversals
    squares += std::pow(signals.modelled_current[k] - torque_at(t, 0.5) / kNm, 2);
    of_all += std::pow(torque_at(t, 0.5) / kNm, 2);
  }
  EXPECT_LT(std::sqrt(squares / of_all), 0.01);
}

TEST(ModelledCurrent, IsReadByWhatRemembersTheCurrentAlone) {
  RecordSignals s;
  s.resize(3);
  s.current = ScaledSignal(std::vector<double>{1.0, 2.0, 3.0});
  s.modelled_current = {4.0, 5.0, 6.0};
  EXPECT_EQ(s[1].current, 2.0);
  EXPECT_EQ(s.at(1, effects::kCurrent).current, 2.0);
  EXPECT_EQ(s.at(1, effects::kCurrent | RecordSignals::kModelledCurrent).current, 5.0);
}

TEST(ModelledCurrent, KeepsADelayFromExplainingTheNoiseOfTheMeasuredOne) {
  data::Dataset dataset;
  const auto identified = axis(0.0, 0.2, dataset);
  EXPECT_GT(gain_of("current_delay", *identified).chi2_percent, 10.0);
  EXPECT_GT(gain_of("current_delay", *identified).score, selection::kPolicy.named_score);
  take_modelled_current(identified->prepared, identified->terms);
  EXPECT_LT(gain_of("current_delay", *identified).chi2_percent, 1.0);
  EXPECT_LT(gain_of("current_delay", *identified).score, selection::kPolicy.named_score);
}

TEST(ModelledCurrent, ShowsADelayThatIsThere) {
  data::Dataset dataset;
  const auto identified = axis(8e-3, 0.02, dataset);
  take_modelled_current(identified->prepared, identified->terms);
  EXPECT_GT(gain_of("current_delay", *identified).score, selection::kPolicy.named_score);
}

// The cube of a noisy current has three times its square times the noise.
TEST(ModelledCurrent, KeepsASaturationFromExplainingTheNoiseOfTheMeasuredOne) {
  data::Dataset measured_data, data;
  const auto measured = axis(0.0, 4.0, measured_data);
  EXPECT_GT(gain_of("torque_constant_saturation", *measured).score, selection::kPolicy.named_score);
  const auto identified = axis(0.0, 4.0, data);
  take_modelled_current(identified->prepared, identified->terms);
  EXPECT_LT(gain_of("torque_constant_saturation", *identified).score, 0.0);
}

TEST(ModelledCurrent, ShowsASaturationThatIsThere) {
  data::Dataset dataset;
  const auto identified = axis(0.0, 0.02, dataset, 0.01);
  take_modelled_current(identified->prepared, identified->terms);
  EXPECT_GT(gain_of("torque_constant_saturation", *identified).score, selection::kPolicy.named_score);
}

TEST(ModelledCurrent, IsNotTakenWhereTheModelHasSuchAMemory) {
  data::Dataset dataset;
  const auto identified = axis(0.0, 0.0, dataset);
  Terms terms = identified->terms;
  terms.push_back(terms.front());
  terms.back().entry = &catalogue::get("current_delay");
  take_modelled_current(identified->prepared, terms);
  EXPECT_TRUE(identified->prepared.records.front().inputs.modelled_current.empty());
}

}  // namespace
}  // namespace flexspline::estimation::estimation_modelled_current_test
