// Black boxes compared with a model: on a drive that is linear both are right; on one with dry friction only the model
// is.
#include "host/engine/comparison/black_box_baseline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/engine/comparison/compare.hpp"
#include "host/output/answers/comparison.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::comparison::comparison_black_box_baseline_test {
namespace {

using data::Column;

constexpr double kInertia = 1e-4, kViscous = 1e-3, kSample = 1e-3;

model::Model linear_model() {
  model::Model model;
  model.name = "linear";
  model.drive.gear_ratio.value = 100.0;
  model.drive.torque_constant_nm_a.value = 1.0;
  model.drive.rated_velocity_rad_s.value = 200.0;
  for (const auto& [type, value] : {std::pair{"inertia", kInertia}, std::pair{"viscous_friction", kViscous}}) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(type), data::Axis::rotary);
    effect.parameters[0].value = value;
    model.effects.push_back(effect);
  }
  return model;
}

// J v' + Tv v = torque under three sines, in closed form; turned on long before the record begins.
data::Experiment linear_experiment(const std::string& name, double phase, data::Role role) {
  data::Experiment e;
  e.name = name;
  e.role = role;
  e.sample_s = kSample;
  e.current_hold = data::CurrentHold::none;
  const std::size_t n = 6000;
  e.segments = {{0, n}};
  e.masked.assign(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    const double t = kSample * static_cast<double>(k);
    double torque = 0.0, position = 0.0;
    for (const double hz : {0.7, 2.3, 5.1}) {
      const double w = 2.0 * M_PI * hz, angle = w * t + phase * hz;
      const double gain = 0.02 / std::hypot(kInertia * w, kViscous), lag = std::atan2(kInertia * w, kViscous);
      torque += 0.02 * std::sin(angle);
      position -= gain / w * std::cos(angle - lag);
    }
    e.time_s.push_back(t);
    e[Column::current].push_back(torque);
    e[Column::motor_position].push_back(position);
  }
  return e;
}

data::Dataset linear_data() {
  data::Dataset dataset;
  dataset.experiments = {linear_experiment("one", 0.0, data::Role::fit), linear_experiment("two", 1.0, data::Role::fit),
                         linear_experiment("three", 2.0, data::Role::holdout)};
  return dataset;
}

std::vector<blackbox::Specification> boxes(std::initializer_list<const char*> texts) {
  std::vector<blackbox::Specification> all;
  for (const char* text : texts) all.push_back(blackbox::parse_specification(text));
  return all;
}

const BaselineResult* find(const Comparison& c, std::string_view requested, std::string_view signal) {
  for (const BaselineResult& b : c.baselines)
    if (b.requested == requested && b.signal == signal) return &b;
  return nullptr;
}

const Comparison& linear_comparison() {
  static const Comparison c = compare(linear_data(), linear_model(), {20.0, true}, boxes({"fir:1", "arx:1,2,1"}));
  return c;
}

TEST(BlackBoxBaseline, OnALinearMotorABlackBoxIsAsGoodAsTheModel) {
  // Acceleration and velocity of the same instant are all that the balance depends on.
  const BaselineResult* balance = find(linear_comparison(), "fir:1", "motor_balance");
  ASSERT_NE(balance, nullptr);
  EXPECT_EQ(balance->inputs, (std::vector<std::string>{"acceleration", "velocity"}));  // no torsion without a sensor
  EXPECT_EQ(balance->parameters, 3u);
  EXPECT_LT(balance->nrmse, 1e-3);
  EXPECT_LT(balance->rmse_holdout, 1.1 * balance->model_rmse_holdout + 1e-6);
  // One pole describes the motion from sample to sample; what is between two samples of the torque, two terms do.
  const BaselineResult* velocity = find(linear_comparison(), "arx:1,2,1", "motor_velocity");
  ASSERT_NE(velocity, nullptr);
  EXPECT_EQ(velocity->load, "free");
  EXPECT_TRUE(velocity->stable);
  EXPECT_LT(velocity->nrmse, 0.05);
  EXPECT_NEAR(velocity->largest_pole, std::exp(-kViscous / kInertia * velocity->sample_s), 0.03);
}

TEST(BlackBoxBaseline, HeldOutExperimentsAreJudgedButNotFitted) {
  const Comparison& c = linear_comparison();
  const BaselineResult* b = find(c, "fir:1", "motor_balance");
  ASSERT_NE(b, nullptr);
  ASSERT_EQ(b->experiments.size(), 3u);
  EXPECT_EQ(b->experiments[2].role, data::Role::holdout);
  EXPECT_DOUBLE_EQ(b->experiments[2].rmse, b->rmse_holdout);
  EXPECT_DOUBLE_EQ(b->experiments[2].model_rmse, b->model_rmse_holdout);
  // Other measurements in the held-out record change its own error and no other.
  data::Dataset other = linear_data();
  for (double& i : other.experiments[2][Column::current]) i *= 1.5;
  const Comparison changed = compare(other, linear_model(), {20.0, true}, boxes({"fir:1"}));
  const BaselineResult* after = find(changed, "fir:1", "motor_balance");
  EXPECT_DOUBLE_EQ(after->rmse_fit, b->rmse_fit);
  EXPECT_GT(after->rmse_holdout, 100.0 * b->rmse_holdout);
}

TEST(BlackBoxBaseline, OnADriveWithDryFrictionTheModelIsBetterByFarWithFewerParameters) {
  const plant::Drive drive = plant::demo_plant().drive;
  data::Dataset dataset = record(drive,
                                 {plan("slow", plant::Mode::velocity, plant::Waveform::sine, 60.0, 1.0, 4.0),
                                  plan("fast", plant::Mode::velocity, plant::Waveform::sine, 100.0, 0.7, 4.0),
                                  plan("locked", plant::Mode::current, plant::Waveform::sine, 2.0, 0.5, 4.0, true)},
                                 1);
  dataset.experiments[1].role = data::Role::holdout;
  const Comparison c = compare(dataset, known_model(drive), {}, boxes({"fir:20", "arx:auto"}));
  for (const char* requested : {"fir:20", "arx:auto"})
    for (const char* signal : {"motor_balance", "transmission_balance", "motor_velocity", "torque"}) {
      const BaselineResult* b = find(c, requested, signal);
      // An ARX that is stable on all that is left out need not exist; a FIR always does.
      EXPECT_TRUE(b || requested == std::string_view("arx:auto")) << signal;
      if (b && b->stable) {
        EXPECT_GT(b->rmse, 3.0 * b->model_rmse) << requested << " " << signal;
      }
    }
  // The model's figure is that of the comparison, but for the first samples that a black box takes as its past.
  const BaselineResult* balance = find(c, "fir:20", "motor_balance");
  EXPECT_NEAR(balance->model_rmse / c.find_overall("motor_balance")->rmse, 1.0, 0.1);
  EXPECT_GE(c.find_overall("motor_balance")->samples, balance->samples);
  EXPECT_GT(static_cast<double>(balance->samples), 0.9 * static_cast<double>(c.find_overall("motor_balance")->samples));
  // Free and locked records are different systems.
  std::size_t velocities = 0;
  for (const BaselineResult& b : c.baselines)
    velocities += b.requested == "fir:20" && b.signal == "motor_velocity" ? 1 : 0;
  EXPECT_EQ(velocities, 2u);
}

TEST(BlackBoxBaseline, WhatCannotBeFittedIsSaidAndTheRestIsThere) {
  const Comparison c = compare(linear_data(), linear_model(), {8.0, true}, boxes({"fir:200", "fir:1"}));
  EXPECT_EQ(find(c, "fir:200", "motor_balance"), nullptr);
  EXPECT_NE(find(c, "fir:1", "motor_balance"), nullptr);
  bool said = false;
  for (const std::string& w : c.warnings)
    said = said || (w.find("--baseline fir:200") != std::string::npos && w.find("motor_balance") != std::string::npos);
  EXPECT_TRUE(said);
}

TEST(BlackBoxBaseline, WithoutAnExperimentToFitTheWarningSaysSo) {
  data::Dataset dataset = linear_data();
  for (data::Experiment& e : dataset.experiments) e.role = data::Role::holdout;
  const Comparison c = compare(dataset, linear_model(), {20.0, true}, boxes({"fir:1"}));
  ASSERT_NE(find(c, "fir:1", "motor_balance"), nullptr);
  EXPECT_TRUE(std::isnan(find(c, "fir:1", "motor_balance")->rmse_fit));
  bool said = false;
  for (const std::string& w : c.warnings) said = said || w.find("held out") != std::string::npos;
  EXPECT_TRUE(said);
}

TEST(BlackBoxBaseline, TableAndJsonShowThemAndNothingWhereNoneIsAskedFor) {
  const nlohmann::json j = output::comparison_json(linear_comparison());
  ASSERT_FALSE(j["beside"].empty());
  for (const char* key : {"asked",      "black_box",          "signal",        "unit",     "load",
                          "inputs",     "parameters",         "sample_s",      "samples",  "rmse",
                          "nrmse",      "fit_percent",        "rmse_one_step", "rmse_fit", "rmse_holdout",
                          "model_rmse", "model_rmse_holdout", "largest_pole",  "stable",   "experiments"})
    EXPECT_TRUE(j["beside"][0].contains(key)) << key;
  EXPECT_NE(output::comparison_table(linear_comparison()).find("Baseline comparison"), std::string::npos);
  const Comparison plain = compare(linear_data(), linear_model(), {20.0, true});
  EXPECT_TRUE(output::comparison_json(plain)["beside"].empty());
  EXPECT_EQ(output::comparison_table(plain).find("Baseline comparison"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::comparison::comparison_black_box_baseline_test
