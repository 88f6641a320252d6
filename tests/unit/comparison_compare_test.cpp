// host/engine/comparison: figures against closed forms, and the twin against the model that it is.
#include "host/engine/comparison/compare.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "host/engine/comparison/score.hpp"
#include "host/output/answers/comparison.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::comparison::comparison_compare_test {
namespace {

using plant::Mode;
using plant::Waveform;

struct Compared {
  plant::Drive drive = plant::demo_plant().drive;
  data::Dataset dataset;
  model::Model model = known_model(drive);
  Comparison comparison;
  Compared() {
    dataset = record(drive,
                     {plan("free", Mode::velocity, Waveform::sine, 60.0, 1.0, 4.0),
                      plan("locked", Mode::current, Waveform::sine, 2.0, 0.5, 4.0, true),
                      plan("rest", Mode::off, Waveform::zero, 0.0, 1.0, 2.0)},
                     1);
    dataset.experiments[1].role = data::Role::holdout;
    comparison = compare(dataset, model, {});
  }
};

const Compared& compared() {
  static const Compared c;
  return c;
}

const SignalResult* find(const ExperimentResult& e, std::string_view signal) {
  for (const SignalResult& s : e.signals)
    if (s.signal == signal) return &s;
  return nullptr;
}

TEST(Score, FollowsItsDefinitions) {
  const std::vector<double> y{1.0, 3.0, 5.0, 7.0}, e{1.0, -1.0, 1.0, 1.0};
  Score score;
  for (std::size_t k = 0; k < y.size(); ++k) score.add(y[k], e[k]);
  const double std_y = std::sqrt(5.0);
  EXPECT_DOUBLE_EQ(score.rmse(), 1.0);
  EXPECT_DOUBLE_EQ(score.nrmse(), 1.0 / std_y);
  EXPECT_DOUBLE_EQ(score.fit_percent(), 100.0 * (1.0 - 2.0 / std::sqrt(20.0)));
  EXPECT_DOUBLE_EQ(score.vaf_percent(), 100.0 * (1.0 - 0.75 / 5.0));
  EXPECT_DOUBLE_EQ(score.max_abs(), 1.0);
}

TEST(Score, OfTwoPartsIsThatOfTheWhole) {
  Score whole, a, b;
  for (int k = 0; k < 50; ++k) {
    const double y = 1000.0 + std::sin(0.3 * k), e = 0.1 * std::cos(1.1 * k) + 0.02;
    whole.add(y, e);
    (k < 13 ? a : b).add(y, e);
  }
  a.add(b);
  EXPECT_EQ(a.samples(), whole.samples());
  EXPECT_NEAR(a.nrmse(), whole.nrmse(), 1e-12);
  EXPECT_NEAR(a.vaf_percent(), whole.vaf_percent(), 1e-9);
}

TEST(Score, HasNoShareOfASignalThatDoesNotVary) {
  Score score;
  score.add(2.0, 0.5);
  score.add(2.0, -0.5);
  EXPECT_DOUBLE_EQ(score.rmse(), 0.5);
  EXPECT_TRUE(std::isnan(score.nrmse()));
  EXPECT_TRUE(std::isnan(score.vaf_percent()));
}

TEST(HInfinityNorm, IsTheRatioAtTheLineWhereItIsLargest) {
  std::vector<double> y(2000), e(2000);
  for (std::size_t k = 0; k < y.size(); ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    y[k] = std::sin(2.0 * M_PI * 4.0 * t) + std::sin(2.0 * M_PI * 20.0 * t);
    e[k] = 0.01 * std::sin(2.0 * M_PI * 4.0 * t) + 0.2 * std::sin(2.0 * M_PI * 20.0 * t);
  }
  EXPECT_NEAR(h_infinity_norm(y, e, {{0, 2000}}, 1000.0, 50.0).value, 0.2, 0.005);
  EXPECT_NEAR(h_infinity_norm(y, e, {{0, 2000}}, 1000.0, 50.0).frequency_hz, 20.0, 2.1);
  EXPECT_NEAR(h_infinity_norm(y, e, {{0, 2000}}, 1000.0, 10.0).value, 0.01, 0.001);
}

// A first-order lag between the measured signal and the error, beside noise: the interval holds the true norm in about
// 95 of 100 records (it is for all lines together, so not in fewer).
TEST(HInfinityNorm, ItsIntervalHoldsTheTrueNormOfAFilter) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  int held = 0;
  double width = 0.0;
  for (int run = 0; run < 60; ++run) {
    std::vector<double> y(4096), e(4096);
    double lag = 0.0;
    for (std::size_t k = 0; k < y.size(); ++k) {
      y[k] = normal(random);
      lag = 0.9 * lag + 0.1 * y[k];
      e[k] = 0.3 * lag + 0.01 * normal(random);
    }
    const HInfinityNorm norm = h_infinity_norm(y, e, {{0, y.size()}}, 1000.0, 40.0);
    // Welch's lines are 1 Hz apart and the first that counts is 1 Hz: there the lag passes nearly all.
    held += norm.low <= 0.3 && norm.high >= 0.3;
    width += (norm.high - norm.low) / 60.0;
  }
  EXPECT_GE(held, 54);
  EXPECT_LT(width, 0.3) << "an interval that holds everything says nothing";
}

TEST(HInfinityNorm, NeedsSixtyFourSamples) {
  std::vector<double> y(64), e(64);
  for (std::size_t k = 0; k < y.size(); ++k) {
    y[k] = std::sin(0.7 * static_cast<double>(k));
    e[k] = 0.5 * y[k];
  }
  const HInfinityNorm norm = h_infinity_norm(y, e, {{0, 63}}, 1000.0, 400.0);
  EXPECT_TRUE(std::isnan(norm.value)) << "too short";
  EXPECT_NEAR(h_infinity_norm(y, e, {{0, 64}}, 1000.0, 400.0).value, 0.5, 1e-9);
}

TEST(Compare, NamesTheParametersThatHaveNoValue) {
  model::Model m = compared().model;
  m.find("viscous_friction")->find("coefficient")->value.reset();
  try {
    compare(compared().dataset, m, {});
    FAIL() << "a model without values was compared";
  } catch (const model::ModelError& error) {
    EXPECT_NE(std::string(error.what()).find("viscous_friction.coefficient"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("identify first"), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find("inertia.inertia"), std::string::npos) << error.what();
  }
}

TEST(Compare, ReportsTheSignalsThatEachExperimentHas) {
  const Comparison& c = compared().comparison;
  ASSERT_EQ(c.experiments.size(), 3u);
  const auto has = [&](std::size_t i, std::string_view signal) { return find(c.experiments[i], signal) != nullptr; };
  EXPECT_TRUE(has(0, "motor_balance") && has(0, "load_balance") && has(0, "output_position") && has(0, "torque"));
  EXPECT_FALSE(has(0, "transmission_balance"));
  EXPECT_TRUE(has(1, "motor_balance") && has(1, "transmission_balance") && has(1, "motor_position"));
  EXPECT_FALSE(has(1, "load_balance") || has(1, "output_position"));
  EXPECT_TRUE(has(2, "motor_balance"));
  EXPECT_EQ(c.experiments[1].role, data::Role::holdout);
}

TEST(Compare, OfTheTrueModelStandsNearTheNoiseFloorAndTheFreeRunFollows) {
  for (const char* signal : {"motor_balance", "transmission_balance", "load_balance"}) {
    const SignalResult* s = compared().comparison.find_overall(signal);
    ASSERT_NE(s, nullptr);
    ASSERT_TRUE(s->excess().has_value()) << signal;
    EXPECT_GT(*s->excess(), 0.8) << signal;
    EXPECT_LT(*s->excess(), 2.0) << signal;
    EXPECT_FALSE(s->collapsed);
  }
  EXPECT_LT(find(compared().comparison.experiments[0], "motor_velocity")->nrmse, 0.01);
  EXPECT_LT(find(compared().comparison.experiments[1], "motor_position")->nrmse, 0.02);
}

TEST(Compare, ShowsAWrongStiffnessInTheBalanceThatItActsOnAndInLockedFreeRun) {
  model::Model wrong = compared().model;
  *wrong.find("linear_stiffness")->find("stiffness")->value *= 1.2;
  const Comparison c = compare(compared().dataset, wrong, {});
  EXPECT_GT(*c.find_overall("transmission_balance")->excess(), 5.0);
  EXPECT_DOUBLE_EQ(c.find_overall("motor_balance")->rmse, compared().comparison.find_overall("motor_balance")->rmse);
  EXPECT_GT(find(c.experiments[1], "motor_position")->nrmse, 0.1);
  EXPECT_LT(find(c.experiments[1], "torque")->nrmse, 0.1);  // the current dictates the torque
  const auto worst = std::max_element(c.regions.begin(), c.regions.end(), [](const Region& a, const Region& b) {
    return (std::isfinite(a.excess) ? a.excess : 0.0) < (std::isfinite(b.excess) ? b.excess : 0.0);
  });
  EXPECT_EQ(worst->signal, "transmission_balance");
}

TEST(Compare, RegionsHoldEveryRowOfASignalOnceAVariable) {
  const Comparison& c = compared().comparison;
  std::size_t rows = 0;
  double squares = 0.0;
  for (const Region& r : c.regions) {
    EXPECT_GE(r.samples, 30u);
    EXPECT_LT(r.low, r.high);
    if (r.signal != "motor_balance" || r.variable != "velocity") continue;
    rows += r.samples;
    squares += r.rmse * r.rmse * static_cast<double>(r.samples);
  }
  const SignalResult* s = c.find_overall("motor_balance");
  // A bin of less than 30 rows is left out.
  EXPECT_GE(rows + 60, s->samples);
  EXPECT_LE(rows, s->samples);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(rows)) / s->rmse, 1.0, 0.05);
}

TEST(Compare, WithoutATorqueSensorMotorAndLoadAreOneBalance) {
  data::Dataset dataset = compared().dataset;
  dataset.experiments.resize(1);
  dataset.experiments[0][data::Column::torque].clear();
  dataset.experiments[0].noise_std = {};
  model::Model m = compared().model;
  std::erase_if(m.effects, [](const model::Effect& e) {
    return catalogue::get(e.type).info->balance == catalogue::Balance::transmission;
  });
  const Comparison c = compare(dataset, m, {});
  ASSERT_NE(c.find_overall("motor_balance"), nullptr);
  EXPECT_TRUE(c.find_overall("motor_balance")->collapsed);
  EXPECT_EQ(c.find_overall("load_balance"), nullptr);
  EXPECT_EQ(c.find_overall("torque"), nullptr);
  EXPECT_LT(c.find_overall("motor_balance")->nrmse, 0.02);
}

TEST(Compare, JsonHasTheFieldsOfItsFormatAndNullForWhatIsNotKnown) {
  const nlohmann::json j = output::comparison_json(compared().comparison);
  EXPECT_EQ(j["format"], "flexspline-compare/1");
  EXPECT_EQ(j["experiments"][1]["role"], "holdout");
  EXPECT_TRUE(j["parameter_trends"].is_array());
  for (const char* key : {"signal", "unit", "samples", "masked", "rmse", "nrmse", "fit_percent", "vaf_percent",
                          "max_abs", "worst_case_gain", "noise_floor", "noise_floor_from", "collapsed"})
    EXPECT_TRUE(j["overall"][0].contains(key)) << key;
  for (const char* key : {"signal", "variable", "low", "high", "samples", "bias", "rmse", "excess"})
    EXPECT_TRUE(j["regions"][0].contains(key)) << key;
  for (const auto& s : j["overall"])
    if (s["signal"] == "motor_velocity") {
      EXPECT_TRUE(s["noise_floor"].is_null());
      EXPECT_EQ(s["noise_floor_from"], "none");
    }
  EXPECT_EQ(j["overall"][0]["noise_floor_from"], "propagated");
}

TEST(Compare, TableLeavesWarningsToStandardError) {
  Comparison found = compare(compared().dataset, compared().model, {});
  found.warnings.emplace_back("a warning of its own");
  EXPECT_EQ(output::comparison_table(found).find("a warning of its own"), std::string::npos);
  EXPECT_EQ(output::comparison_json(found)["warnings"].back(), "a warning of its own");
}

TEST(Compare, TableHasExperimentsInTheOrderOfTheDataThenTheWorstAndThreeRegionsInWords) {
  model::Model wrong = compared().model;
  *wrong.find("linear_stiffness")->find("stiffness")->value *= 1.2;
  const std::string text = output::comparison_table(compare(compared().dataset, wrong, {}));
  const auto locked = text.find("locked (hold-out)"), free = text.find("\nfree");
  ASSERT_NE(locked, std::string::npos);
  ASSERT_NE(free, std::string::npos);
  const auto& experiments = compared().dataset.experiments;
  const auto index_of = [&](std::string_view name) {
    return std::find_if(experiments.begin(), experiments.end(), [&](const auto& e) { return e.name == name; }) -
           experiments.begin();
  };
  EXPECT_EQ(locked < free, index_of("locked") < index_of("free"));
  EXPECT_NE(text.find("over its noise or else its signal: locked (hold-out)\n"), std::string::npos) << text;
  std::size_t sentences = 0;
  for (std::size_t at = text.find("  The "); at != std::string::npos; at = text.find("  The ", at + 1)) ++sentences;
  EXPECT_EQ(sentences, 3u);
  EXPECT_NE(text.find("times the noise"), std::string::npos);
  EXPECT_NE(text.find("The transmission balance at "), std::string::npos) << text;
}

TEST(Compare, ATemperatureThatHardlyChangesIsNotSplit) {
  data::Dataset dataset = compared().dataset;
  for (data::Experiment& e : dataset.experiments) {
    std::vector<double>& temperature = e[data::Column::temperature];
    temperature.resize(e.size());
    for (std::size_t k = 0; k < e.size(); ++k)
      temperature[k] = 31.0 + 0.05 * static_cast<double>(k) / static_cast<double>(e.size());
  }
  const auto over_temperature = [](const Comparison& c) {
    return std::count_if(c.regions.begin(), c.regions.end(),
                         [](const Region& r) { return r.variable == "temperature"; });
  };
  EXPECT_EQ(over_temperature(compare(dataset, compared().model, {})), 0);
  for (data::Experiment& e : dataset.experiments)
    for (double& t : e[data::Column::temperature]) t = 31.0 + 200.0 * (t - 31.0);
  EXPECT_GT(over_temperature(compare(dataset, compared().model, {})), 0);
}

}  // namespace
}  // namespace flexspline::comparison::comparison_compare_test
