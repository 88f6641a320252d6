// The free run of two masses and of a locked gear against closed forms and a second integration.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/simulation/root.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::simulation_gear_test {
namespace {

using namespace flexspline;  // NOLINT(google-build-using-namespace): a test reads better without the prefix
using data::Column;

constexpr double kInertia = 1e-4;
constexpr double kOutputInertia = 0.06;
constexpr double kStiffness = 6.3e3;
constexpr double kRatio = 100.0;
constexpr double kSample = 1e-3;

using Parts = std::initializer_list<std::pair<std::string_view, std::vector<double>>>;

model::Model model_of(Parts parts) {
  model::Model model;
  model.name = "test";
  model.drive.gear_ratio.value = kRatio;
  model.drive.torque_constant_nm_a.value = 1.0;
  model.drive.rated_velocity_rad_s.value = 200.0;
  for (const auto& [type, values] : parts) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(type), data::Axis::rotary);
    for (std::size_t k = 0; k < values.size(); ++k) effect.parameters.at(k).value = values[k];
    model.effects.push_back(effect);
  }
  return model;
}

struct Begin {
  double motor_position = 0.0;
  double motor_velocity = 0.0;
  double output_position = 0.0;
  double output_velocity = 0.0;
};

template <class Current>
data::Experiment record(std::size_t samples, data::Load load, Current&& current, const Begin& begin = {}) {
  data::Experiment experiment;
  experiment.name = "made";
  experiment.load = load;
  experiment.sample_s = kSample;
  experiment.current_hold = data::CurrentHold::none;
  experiment.segments.push_back({0, samples});
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * kSample;
    experiment.time_s.push_back(t);
    experiment[Column::current].push_back(current(t));
  }
  experiment[Column::motor_position].assign(samples, begin.motor_position);
  experiment[Column::motor_velocity].assign(samples, begin.motor_velocity);
  experiment[Column::output_position].assign(samples, begin.output_position);
  experiment[Column::output_velocity].assign(samples, begin.output_velocity);
  // Only the first sample is read; the stated noise says that it is to be trusted.
  experiment.noise_std[static_cast<std::size_t>(Column::motor_velocity)] = 0.0;
  experiment.noise_std[static_cast<std::size_t>(Column::output_velocity)] = 0.0;
  return experiment;
}

double nothing(double) {
  return 0.0;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
  return a.size() == b.size() ? largest : INFINITY;
}

const Parts kBase = {{"inertia", {kInertia}}, {"linear_stiffness", {kStiffness}}, {"output_inertia", {kOutputInertia}}};

TEST(SimulationOfTwoMasses, SwingsAtTheResonanceOfBothAgainstTheSpring) {
  const double omega = std::sqrt(kStiffness * (1.0 / kOutputInertia + 1.0 / (kInertia * kRatio * kRatio)));
  const double torsion = 1e-3;
  // At rest in space, twisted, let go: 27 swings in half a second.
  const auto experiment = record(501, data::Load::free, nothing, {kRatio * torsion, 0.0, 0.0, 0.0});
  const auto run = simulation::run(model_of(kBase), experiment);
  for (std::size_t k = 0; k < experiment.size(); ++k) {
    const double expected = kStiffness * torsion * std::cos(omega * experiment.time_s[k]);
    // Second order: the phase falls behind by some 1e-5 of it.
    ASSERT_NEAR(run.torque[k], expected, 0.02 * kStiffness * torsion) << "at " << experiment.time_s[k];
  }
}

// The same equations written out, by the classic Runge-Kutta scheme with a step so short that its error is zero.
struct Reference {
  using Vector = std::array<double, 4>;  // q, w, qo, wo
  static double torque(const Vector& x) { return kStiffness * (x[0] / kRatio - x[2]); }
  static Vector rate(const Vector& x, double effort) {
    const double friction = 3.6e-4 * x[1] + 0.004 * std::cos(2.0 * x[0]) + 0.003 * std::sin(2.0 * x[0]);
    const double load = 0.5 * x[3] + 0.5 * std::cos(x[2]) + 3.0 * std::sin(x[2]);
    return {x[1], (effort - friction - torque(x) / kRatio) / kInertia, x[3], (torque(x) - load) / kOutputInertia};
  }
  static void step(Vector& x, double effort, double h) {
    const auto ahead = [&](const Vector& k, double by) {
      Vector y = x;
      for (std::size_t i = 0; i < 4; ++i) y[i] += by * k[i];
      return y;
    };
    const Vector a = rate(x, effort);
    const Vector b = rate(ahead(a, 0.5 * h), effort);
    const Vector c = rate(ahead(b, 0.5 * h), effort);
    const Vector d = rate(ahead(c, h), effort);
    for (std::size_t i = 0; i < 4; ++i) x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
  }
};

TEST(SimulationOfTwoMasses, AgreesWithASecondIntegrationOfTheEquationsWrittenOut) {
  auto model = model_of({{"inertia", {kInertia}},
                         {"viscous_friction", {3.6e-4}},
                         {"torque_ripple", {2.0, 0.004, 0.003}},
                         {"linear_stiffness", {kStiffness}},
                         {"output_inertia", {kOutputInertia}},
                         {"output_viscous_friction", {0.5}},
                         {"gravity", {0.5, 3.0}}});
  auto experiment =
      record(1001, data::Load::free, [](double t) { return 0.05 * std::sin(2.0 * std::numbers::pi * 2.0 * t); });
  experiment.current_hold = data::CurrentHold::zoh;
  const auto run = simulation::run(model, experiment);
  Reference::Vector x{};
  for (std::size_t k = 0; k < experiment.size(); ++k) {
    ASSERT_NEAR(run.motor_velocity[k], x[1], 0.01) << "at " << experiment.time_s[k];
    ASSERT_NEAR(run.motor_position[k], x[0], 1e-3);
    ASSERT_NEAR(run.output_position[k], x[2], 1e-5);
    ASSERT_NEAR(run.torque[k], Reference::torque(x), 0.01);
    for (int n = 0; n < 50; ++n) Reference::step(x, experiment[Column::current][k], kSample / 50.0);
  }
}

const Parts kFull = {{"inertia", {kInertia}},
                     {"viscous_friction", {3.6e-4}},
                     {"coulomb_friction", {0.045}},
                     {"stribeck_gaussian", {0.012, 0.010, 3.0}},
                     {"power_law_friction", {0.02, 0.5}},
                     {"load_dependent_friction", {0.05}},
                     {"torque_ripple", {2.0, 0.004, 0.0}},
                     {"linear_stiffness", {kStiffness}},
                     {"structural_damping", {57.0, 0.5}},
                     {"output_inertia", {kOutputInertia}},
                     {"output_viscous_friction", {0.5}},
                     {"output_coulomb_friction", {0.6}},
                     {"gravity", {0.5, 3.0}}};

double slow_reversals(double t) {
  return 0.25 * std::sin(2.0 * std::numbers::pi * 2.0 * t) + 0.05 * std::sin(2.0 * std::numbers::pi * 17.0 * t);
}

TEST(SimulationOfTwoMasses, HalfTheStepChangesLessThanSensorsSee) {
  auto experiment = record(1001, data::Load::free, slow_reversals);
  experiment.current_hold = data::CurrentHold::zoh;
  simulation::Options half;
  half.step_s = 0.5 * simulation::Options{}.step_s;
  for (const data::Load load : {data::Load::free, data::Load::locked}) {
    experiment.load = load;
    const auto whole = simulation::run(model_of(kFull), experiment);
    const auto fine = simulation::run(model_of(kFull), experiment, half);
    // A tenth of half a per cent of 200 rad/s, of an encoder count, and of one per cent of 40 N m.
    EXPECT_LT(largest_difference(whole.motor_velocity, fine.motor_velocity), 0.1);
    EXPECT_LT(largest_difference(whole.motor_position, fine.motor_position), 1.5e-4 * 10.0);
    EXPECT_LT(largest_difference(whole.torque, fine.torque), 0.04);
    // It did move.
    EXPECT_GT(*std::max_element(whole.motor_velocity.begin(), whole.motor_velocity.end()), 1.0);
  }
}

TEST(SimulationOfTwoMasses, TheOutputRestsWhileTheSpringWindsUp) {
  auto model = model_of({{"inertia", {kInertia}},
                         {"viscous_friction", {0.1}},
                         {"linear_stiffness", {kStiffness}},
                         {"output_inertia", {kOutputInertia}},
                         {"output_coulomb_friction", {3.0}}});
  const auto run = simulation::run(model, record(501, data::Load::free, [](double t) { return 0.1 * t; }));
  bool slid = false;
  for (std::size_t k = 0; k < run.torque.size(); ++k) {
    if (!slid && run.torque[k] < 3.0) {
      ASSERT_EQ(run.output_velocity[k], 0.0);
      ASSERT_NEAR(run.torque[k], kStiffness * run.motor_position[k] / kRatio, 1e-4);
    }
    slid = slid || run.torque[k] >= 3.0;
  }
  EXPECT_TRUE(slid);
  EXPECT_GT(run.output_velocity.back(), 0.0);
}

TEST(SimulationOfTwoMasses, StartsInEquilibriumWhereTheOutputIsNotMeasured) {
  auto model = model_of({{"inertia", {kInertia}},
                         {"coulomb_friction", {0.2}},
                         {"linear_stiffness", {kStiffness}},
                         {"output_inertia", {kOutputInertia}},
                         {"gravity", {3.0, 0.0}}});
  auto experiment = record(201, data::Load::free, nothing);
  experiment[Column::output_position].clear();
  experiment[Column::output_velocity].clear();
  const auto run = simulation::run(model, experiment);
  for (const double torque : run.torque) ASSERT_NEAR(torque, 3.0, 1e-3);
}

TEST(SimulationOfTwoMasses, PositionsWithoutACommonZeroDoNotTearTheGear) {
  auto model = model_of(kBase);
  model.drive.rated_torque_nm.value = 40.0;
  // The output's encoder says two radians; the gear would carry 12 600 N m.
  const auto run = simulation::run(model, record(101, data::Load::free, nothing, {0.0, 0.0, 2.0, 0.0}));
  for (std::size_t k = 0; k < run.torque.size(); ++k) {
    ASSERT_NEAR(run.torque[k], 0.0, 1e-6);
    ASSERT_NEAR(run.output_position[k], 2.0, 1e-9);
  }
}

TEST(SimulationOfALockedGear, StructuralDampingAloneStopsTheMotorInFiniteTime) {
  // J w' = -c sqrt(w/N)/N: the root of w falls linearly.
  const double c = 57.0;
  auto model = model_of({{"inertia", {kInertia}}, {"structural_damping", {c, 0.5}}});
  const auto experiment = record(101, data::Load::locked, nothing, {0.0, 50.0, 0.0, 0.0});
  const auto run = simulation::run(model, experiment);
  const double fall = 0.5 * c / (kRatio * std::sqrt(kRatio) * kInertia);
  for (std::size_t k = 0; k < experiment.size(); ++k) {
    const double root = std::max(0.0, std::sqrt(50.0) - fall * experiment.time_s[k]);
    ASSERT_NEAR(run.motor_velocity[k], root * root, 1e-3) << "at " << experiment.time_s[k];
    // At standstill the torque is the root of next to nothing.
    if (k > 0 && run.motor_velocity[k] > 1e-4) {
      ASSERT_NEAR(run.torque[k], c * std::sqrt(run.motor_velocity[k] / kRatio), 1e-4);
    }
    ASSERT_EQ(run.output_position[k], 0.0);
  }
}

TEST(SimulationOfALockedGear, BacklashIsCrossedWithoutTorque) {
  const double half_width = 1.5e-4;
  auto model = model_of({{"inertia", {kInertia}}, {"linear_stiffness", {kStiffness}}, {"backlash", {half_width}}});
  const double start = 1.0;
  const auto experiment = record(301, data::Load::locked, nothing, {0.0, start, 0.0, 0.0});
  const auto run = simulation::run(model, experiment);
  for (std::size_t k = 1; k < experiment.size(); ++k) {
    const double torsion = run.motor_position[k] / kRatio;
    const double beyond = torsion - std::clamp(torsion, -half_width, half_width);
    ASSERT_NEAR(run.torque[k], kStiffness * beyond, 1e-6);
    if (experiment.time_s[k] < half_width * kRatio / start) {
      ASSERT_NEAR(run.motor_velocity[k], start, 1e-9);
    }
  }
  // The spring throws it back: energy is kept, so the deepest torsion follows from the speed. Crossing the gap both
  // ways at speed 1 and half a swing at each end make the period.
  const double omega = std::sqrt(kStiffness / (kInertia * kRatio * kRatio));
  const double deepest = half_width * kRatio + start / omega;
  EXPECT_NEAR(*std::max_element(run.motor_position.begin(), run.motor_position.end()), deepest, 0.002 * deepest);
  EXPECT_NEAR(*std::min_element(run.motor_position.begin(), run.motor_position.end()), -deepest, 0.002 * deepest);
}

TEST(SimulationOfALockedGear, DahlFrictionFollowsItsExponentialsBetweenReversals) {
  const double torque = 0.045;
  const double presliding = 0.05;
  auto model = model_of({{"inertia", {kInertia}},
                         {"viscous_friction", {0.02}},
                         {"dahl_friction", {torque, presliding}},
                         {"linear_stiffness", {kStiffness}}});
  const auto experiment =
      record(1001, data::Load::locked, [](double t) { return 0.25 * std::sin(2.0 * std::numbers::pi * 2.0 * t); });
  const auto run = simulation::run(model, experiment);
  double deflection = 0.0;
  int reversals = 0;
  for (std::size_t k = 1; k < experiment.size(); ++k) {
    const double travel = run.motor_position[k] - run.motor_position[k - 1];
    const double direction = travel > 0.0 ? 1.0 : -1.0;
    const bool reversed = run.motor_velocity[k] * run.motor_velocity[k - 1] < 0.0;
    reversals += reversed ? 1 : 0;
    deflection = direction + (deflection - direction) * std::exp(-std::abs(travel) / presliding);
    const double friction = experiment[Column::current][k] - kInertia * run.motor_acceleration[k] -
                            0.02 * run.motor_velocity[k] - run.torque[k] / kRatio;
    // Within the sample of a reversal the travel between samples is not the way that was gone.
    ASSERT_NEAR(friction, torque * deflection, 5e-4) << "at " << experiment.time_s[k];
  }
  EXPECT_EQ(reversals, 4);
}

TEST(SimulationOfALockedGear, WithoutATransmissionNothingIsSimulated) {
  const auto run = simulation::run(model_of({{"inertia", {kInertia}}}), record(11, data::Load::locked, nothing));
  EXPECT_TRUE(run.motor_velocity.empty());
  EXPECT_TRUE(run.torque.empty());
}

TEST(RootOfAnIncreasingFunction, IsFoundFromAnywhereAlsoWhereItIsSteepOrJumps) {
  const std::array<double, 5> roots = {-3e4, -1e-7, 0.0, 2.5e-11, 40.0};
  const std::array<double, 4> guesses = {-1e3, 0.0, 1e-9, 7.0};
  for (const double at : roots) {
    for (const double guess : guesses) {
      for (const double slope : {1e-3, 1.0, 1e6}) {
        const auto steep = [&](double x) {
          return std::copysign(std::sqrt(std::abs(x - at)), x - at) + 1e-3 * (x - at);
        };
        const auto root = simulation::find_root(steep, guess, slope, 1e-8);
        EXPECT_TRUE(root.converged || root.jump) << at << " from " << guess;
        EXPECT_NEAR(root.x, at, 1e-9 + 1e-12 * std::abs(at));
        const auto jumping = [&](double x) { return x > at ? 1.0 + x - at : -2.0 + x - at; };
        const auto jump = simulation::find_root(jumping, guess, slope, 1e-8);
        EXPECT_TRUE(jump.jump);
        EXPECT_NEAR(jump.low, at, 1e-9 + 1e-12 * std::abs(at));
        EXPECT_NEAR(jump.high, at, 1e-9 + 1e-12 * std::abs(at));
      }
    }
  }
}

}  // namespace
}  // namespace flexspline::simulation_gear_test
