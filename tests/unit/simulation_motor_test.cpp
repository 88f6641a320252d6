// The free run of one mass against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::simulation_motor_test {
namespace {

using namespace flexspline;  // NOLINT(google-build-using-namespace): a test reads better without the prefix
using data::Column;

constexpr double kInertia = 1e-4;
constexpr double kSample = 1e-3;

using Parts = std::initializer_list<std::pair<std::string_view, std::vector<double>>>;

// Values in the order of the catalogue. Torque constant one: current is torque.
model::Model model_of(Parts parts, double gear_ratio = 100.0) {
  model::Model model;
  model.name = "test";
  model.drive.gear_ratio.value = gear_ratio;
  model.drive.torque_constant_nm_a.value = 1.0;
  model.drive.rated_velocity_rad_s.value = 200.0;
  model.drive.temperature_reference_c.value = 30.0;
  for (const auto& [type, values] : parts) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(type), data::Axis::rotary);
    for (std::size_t k = 0; k < values.size(); ++k) effect.parameters.at(k).value = values[k];
    model.effects.push_back(effect);
  }
  return model;
}

template <class Current>
data::Experiment record(std::size_t samples, Current&& current, double velocity = 0.0, double position = 0.0) {
  data::Experiment experiment;
  experiment.name = "made";
  experiment.sample_s = kSample;
  experiment.current_hold = data::CurrentHold::none;
  experiment.segments.push_back({0, samples});
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * kSample;
    experiment.time_s.push_back(t);
    experiment[Column::current].push_back(current(t));
    experiment[Column::motor_position].push_back(position);
    experiment[Column::motor_velocity].push_back(velocity);
  }
  // Only the first sample is read; the stated noise says that it is to be trusted.
  experiment.noise_std[static_cast<std::size_t>(Column::motor_velocity)] = 0.0;
  return experiment;
}

double nothing(double) {
  return 0.0;
}

TEST(Simulation, ViscousFrictionMakesTheVelocityDecayExponentially) {
  const auto model = model_of({{"inertia", {kInertia}}, {"viscous_friction", {3.6e-4}}});
  const auto experiment = record(1001, nothing, 100.0, 2.0);
  const auto run = simulation::run(model, experiment);
  const double tau = kInertia / 3.6e-4;
  for (std::size_t k = 0; k < experiment.size(); ++k) {
    const double left = std::exp(-experiment.time_s[k] / tau);
    ASSERT_NEAR(run.motor_velocity[k], 100.0 * left, 1e-6);
    ASSERT_NEAR(run.motor_position[k], 2.0 + 100.0 * tau * (1.0 - left), 1e-6);
    ASSERT_NEAR(run.motor_acceleration[k], -100.0 / tau * left, 0.05);
    ASSERT_NEAR(run.output_velocity[k], left, 1e-8);
  }
}

TEST(Simulation, CoulombFrictionStopsTheMotorOnTimeAndForGood) {
  const auto model = model_of({{"inertia", {kInertia}}, {"coulomb_friction", {0.045}}});
  for (const double start : {100.0, -100.0}) {
    const auto experiment = record(401, nothing, start);
    const auto run = simulation::run(model, experiment);
    const double deceleration = 0.045 / kInertia;
    const double stop = 100.0 / deceleration;  // 0.2222 s, between two samples
    for (std::size_t k = 0; k < experiment.size(); ++k) {
      const double t = experiment.time_s[k];
      if (t < stop) {
        ASSERT_NEAR(run.motor_velocity[k], start - std::copysign(deceleration * t, start), 1e-7);
      } else {
        ASSERT_EQ(run.motor_velocity[k], 0.0);
        ASSERT_NEAR(run.motor_position[k], std::copysign(0.5 * 100.0 * stop, start), 1e-8);
        ASSERT_EQ(run.motor_position[k], run.motor_position.back());
      }
    }
  }
}

TEST(Simulation, TheMotorRestsUntilTheCurrentBreaksItAway) {
  // Static friction 0.045 + 0.012 at rest; the ramp passes it at 0.57 s.
  const auto model =
      model_of({{"inertia", {kInertia}}, {"coulomb_friction", {0.045}}, {"stribeck_gaussian", {0.012, 0.012, 3.0}}});
  for (const double sign : {1.0, -1.0}) {
    const auto experiment = record(801, [&](double t) { return sign * 0.1 * t; });
    const auto run = simulation::run(model, experiment);
    for (std::size_t k = 0; k < experiment.size(); ++k) {
      if (experiment.time_s[k] <= 0.57) {
        ASSERT_EQ(run.motor_velocity[k], 0.0) << "at " << experiment.time_s[k];
      } else if (experiment.time_s[k] > 0.573) {
        ASSERT_GT(sign * run.motor_velocity[k], 0.0) << "at " << experiment.time_s[k];
      }
    }
    // Once it slides, friction falls and it leaps.
    EXPECT_GT(sign * run.motor_velocity.back(), 20.0);
  }
}

TEST(Simulation, AReversalUnderConstantCurrentIsFollowedThroughBothFrictions) {
  // Decelerates by current and friction, then accelerates by their difference.
  const auto model = model_of({{"inertia", {kInertia}}, {"coulomb_friction", {0.03}}});
  const auto experiment = record(
      501, [](double) { return -0.05; }, 123.0);
  const auto run = simulation::run(model, experiment);
  const double braking = 0.08 / kInertia;
  const double driving = 0.02 / kInertia;
  const double stop = 123.0 / braking;
  const double after = experiment.time_s.back() - stop;
  EXPECT_NEAR(run.motor_velocity.back(), -driving * after, 1e-6);
  EXPECT_NEAR(run.motor_position.back(), 0.5 * braking * stop * stop - 0.5 * driving * after * after, 1e-6);
}

TEST(Simulation, AsymmetricFrictionStopsSoonerInItsDirection) {
  const auto model = model_of({{"inertia", {kInertia}}, {"coulomb_friction", {0.045}}, {"coulomb_asymmetry", {0.015}}});
  const auto forward = simulation::run(model, record(801, nothing, 50.0));
  const auto backward = simulation::run(model, record(801, nothing, -50.0));
  EXPECT_NEAR(forward.motor_position.back(), 0.5 * 2500.0 * kInertia / 0.060, 1e-8);
  EXPECT_NEAR(backward.motor_position.back(), -0.5 * 2500.0 * kInertia / 0.030, 1e-8);
}

TEST(Simulation, AHeldCurrentActsFromItsSampleToTheNext) {
  const auto model = model_of({{"inertia", {kInertia}}});
  auto experiment = record(6, nothing);
  experiment[Column::current] = {0.1, -0.05, 0.02, 0.0, 0.04, 0.3};
  experiment.current_hold = data::CurrentHold::zoh;
  const auto held = simulation::run(model, experiment);
  experiment.current_hold = data::CurrentHold::none;
  const auto between = simulation::run(model, experiment);
  simulation::Options late;
  late.effort_shift_samples = 1.5;
  experiment.current_hold = data::CurrentHold::zoh;
  const auto shifted = simulation::run(model, experiment, late);
  const auto& current = experiment[Column::current];
  double held_sum = 0.0;
  double mean_sum = 0.0;
  for (std::size_t k = 1; k < 6; ++k) {
    held_sum += current[k - 1];
    mean_sum += 0.5 * (current[k - 1] + current[k]);
    EXPECT_NEAR(held.motor_velocity[k], held_sum * kSample / kInertia, 1e-9);
    EXPECT_NEAR(between.motor_velocity[k], mean_sum * kSample / kInertia, 1e-9);
  }
  EXPECT_NEAR(held.motor_acceleration[2], 0.5 * (-0.05 + 0.02) / kInertia, 1e-6);
  // 2.5 samples of the first, as it stands before the record begins, and one of each to the half of the fourth.
  EXPECT_NEAR(shifted.motor_velocity[5], (2.5 * 0.1 - 0.05 + 0.02 + 0.5 * 0.0) * kSample / kInertia, 1e-9);
}

TEST(Simulation, TheLoadOfARigidGearIsReflectedAndItsTorqueReported) {
  // A pendulum: (J N^2 + Jo) ao = -m g l sin(qo); small swings have a known period.
  const double total = kInertia * 1e4 + 0.5;
  const auto model = model_of({{"inertia", {kInertia}}, {"output_inertia", {0.5}}, {"gravity", {0.0, 3.0}}});
  const double swing = 0.01;
  const auto experiment = record(10001, nothing, 0.0, 100.0 * swing);
  const auto run = simulation::run(model, experiment);
  const double omega = std::sqrt(3.0 / total) * (1.0 - swing * swing / 16.0);
  for (std::size_t k = 0; k < experiment.size(); k += 50) {
    const double output = swing * std::cos(omega * experiment.time_s[k]);
    ASSERT_NEAR(run.output_position[k], output, 1e-6);
    ASSERT_NEAR(run.motor_position[k], 100.0 * run.output_position[k], 1e-10);
    // The gear carries what the load takes: weight less what accelerates the load itself.
    if (k > 0) {
      ASSERT_NEAR(run.torque[k], 3.0 * output * (1.0 - 0.5 / total), 1e-4);
    }
  }
}

TEST(Simulation, AMeasuredLoadTorqueResists) {
  const auto model = model_of({{"inertia", {kInertia}}, {"output_inertia", {1.0}}});
  auto experiment = record(101, nothing);
  experiment[Column::load_torque].assign(101, 4.0);
  const auto run = simulation::run(model, experiment);
  EXPECT_NEAR(run.output_velocity.back(), -4.0 / 2.0 * 0.1, 1e-9);
  EXPECT_NEAR(run.torque.back(), 4.0 - 1.0 * 2.0, 1e-6);
}

TEST(Simulation, WarmLubricantRubsLess) {
  const auto model =
      model_of({{"inertia", {kInertia}}, {"viscous_friction", {3.6e-4}}, {"temperature_viscous", {0.012}}});
  auto experiment = record(501, nothing, 100.0);
  experiment[Column::temperature].assign(501, 50.0);
  const auto run = simulation::run(model, experiment);
  EXPECT_NEAR(run.motor_velocity.back(), 100.0 * std::exp(-3.6e-4 * std::exp(-0.012 * 20.0) / kInertia * 0.5), 1e-6);
}

TEST(Simulation, ALinearAxisDrivenByForceNeedsNoGearAndNoTorqueConstant) {
  model::Model model = model_of({{"inertia", {95.0}}, {"viscous_friction", {200.0}}, {"coulomb_friction", {20.0}}});
  model.drive = {};
  model.drive.axis = data::Axis::linear;
  auto experiment = record(2001, nothing, 0.0, 0.1);
  experiment[Column::motor_torque].assign(2001, 60.0);
  experiment[Column::current].clear();
  const auto run = simulation::run(model, experiment);
  const double top = (60.0 - 20.0) / 200.0;
  for (std::size_t k = 0; k < experiment.size(); k += 20)
    ASSERT_NEAR(run.motor_velocity[k], top * (1.0 - std::exp(-200.0 / 95.0 * experiment.time_s[k])), 1e-8);
  EXPECT_EQ(run.output_velocity.back(), run.motor_velocity.back());
}

TEST(Simulation, EverySegmentStartsAgainFromTheMeasurement) {
  const auto model = model_of({{"inertia", {kInertia}}, {"coulomb_friction", {0.045}}});
  auto experiment = record(300, nothing, 10.0);
  experiment.segments = {{0, 100}, {150, 300}};
  for (std::size_t k = 150; k < 300; ++k) experiment[Column::motor_velocity][k] = -5.0;
  const auto run = simulation::run(model, experiment);
  EXPECT_EQ(run.motor_velocity[0], 10.0);
  EXPECT_EQ(run.motor_velocity[99], 0.0);
  EXPECT_TRUE(std::isnan(run.motor_velocity[120]));
  EXPECT_EQ(run.motor_velocity[150], -5.0);
  EXPECT_EQ(run.motor_velocity[299], 0.0);
}

TEST(Simulation, WithoutAVelocityTheFirstPositionsGiveIt) {
  const auto model = model_of({{"inertia", {kInertia}}});
  auto experiment = record(100, [](double) { return 0.02; });
  experiment[Column::motor_velocity].clear();
  for (std::size_t k = 0; k < 100; ++k) {
    const double t = experiment.time_s[k];
    experiment[Column::motor_position][k] = 1.0 + 7.0 * t + 0.5 * 0.02 / kInertia * t * t;
  }
  const auto run = simulation::run(model, experiment);
  EXPECT_NEAR(run.motor_velocity[0], 7.0, 1e-9);
  EXPECT_NEAR(run.motor_position.back(), experiment[Column::motor_position].back(), 1e-8);
}

TEST(Simulation, AnIncompleteModelIsRefusedAndAllThatIsMissingIsNamed) {
  auto model = model_of({{"inertia", {kInertia}}, {"viscous_friction", {}}, {"stribeck_gaussian", {0.01, 0.01}}});
  model.drive.torque_constant_nm_a.value.reset();
  try {
    simulation::run(model, record(10, nothing));
    FAIL() << "not refused";
  } catch (const simulation::ModelIncomplete& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("viscous_friction.coefficient"), std::string::npos) << text;
    EXPECT_NE(text.find("stribeck_gaussian.velocity"), std::string::npos) << text;
    EXPECT_NE(text.find("drive.torque_constant_nm_a"), std::string::npos) << text;
    EXPECT_EQ(text.find("amplitude_positive"), std::string::npos) << text;
    EXPECT_EQ(text.find("inertia.inertia"), std::string::npos) << text;
  }
  EXPECT_THROW(simulation::run(model_of({{"viscous_friction", {1e-4}}}), record(10, nothing)),
               simulation::ModelIncomplete);
  EXPECT_THROW(simulation::run(model_of({{"inertia", {0.0}}}), record(10, nothing)), simulation::ModelIncomplete);
}

TEST(Simulation, ARecordWithoutEffortIsRefused) {
  auto experiment = record(10, nothing);
  experiment[Column::current].clear();
  EXPECT_THROW(simulation::run(model_of({{"inertia", {kInertia}}}), experiment), std::invalid_argument);
}

TEST(Simulation, AModelThatDivergesEndsInNotANumber) {
  const auto model = model_of({{"inertia", {kInertia}}, {"viscous_friction", {-1.0}}});
  const auto run = simulation::run(model, record(400, nothing, 1.0));
  EXPECT_EQ(run.motor_velocity.size(), 400U);
  EXPECT_TRUE(std::isnan(run.motor_velocity.back()));
}

}  // namespace
}  // namespace flexspline::simulation_motor_test
