#include "host/engine/estimation/identify.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/written_experiment.hpp"

namespace flexspline::estimation::estimation_identify_test {
namespace {

using data::Column;

constexpr double kPi = 3.14159265358979323846;

struct Sine {
  double amplitude, frequency_hz, phase;
};
using Motion = std::vector<Sine>;
using Law = std::function<double(double q, double w, double a)>;  // torque of the motor

double sign(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

// An axis whose motion and torque are written down, not simulated.
data::Experiment experiment(std::string name, const Motion& motion, const Law& law, double seconds = 5.0,
                            double sample_s = 1e-3) {
  data::Experiment e;
  e.name = std::move(name);
  e.sample_s = sample_s;
  e.current_hold = data::CurrentHold::none;
  const auto n = static_cast<std::size_t>(std::lround(seconds / sample_s));
  for (std::size_t k = 0; k < n; ++k) {
    const double t = static_cast<double>(k) * sample_s;
    double q = 0.0, w = 0.0, a = 0.0;
    for (const Sine& s : motion) {
      const double rate = 2.0 * kPi * s.frequency_hz, angle = rate * t + s.phase;
      q += s.amplitude * std::sin(angle);
      w += s.amplitude * rate * std::cos(angle);
      a -= s.amplitude * rate * rate * std::sin(angle);
    }
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(law(q, w, a));
  }
  e.segments = {{0, n}};
  return e;
}

const Motion kLively{{3.0, 1.0, 0.3}, {0.4, 2.7, 1.0}, {0.1, 5.3, 2.0}};
const Motion kOther{{2.0, 0.8, 1.1}, {0.5, 2.1, 0.2}, {0.15, 4.9, 0.0}};

constexpr double kInertia = 1e-3, kViscous = 4e-3, kCoulomb = 0.05;

double plain(double, double w, double a) {
  return kInertia * a + kViscous * w + kCoulomb * sign(w);
}

model::Model model_of(const std::vector<std::string>& effects) {
  model::Model m;
  for (const std::string& name : effects)
    m.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return m;
}

const std::vector<std::string> kPlain{"inertia", "viscous_friction", "coulomb_friction"};
const PipelineOptions kOptions{40.0, true};

data::Dataset dataset_of(std::vector<data::Experiment> experiments) {
  data::Dataset d;
  d.experiments = std::move(experiments);
  return d;
}

const Estimate& estimate(const Identification& found, std::string_view effect, std::string_view parameter) {
  for (const Estimate& e : found.estimates)
    if (e.effect == effect && e.parameter == parameter) return e;
  throw std::out_of_range(std::string(effect));
}

double value(const Identification& found, std::string_view effect, std::string_view parameter) {
  return estimate(found, effect, parameter).value;
}

bool warns_of(const Identification& found, std::string_view what) {
  for (const std::string& w : found.warnings)
    if (w.find(what) != std::string::npos) return true;
  return false;
}

// A vertical axis that friction holds while the drive is off: its sensor then reads its offset, not the weight.
TEST(Identify, AtRestFrictionHoldsTheWeightAndTheSensorReadsItsOffset) {
  constexpr double kWeight = 0.03, kOffset = 0.01;
  const auto law = [](double q, double w, double a) { return plain(q, w, a) + kWeight * std::cos(2.0 * q) + kOffset; };
  data::Experiment rest = experiment("rest", {}, [](double, double, double) { return kOffset; });
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 1e-4);
  for (double& torque : rest[Column::motor_torque]) torque += noise(random);
  model::Model model = model_of({"inertia", "viscous_friction", "coulomb_friction", "torque_bias", "torque_ripple"});
  model.effects.back().find("order")->value = 2.0;
  const auto found = identify(dataset_of({experiment("lively", kLively, law), experiment("other", kOther, law), rest}),
                              model, kOptions);
  for (const Estimate& e : found->estimates) {
    if (e.effect == "torque_bias") {
      EXPECT_NEAR(e.value, kOffset, 2e-4);
    }
    if (e.parameter == "cosine") {
      EXPECT_NEAR(e.value, kWeight, 5e-4);
    }
  }
}

TEST(Identify, FindsTheParametersOfAnExactExperiment) {
  const auto found = identify(dataset_of({experiment("a", kLively, plain)}), model_of(kPlain), kOptions);
  EXPECT_NEAR(value(*found, "inertia", "inertia") / kInertia, 1.0, 1e-3);
  EXPECT_NEAR(value(*found, "viscous_friction", "coefficient") / kViscous, 1.0, 1e-3);
  EXPECT_NEAR(value(*found, "coulomb_friction", "torque") / kCoulomb, 1.0, 1e-3);
  EXPECT_EQ(estimate(*found, "inertia", "inertia").unit, "kg*m^2");
  EXPECT_EQ(*found->model.find("coulomb_friction")->find("torque")->value, value(*found, "coulomb_friction", "torque"));
}

TEST(Identify, FixedParametersGoToTheLeftSideAndStayAsTheyAre) {
  model::Model model = model_of(kPlain);
  model::Parameter& fixed = *model.find("viscous_friction")->find("coefficient");
  fixed.value = kViscous;
  fixed.fixed = true;
  const data::Dataset dataset = dataset_of({experiment("a", kLively, plain)});
  const auto found = identify(dataset, model, kOptions);
  EXPECT_NEAR(value(*found, "inertia", "inertia") / kInertia, 1.0, 1e-3);
  EXPECT_NEAR(value(*found, "coulomb_friction", "torque") / kCoulomb, 1.0, 1e-3);
  // A wrong value is the user's: kept, and paid for by the others.
  fixed.value = 0.5 * kViscous;
  const auto wrong = identify(dataset, model, kOptions);
  EXPECT_EQ(*wrong->model.find("viscous_friction")->find("coefficient")->value, 0.5 * kViscous);
  EXPECT_GT(value(*wrong, "coulomb_friction", "torque"), 1.2 * kCoulomb);
  EXPECT_GT(wrong->fits[0].rmse(), 20.0 * found->fits[0].rmse());
}

// A rotor with viscous friction under a torque that is held for each sample has an exact solution.
data::Experiment held(data::CurrentHold hold) {
  data::Experiment e;
  e.name = "held";
  e.sample_s = 1e-3;
  e.current_hold = hold;
  const double decay = std::exp(-kViscous * e.sample_s / kInertia), rate = kViscous / kInertia;
  double q = 0.0, w = 10.0;  // never reverses
  for (std::size_t k = 0; k < 5000; ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    const double torque =
        10.0 * kViscous + 0.02 * std::sin(2.0 * kPi * 5.0 * t) + 0.04 * std::sin(2.0 * kPi * 11.0 * t + 1.0);
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(torque);
    const double settled = torque / kViscous;
    q += settled * e.sample_s + (w - settled) * (1.0 - decay) / rate;
    w = settled + (w - settled) * decay;
  }
  e.segments = {{0, 5000}};
  return e;
}

TEST(Identify, AHeldEffortIsAlignedByHalfASample) {
  const model::Model model = model_of({"inertia", "viscous_friction"});
  const auto aligned = identify(dataset_of({held(data::CurrentHold::zoh)}), model, kOptions);
  const auto early = identify(dataset_of({held(data::CurrentHold::none)}), model, kOptions);
  EXPECT_NEAR(value(*aligned, "viscous_friction", "coefficient") / kViscous, 1.0, 2e-3);
  EXPECT_NEAR(value(*aligned, "inertia", "inertia") / kInertia, 1.0, 2e-3);
  EXPECT_LT(aligned->fits[0].rmse(), 0.05 * early->fits[0].rmse());
  const auto delay = [](const Identification& found) {
    const Eigen::VectorXd& slope = found.data[0].delay_column();
    return slope.dot(found.fits[0].residual) / slope.squaredNorm();
  };
  EXPECT_NEAR(delay(*aligned), 0.0, 1e-5);
  EXPECT_NEAR(delay(*early), -0.5e-3, 0.5e-4) << "an effort that stands half a sample too early";
}

// Beside a torque sensor most of the effort goes through the gear; a late current is late with that part, too.
TEST(Identify, ALateEffortBesideATorqueSensorIsLateByThatTime) {
  constexpr double kLate_s = 0.6e-3, kThroughGear_nm = 0.3;
  data::Experiment e = tests::written_experiment("late", 1e-3, 8000, [](double t, data::Experiment& record) {
    const auto gear = [](double at) { return kThroughGear_nm * std::sin(2.0 * kPi * 1.7 * at); };
    const auto rate = [](double at) {
      return 5.0 * std::cos(2.0 * kPi * 0.4 * at) + 2.0 * std::cos(2.0 * kPi * 1.3 * at);
    };
    const auto slope = [](double at) {
      return -2.0 * kPi * (0.4 * 5.0 * std::sin(2.0 * kPi * 0.4 * at) + 1.3 * 2.0 * std::sin(2.0 * kPi * 1.3 * at));
    };
    const auto effort = [&](double at) { return kInertia * slope(at) + kViscous * rate(at) + gear(at); };
    record[Column::motor_position].push_back(5.0 / (2.0 * kPi * 0.4) * std::sin(2.0 * kPi * 0.4 * t) +
                                             2.0 / (2.0 * kPi * 1.3) * std::sin(2.0 * kPi * 1.3 * t));
    record[Column::motor_torque].push_back(effort(t - kLate_s));
    record[Column::torque].push_back(gear(t));
  });
  e.current_hold = data::CurrentHold::none;
  const auto found = identify(dataset_of({e}), model_of({"inertia", "viscous_friction"}), kOptions);
  const Eigen::VectorXd& slope = found->data[0].delay_column();
  EXPECT_NEAR(slope.dot(found->fits[0].residual) / slope.squaredNorm(), kLate_s, 0.1 * kLate_s);
}

TEST(Identify, WithoutATorqueSensorLoadTermsReachTheMotorOverTheGearRatio) {
  constexpr double kRatio = 50.0, kOutputInertia = 2.0, kOutputViscous = 8.0, kCosine = -1.5, kSine = 4.0;
  const Law law = [&](double q, double w, double a) {
    const double load = kOutputInertia * a / kRatio + kOutputViscous * w / kRatio + kCosine * std::cos(q / kRatio) +
                        kSine * std::sin(q / kRatio);
    return kInertia * a + kCoulomb * sign(w) + load / kRatio;
  };
  model::Model model =
      model_of({"inertia", "coulomb_friction", "output_inertia", "output_viscous_friction", "gravity"});
  model.drive.gear_ratio.value = kRatio;
  model.find("inertia")->find("inertia")->value = kInertia;
  model.find("inertia")->find("inertia")->fixed = true;
  const Motion wide{{60.0, 0.4, 0.3}, {0.4, 2.7, 1.0}, {0.1, 5.3, 2.0}};
  data::Experiment e = experiment("load", wide, law);
  const auto found = identify(dataset_of({e}), model, kOptions);
  ASSERT_EQ(found->data.size(), 1u);
  EXPECT_NEAR(value(*found, "output_inertia", "inertia"), kOutputInertia, 0.01);
  EXPECT_NEAR(value(*found, "output_viscous_friction", "coefficient"), kOutputViscous, 0.04);
  EXPECT_NEAR(value(*found, "gravity", "cosine"), kCosine, 0.01);
  EXPECT_NEAR(value(*found, "gravity", "sine"), kSine, 0.02);
  // A known torque on the output comes through the gear as well.
  for (std::size_t k = 0; k < e.size(); ++k) {
    e[Column::load_torque].push_back(5.0 * std::cos(2.0 * kPi * 1.3 * e.time_s[k]));
    e[Column::motor_torque][k] += e[Column::load_torque][k] / kRatio;
  }
  const auto loaded = identify(dataset_of({e}), model, kOptions);
  EXPECT_NEAR(value(*loaded, "output_inertia", "inertia"), kOutputInertia, 0.01);
}

TEST(Identify, InLockedLoadTheSpringReachesTheMotorOverTheGearRatio) {
  constexpr double kRatio = 50.0, kStiffness = 5000.0;
  const Law law = [&](double q, double w, double a) {
    return kInertia * a + kViscous * w + kStiffness * q / kRatio / kRatio;
  };
  model::Model model = model_of({"inertia", "viscous_friction", "linear_stiffness"});
  model.drive.gear_ratio.value = kRatio;
  data::Experiment e = experiment("locked", {{0.5, 0.5, 0.0}, {0.05, 6.0, 0.0}}, law);
  e.load = data::Load::locked;
  const auto found = identify(dataset_of({e}), model, kOptions);
  EXPECT_NEAR(value(*found, "linear_stiffness", "stiffness") / kStiffness, 1.0, 1e-3);
}

TEST(Identify, WithATorqueSensorEachBalanceHasItsOwnTerms) {
  constexpr double kRatio = 50.0, kOutputInertia = 2.0, kOutputViscous = 8.0;
  const auto load = [&](double w, double a) { return (kOutputInertia * a + kOutputViscous * w) / kRatio; };
  data::Experiment e =
      experiment("sensor", kLively, [&](double q, double w, double a) { return plain(q, w, a) + load(w, a) / kRatio; });
  // The torque, from a second axis that moves likewise.
  e[Column::torque] =
      experiment("", kLively, [&](double, double w, double a) { return load(w, a); })[Column::motor_torque];
  model::Model model = model_of(kPlain);
  for (const char* name : {"output_inertia", "output_viscous_friction"})
    model.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  model.drive.gear_ratio.value = kRatio;
  const auto found = identify(dataset_of({e}), model, kOptions);
  ASSERT_EQ(found->data.size(), 2u);
  EXPECT_EQ(found->data[0].balance(), Balance::motor);
  EXPECT_EQ(found->data[1].balance(), Balance::load);
  EXPECT_NEAR(value(*found, "inertia", "inertia") / kInertia, 1.0, 1e-3);
  EXPECT_NEAR(value(*found, "coulomb_friction", "torque") / kCoulomb, 1.0, 1e-3);
  EXPECT_NEAR(value(*found, "output_inertia", "inertia") / kOutputInertia, 1.0, 1e-3);
  EXPECT_NEAR(value(*found, "output_viscous_friction", "coefficient") / kOutputViscous, 1.0, 1e-3);
}

TEST(Identify, SpreadIsTheSampleDeviationOverTheAverageOfTheExperiments) {
  std::vector<data::Experiment> experiments;
  for (const double share : {0.9, 1.0, 1.1})
    experiments.push_back(experiment(std::to_string(share), kLively, [&](double q, double w, double a) {
      return plain(q, w, a) + (share - 1.0) * kViscous * w;
    }));
  const auto found = identify(dataset_of(std::move(experiments)), model_of(kPlain), kOptions);
  const Estimate& viscous = estimate(*found, "viscous_friction", "coefficient");
  ASSERT_EQ(viscous.per_experiment.size(), 3u);
  EXPECT_NEAR(*viscous.per_experiment[0].value / kViscous, 0.9, 2e-3);
  EXPECT_NEAR(*viscous.average / kViscous, 1.0, 1e-3);
  // Deviations -0.1, 0, 0.1 have sqrt(0.02 / 2) = 0.1 with n - 1 and 0.082 with n.
  EXPECT_NEAR(*viscous.spread_percent, 10.0, 0.2);
  EXPECT_EQ(viscous.reliable, std::optional(true));
}

// Their scatter is what makes the average uncertain: they are not reliable, and it is said by how much.
TEST(Identify, ExperimentsThatDifferBeyondTheirErrorsAreUnreliableEvenAroundZero) {
  std::vector<data::Experiment> experiments;
  for (const double bias : {-0.010, 0.013, 0.003})
    experiments.push_back(
        experiment(std::to_string(bias), kLively, [&](double q, double w, double a) { return plain(q, w, a) + bias; }));
  model::Model model = model_of({"inertia", "viscous_friction", "coulomb_friction", "torque_bias"});
  const auto found = identify(dataset_of(std::move(experiments)), model, kOptions);
  const Estimate& bias = estimate(*found, "torque_bias", "torque");
  EXPECT_NEAR(*bias.average, 0.002, 1e-4);
  EXPECT_GT(bias.spread_percent.value(), 500.0);
  EXPECT_EQ(bias.reliable, std::optional(false));
}

TEST(Identify, TwoExperimentsAreNoVerdictOnReliability) {
  std::vector<data::Experiment> experiments;
  for (const char* name : {"a", "b"}) experiments.push_back(experiment(name, kLively, plain));
  const auto found = identify(dataset_of(std::move(experiments)), model_of(kPlain), kOptions);
  const Estimate& viscous = estimate(*found, "viscous_friction", "coefficient");
  EXPECT_EQ(viscous.counted(), 2u);
  EXPECT_FALSE(viscous.reliable);
}

TEST(Identify, DirectionsAreSumAndDifferenceAndTheirSpreadJudgesTheAsymmetry) {
  constexpr double kViscousOdd = 1e-3, kCoulombOdd = -0.004;
  std::vector<data::Experiment> experiments;
  for (const double share : {0.8, 1.2})
    experiments.push_back(experiment(std::to_string(share), kLively, [&](double q, double w, double a) {
      return plain(q, w, a) + share * kViscousOdd * std::abs(w) + kCoulombOdd;
    }));
  const auto found =
      identify(dataset_of(std::move(experiments)),
               model_of({"inertia", "viscous_friction", "viscous_asymmetry", "coulomb_friction", "coulomb_asymmetry"}),
               kOptions);
  ASSERT_EQ(found->derived.size(), 4u);
  const std::vector<std::pair<std::string, double>> truth{{"Tvp", kViscous + kViscousOdd},
                                                          {"Tvn", kViscous - kViscousOdd},
                                                          {"Tsp", kCoulomb + kCoulombOdd},
                                                          {"Tsn", kCoulomb - kCoulombOdd}};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(found->derived[k].name, truth[k].first);
    EXPECT_NEAR(found->derived[k].value / truth[k].second, 1.0, 3e-3) << truth[k].first;
  }
  EXPECT_EQ(found->derived[0].unit, "N*m*s/rad");
  // Values 4.8e-3, 5.2e-3 and 3.2e-3, 2.8e-3: of two values, the deviation is the difference over sqrt(2).
  const auto& odd = estimate(*found, "viscous_asymmetry", "coefficient");
  ASSERT_TRUE(odd.spread_percent);
  EXPECT_NEAR(*odd.spread_percent, 100.0 * 0.4e-3 / std::sqrt(2.0) / 3.0e-3, 0.3);
}

TEST(Identify, WhatTheDataCannotTellIsLeftAtZeroWithAWarning) {
  // Over one stroke without reversal, Coulomb friction is a bias.
  const Law law = [](double q, double w, double a) { return plain(q, w, a); };
  data::Experiment e =
      experiment("one way", {{0.4, 2.7, 1.0}, {0.1, 5.3, 2.0}}, [](double, double, double) { return 0.0; });
  for (std::size_t k = 0; k < e.size(); ++k) e[Column::motor_position][k] += 20.0 * e.time_s[k];
  data::Experiment torque = experiment("", {{0.4, 2.7, 1.0}, {0.1, 5.3, 2.0}},
                                       [&](double q, double w, double a) { return law(q, w + 20.0, a); });
  e[Column::motor_torque] = torque[Column::motor_torque];
  const auto found =
      identify(dataset_of({e}), model_of({"inertia", "viscous_friction", "coulomb_friction", "torque_bias"}), kOptions);
  EXPECT_NEAR(value(*found, "coulomb_friction", "torque") / kCoulomb, 1.0, 5e-3);
  EXPECT_EQ(value(*found, "torque_bias", "torque"), 0.0);
  EXPECT_FALSE(estimate(*found, "torque_bias", "torque").identifiable);
  EXPECT_FALSE(estimate(*found, "torque_bias", "torque").std);
  EXPECT_TRUE(estimate(*found, "coulomb_friction", "torque").identifiable);
  EXPECT_TRUE(warns_of(*found, "torque_bias.torque cannot be distinguished from coulomb_friction"));
}

TEST(Identify, ARecordWithTheDriveOffDistinguishesAnOffsetFromAnAsymmetry) {
  constexpr double kBias = 0.006, kOdd = 0.004;
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 1e-4);
  const Law moving = [&](double q, double w, double a) { return plain(q, w, a) + kOdd + kBias + noise(random); };
  const data::Experiment motion = experiment("moving", kLively, moving);
  const data::Experiment off = experiment("off", {}, [&](double, double, double) { return kBias + noise(random); });
  const model::Model model =
      model_of({"inertia", "viscous_friction", "coulomb_friction", "coulomb_asymmetry", "torque_bias"});
  const auto found = identify(dataset_of({motion, off}), model, kOptions);
  EXPECT_NEAR(value(*found, "torque_bias", "torque"), kBias, 1e-4);
  EXPECT_NEAR(value(*found, "coulomb_asymmetry", "torque"), kOdd, 1e-4);
  const auto without = identify(dataset_of({motion}), model, kOptions);
  EXPECT_FALSE(estimate(*without, "torque_bias", "torque").identifiable);
  EXPECT_NEAR(value(*without, "coulomb_asymmetry", "torque"), kOdd + kBias, 1e-4) << "stands for both";
}

TEST(Identify, FitsOnlyExperimentsOfRoleFit) {
  data::Experiment other = experiment("holdout", kOther, [](double, double, double) { return 1.0; });
  other.role = data::Role::holdout;
  const auto found = identify(dataset_of({experiment("a", kLively, plain), other}), model_of(kPlain), kOptions);
  EXPECT_EQ(found->prepared.records.size(), 1u);
  EXPECT_NEAR(value(*found, "inertia", "inertia") / kInertia, 1.0, 1e-3);
  EXPECT_THROW(identify(dataset_of({other}), model_of(kPlain), kOptions), data::DataError);
}

TEST(Identify, IntervalsOfWhiteNoiseCoverTheTruth) {
  constexpr int kSeeds = 200;
  // Some 1500 rows: from a few hundred, the autocorrelation time comes out 15 % short and intervals cover 90 %.
  data::Dataset dataset = dataset_of({experiment("a", {{3.0, 1.0, 0.3}, {0.3, 3.1, 1.0}}, plain, 16.0, 4e-3)});
  const std::vector<double> exact = dataset.experiments[0][Column::motor_torque];
  const model::Model model = model_of(kPlain);
  const PipelineOptions options{25.0, true};
  const auto without = identify(dataset, model, options);
  std::vector<int> covered(3, 0);
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, 0.02);
    for (std::size_t k = 0; k < exact.size(); ++k)
      dataset.experiments[0][Column::motor_torque][k] = exact[k] + noise(random);
    const auto found = identify(dataset, model, options);
    for (std::size_t j = 0; j < 3; ++j) {
      const Estimate& e = found->estimates[j];
      // Truth as the coarse sampling shows it: central differences are some 1e-4 short.
      const double truth = without->estimates[j].value;
      covered[j] += *e.low <= truth && truth <= *e.high;
    }
  }
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_GE(covered[j], kSeeds * 90 / 100) << without->estimates[j].id;
    EXPECT_LE(covered[j], kSeeds * 98 / 100) << without->estimates[j].id;
  }
}

TEST(Identify, IntervalsOfExactDataAreAsWideAsWhatFiltersLeave) {
  const auto found =
      identify(dataset_of({experiment("a", {{3.0, 1.0, 0.3}, {0.3, 3.1, 1.0}}, plain)}), model_of(kPlain), kOptions);
  for (const Estimate& e : found->estimates) {
    EXPECT_GE(*e.std, 5e-4 * std::abs(e.value)) << e.id;
    EXPECT_LT(*e.std, 1e-3 * std::abs(e.value)) << e.id;
  }
}

// Friction that jumps at the reversal has no presliding that could be distinguished from zero.
TEST(Identify, AnIntervalOfALengthThatStoppedAtTheShortEndBeginsAtZero) {
  const auto found = identify(dataset_of({experiment("a", {{3.0, 1.0, 0.3}, {0.3, 3.1, 1.0}}, plain)}),
                              model_of({"inertia", "viscous_friction", "dahl_friction"}), kOptions);
  EXPECT_TRUE(warns_of(*found, "dahl_friction.presliding stopped at the end"));
  const Estimate& presliding = estimate(*found, "dahl_friction", "presliding");
  EXPECT_GT(presliding.value, 0.0);
  EXPECT_LE(*presliding.low, catalogue::get("dahl_friction").parameters[1].low);
}

// Records of one motion and noise count alike, so that the mean over them has the deviation of one over the root of
// their number. The noise is so loud that the differences do not show in it.
TEST(Identify, IntervalsGrowWithTheDifferencesOfFrictionBetweenRecords) {
  const std::vector<double> factors{0.94, 0.97, 1.0, 1.03, 1.06};
  constexpr double kDeviation = 0.0474342;  // of these, with n-1
  constexpr double kStudent = 2.776445;     // four degrees of freedom, 95 %
  for (const bool differs : {true, false}) {
    std::vector<data::Experiment> records;
    for (std::size_t i = 0; i < factors.size(); ++i) {
      const double viscous = kViscous * (differs ? factors[i] : 1.0);
      std::mt19937 random(static_cast<unsigned>(401 + i));
      std::normal_distribution<double> noise(0.0, 0.02);
      records.push_back(experiment("r" + std::to_string(i), kLively, [&](double, double w, double a) {
        return kInertia * a + viscous * w + kCoulomb * sign(w) + noise(random);
      }));
    }
    const auto found = identify(dataset_of(std::move(records)), model_of(kPlain), kOptions);
    const Estimate& e = estimate(*found, "viscous_friction", "coefficient");
    const double half = 0.5 * (*e.high - *e.low) / kViscous;
    if (differs)
      EXPECT_NEAR(half, kStudent * kDeviation / std::sqrt(5.0), 0.25 * half);
    else
      EXPECT_LT(half, 0.02);
  }
}

TEST(Reconcile, TheModelWinsOverTheDataSetWithAWarningAboveAThousandth) {
  model::Drive drive;
  drive.gear_ratio.value = 100.0;
  drive.torque_constant_nm_a.value = 0.05;
  data::Dataset dataset;
  dataset.drive.gear_ratio = 100.09;
  dataset.drive.torque_constant_nm_a = 0.0502;
  dataset.drive.pitch_m = 0.005;
  std::vector<std::string> warnings;
  const model::Drive result = reconcile(drive, dataset, warnings);
  EXPECT_EQ(*result.gear_ratio.value, 100.0);
  EXPECT_EQ(*result.torque_constant_nm_a.value, 0.05);
  EXPECT_EQ(*result.pitch_m.value, 0.005) << "only the data set knows it";
  EXPECT_EQ(result.pitch_m.source, "data set");
  ASSERT_EQ(warnings.size(), 1u) << "the gear ratios differ by less than 0.1 %";
  EXPECT_NE(warnings[0].find("torque_constant_nm_a is 0.05 in the model and 0.0502"), std::string::npos) << warnings[0];
}

TEST(Reconcile, AnotherKindOfAxisIsSaid) {
  data::Dataset dataset;
  dataset.drive.axis = data::Axis::linear;
  std::vector<std::string> warnings;
  EXPECT_EQ(reconcile({}, dataset, warnings).axis, data::Axis::rotary);
  EXPECT_EQ(warnings.size(), 1u);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_identify_test
