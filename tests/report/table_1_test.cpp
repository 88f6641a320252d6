// Table 1: the simulation check with 2 % of noise on input and output, and why the report's simulation did not feel the
// Stribeck velocity.
#include <gtest/gtest.h>

#include <future>

#include "hil/rhs100/models.hpp"
#include "hil/thesis_models/friction_block.hpp"
#include "hil/thesis_models/published.hpp"
#include "tests/report/free_run_fit.hpp"
#include "tests/report/rhs100_data.hpp"
#include "tests/support/campaign_size.hpp"

namespace flexspline::tests::table_1_test {
namespace {

namespace published = report::published;

constexpr double kGuessedConstant = 0.08;  // of the base model
const report::DcMotor kTruth = published::simulated_motor();

estimation::PipelineOptions cutoff(double hz) {
  estimation::PipelineOptions options;
  options.cutoff_hz = hz;
  return options;
}

// What the composite tells, put into a model that has a Stribeck term and fixed there: the report's partition.
model::Model partitioned(const estimation::Identification& linear) {
  model::Model model = model_of(rhs100::simulated_stribeck_model());
  for (const estimation::Estimate& e : linear.estimates) fix(model, e.effect, e.parameter, e.value);
  return model;
}

class Table1 : public ::testing::Test {
 protected:
  const rhs100::Set composite = rhs100::table_1_composite(), saw_tooth = rhs100::table_1_saw_tooth();

  std::unique_ptr<estimation::Identification> linear(std::uint64_t seed, const estimation::PipelineOptions& options) {
    return estimation::identify(dataset_of(composite, seed), base_model(composite), options);
  }
};

void expect_within_three_percent(const estimation::Identification& found) {
  const auto off_percent = [&](double value, double truth) { return 100.0 * std::abs(value / truth - 1.0); };
  const report::DirectionalFriction& friction = kTruth.friction.positive;
  // The report's were off by 9.7, 7.0, 5.9 and 18 %.
  EXPECT_LT(off_percent(estimate(found, "inertia", "inertia").value, kTruth.inertia), 3.0);
  EXPECT_LT(off_percent(kGuessedConstant * (1.0 + estimate(found, "torque_constant_error", "ratio").value),
                        kTruth.torque_constant),
            3.0);
  EXPECT_LT(off_percent(estimate(found, "viscous_friction", "coefficient").value, friction.viscous), 3.0);
  EXPECT_LT(off_percent(estimate(found, "coulomb_friction", "torque").value, friction.coulomb), 3.0);
}

TEST_F(Table1, LinearEstimatesAreWithinThreePercent) {
  for (std::uint64_t seed = 7001; seed < in_campaign<std::uint64_t>(7004, 7009); ++seed) {
    SCOPED_TRACE(seed);
    expect_within_three_percent(*linear(seed, cutoff(10.0)));
  }
  expect_within_three_percent(*linear(kJudgingSeed, {}));  // with the cut-off that the tool chooses
}

TEST_F(Table1, FromItsSinusoidsAloneTheToolSaysThatStribeckCannotBeTold) {
  for (const auto& options : {estimation::PipelineOptions{}, cutoff(10.0), cutoff(20.0)}) {
    const auto found =
        estimation::identify(dataset_of(composite), model_of(rhs100::simulated_stribeck_model()), options);
    bool said = false;
    for (const std::string& w : found->warnings)
      said = said || (w.find("stribeck_hess_soom.velocity stopped at the end of what these data can show") == 0 &&
                      w.find("record a slow free triangle") != std::string::npos);
    EXPECT_TRUE(said);
  }
}

// Slow motion under Stribeck friction jumps: from rest to 1 rad/s within some milliseconds, and back from 0.16 rad/s. A
// regression has to mask that, and what is left holds the amplitude times the square of the speed alone.
TEST_F(Table1, RegressionOnTheSlowSawToothDoesNotClaimTheSpeed) {
  const auto found =
      estimation::identify(dataset_of(saw_tooth), partitioned(*linear(kJudgingSeed, cutoff(10.0))), cutoff(200.0));
  const estimation::Estimate& speed = estimate(*found, "stribeck_hess_soom", "velocity");
  EXPECT_FALSE(speed.identifiable) << "it stopped at the end of its range";
  EXPECT_FALSE(speed.low || speed.high || speed.std);
}

// With all parameters free neither the scale of the torques nor the Stribeck velocity follow from the slow run: an
// interval would be false, and is not given. Before, 12 Hz gave a velocity of 3.54 to 3.63 rad/s.
TEST_F(Table1, TheSlowSawToothAloneGivesNoIntervalThatExcludesTheTruth) {
  for (const auto& options : {estimation::PipelineOptions{}, cutoff(12.0), cutoff(40.0), cutoff(60.0), cutoff(200.0)}) {
    const auto found =
        estimation::identify(dataset_of(saw_tooth), model_of(rhs100::simulated_stribeck_model()), options);
    const auto expect_no_false_interval = [&](const char* effect, const char* parameter, double truth) {
      const estimation::Estimate& e = estimate(*found, effect, parameter);
      const bool excludes = e.low && e.high && (truth < *e.low || truth > *e.high);
      EXPECT_FALSE(excludes) << effect << "." << parameter << " at " << options.cutoff_hz.value_or(0.0) << " Hz";
    };
    expect_no_false_interval("inertia", "inertia", kTruth.inertia);
    expect_no_false_interval("coulomb_friction", "torque", kTruth.friction.positive.coulomb);
    expect_no_false_interval("viscous_friction", "coefficient", kTruth.friction.positive.viscous);
    for (const char* amplitude : {"amplitude_positive", "amplitude_negative"})
      expect_no_false_interval("stribeck_hess_soom", amplitude, kTruth.friction.positive.stribeck);
    expect_no_false_interval("stribeck_hess_soom", "velocity", kTruth.friction.positive.stribeck_velocity);
  }
}

// Amplitude and speed of the Stribeck term by the free run of one saw-tooth: by a search of this test's own, with all
// other parameters known and a smoothed current. It shows what these data contain, not what the tool gives.
FreeRunFit stribeck_of(const rhs100::Set& saw_tooth, const estimation::Identification& linear, std::uint64_t seed) {
  const std::vector<FreeParameter> parameters{
      {{{"stribeck_hess_soom", "amplitude_positive"}, {"stribeck_hess_soom", "amplitude_negative"}},
       {0.002, 0.004, 0.006, 0.008, 0.01, 0.012, 0.016, 0.024}},
      {{{"stribeck_hess_soom", "velocity"}}, {0.03, 0.06, 0.12}},
      // The composite does not tell these better than the slow run needs them: fixed, their errors would be the
      // speed's.
      {{{"coulomb_friction", "torque"}}, {estimate(linear, "coulomb_friction", "torque").value}},
      {{{"viscous_friction", "coefficient"}}, {estimate(linear, "viscous_friction", "coefficient").value}},
      {{{"torque_constant_error", "ratio"}}, {estimate(linear, "torque_constant_error", "ratio").value}}};
  const data::Dataset slow = dataset_of(saw_tooth, seed);
  return fit_free_run(slow.experiments.front(), partitioned(linear), parameters, 20.0, 2.0);
}

TEST_F(Table1, TheFreeRunOnTheSlowSawToothIdentifiesAmplitudeAndSpeed) {
  const report::DirectionalFriction& truth = kTruth.friction.positive;
  std::vector<std::future<FreeRunFit>> fits;
  for (std::uint64_t seed = 7001; seed < in_campaign<std::uint64_t>(7002, 7005); ++seed) {
    fits.push_back(std::async(std::launch::async,
                              [this, seed] { return stribeck_of(saw_tooth, *linear(seed, cutoff(10.0)), seed); }));
  }
  Column speeds, claimed;
  int covered = 0;
  for (auto& pending : fits) {
    const FreeRunFit fit = pending.get();
    EXPECT_NEAR(fit.values[0] / truth.stribeck, 1.0, 0.03) << "the report's: 5 times the truth";
    EXPECT_NEAR(fit.values[1] / truth.stribeck_velocity, 1.0, 0.15) << "the report's: 0.07 times the truth";
    covered += fit.low[1] <= truth.stribeck_velocity && truth.stribeck_velocity <= fit.high[1];
    speeds.push_back(fit.values[1]);
    claimed.push_back(0.25 * (fit.high[1] - fit.low[1]));
  }
  // Of seeds of which one interval of 95 % misses there are 5 %, of those of which two of four miss 1.4 %.
  EXPECT_GE(covered, in_campaign(1, 3));
  if (!whole_campaigns()) return;
  // What the intervals claim is what the estimates scatter by, which one estimate does not show.
  EXPECT_LT(spread_percent(speeds), 2.5 * 100.0 * mean(claimed) / mean(speeds));
  EXPECT_GT(spread_percent(speeds), 0.4 * 100.0 * mean(claimed) / mean(speeds));
}

// The velocity of the report's motor under a slow saw-tooth current, with its friction block of one kind.
std::vector<double> velocity_with(report::FrictionMethod method, double step_s, double stribeck_velocity) {
  report::FrictionCurve curve = kTruth.friction;
  curve.positive.stribeck_velocity = curve.negative.stribeck_velocity = stribeck_velocity;
  const auto block = report::make_friction_block(method, {kTruth.inertia, {curve}}, step_s);
  std::vector<double> velocity;
  double v = 0.0;
  const int steps_per_ms = static_cast<int>(std::lround(1e-3 / step_s));
  for (int k = 0; k < 10000 * steps_per_ms; ++k) {
    const double phase = 0.5 * step_s * k, turn = phase - std::floor(phase);
    const double triangle = turn < 0.25 ? 4.0 * turn : turn < 0.75 ? 2.0 - 4.0 * turn : 4.0 * turn - 4.0;
    v = block->next_velocity(v, kTruth.torque_constant * 0.7 * triangle);
    if (k % steps_per_ms == 0) velocity.push_back(v);
  }
  return velocity;
}

double effect_percent(report::FrictionMethod method, double step_s, double velocity) {
  const std::vector<double> base = velocity_with(method, step_s, kTruth.friction.positive.stribeck_velocity);
  std::vector<double> change = velocity_with(method, step_s, velocity);
  for (std::size_t k = 0; k < change.size(); ++k) change[k] -= base[k];
  return 100.0 * root_mean_square(change) / root_mean_square(base);
}

TEST(Table1Simulation, TheReportsBoundaryLayerHidTheStribeckVelocityFromItsOwnSimulation) {
  const report::BoundaryLayerFriction layer({kTruth.inertia, {kTruth.friction}}, published::kSampleS);
  EXPECT_NEAR(layer.width(1), 0.6, 1e-9);
  EXPECT_GT(layer.width(1), 10.0 * kTruth.friction.positive.stribeck_velocity);
  for (const double velocity : {0.0035, 0.02, 0.1}) {
    const double report_s = effect_percent(report::FrictionMethod::boundary_layer, published::kSampleS, velocity);
    const double exact = effect_percent(report::FrictionMethod::implicit, published::kSampleS / 16.0, velocity);
    EXPECT_LT(report_s, 1.0);
    EXPECT_GT(exact, 3.0 * report_s);
  }
}

}  // namespace
}  // namespace flexspline::tests::table_1_test
