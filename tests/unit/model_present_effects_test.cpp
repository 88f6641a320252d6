// What a tick of a model leaves out changes nothing: effects that are absent, signals that no effect reads, scales of a
// temperature that is still the same.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <string_view>

#include "shared/control/feedforward.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::model_present_effects_test {
namespace {

using effects::Inputs;
using effects::Torques;
using fixed::Fixed;
using model::DriveModel;

constexpr int kTicks = 400;

// Signals within two bases; all of them change at each tick.
Inputs<Fixed> random_inputs(std::mt19937_64& random) {
  const auto word = [&] { return static_cast<std::int32_t>(random() % (std::uint64_t{1} << 29)) - (1 << 28); };
  Inputs<Fixed> in;
  in.angle.raw = static_cast<std::int64_t>(random()) >> 20;
  in.output_angle.raw = static_cast<std::int64_t>(random()) >> 20;
  for (Fixed::Value* signal : {&in.velocity, &in.acceleration, &in.output_velocity, &in.output_acceleration,
                               &in.torsion, &in.torsion_rate, &in.torque, &in.current, &in.temperature})
    signal->raw = word();
  const auto direction = [](Fixed::Value x) { return Fixed::Value{{x.raw > 0 ? 1 << 27 : -(1 << 27)}}; };
  in.direction = direction(in.velocity);
  in.output_direction = direction(in.output_velocity);
  in.torsion_direction = direction(in.torsion_rate);
  return in;
}
template <class Effect>
typename Effect::template Coefficients<Fixed> usual() {
  std::array<double, std::size(Effect::kParameters)> p{};
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = Effect::kParameters[i].usual;
  return Effect::template derive<Fixed>(p.data(), demo_constants());
}
template <class Effect>
constexpr bool on_a_drive() {
  return !Effect::kInfo.host_only && !Effect::kInfo.user_defined;
}
bool same(const Torques<Fixed>& a, const Torques<Fixed>& b) {
  return a.motor.raw == b.motor.raw && a.transmission.raw == b.transmission.raw && a.load.raw == b.load.raw;
}

struct FrictionAndRipple {
  static constexpr std::string_view kNames = "viscous_friction,coulomb_friction,torque_ripple";
};

TEST(ChosenEffects, OfAnImageAreThoseThatItsBuildNames) {
  DriveModel<Fixed, model::NamedEffects<FrictionAndRipple>> chosen;
  DriveModel<Fixed, model::EveryFormula> every;
  std::string names;
  chosen.for_each([&]<class Effect>(auto&) { names += std::string(Effect::kInfo.name) + " "; });
  EXPECT_EQ(names, "viscous_friction coulomb_friction torque_ripple ");
  EXPECT_LT(sizeof(chosen), sizeof(every) / 3);
  const auto add_both = [](auto& model) {
    EXPECT_TRUE(model.template add<effects::TorqueRipple>(usual<effects::TorqueRipple>()));
    EXPECT_TRUE(model.template add<effects::CoulombFriction>(usual<effects::CoulombFriction>()));
  };
  add_both(chosen);
  add_both(every);
  std::mt19937_64 random(5);
  for (int k = 0; k < kTicks; ++k) {
    const Inputs<Fixed> in = random_inputs(random);
    ASSERT_TRUE(same(chosen.tick(in), every.tick(in))) << k;
  }
}

TEST(ChosenEffects, NamesThatNoDriveRunsAreCounted) {
  EXPECT_EQ(model::detail::unknown_names(""), 0u);
  EXPECT_EQ(model::detail::unknown_names("inertia,backlash"), 0u);
  EXPECT_EQ(model::detail::unknown_names("inertia,backslash"), 1u);
  EXPECT_EQ(model::detail::unknown_names("preisach_hysteresis,table_effect"), 2u) << "host only; user-defined";
}

// A formula scales friction, so there has to be some.
using Friction = effects::ViscousFriction;
constexpr std::size_t kFriction = DriveModel<Fixed>::number_of<Friction>();
constexpr std::size_t kParts = 4;  // an image for each effect would take long to compile

// An image that runs every fourth effect, and friction, without asking which of them are there.
template <std::size_t Part>
struct EveryFourth {
  static constexpr bool kFilled = true;
  static constexpr bool kTables = true;
  static constexpr std::size_t places(std::size_t number, std::size_t most) {
    return most > 0 && (number % kParts == Part || number == kFriction) ? 1 : 0;
  }
};

TEST(PresentEffects, GiveTheTorquesOfAnImageThatRunsThemWithoutAsking) {
  effects::for_each_effect([]<class Effect>(std::size_t) {
    if constexpr (on_a_drive<Effect>()) {
      constexpr std::size_t kId = DriveModel<Fixed>::number_of<Effect>();
      const auto asks = std::make_unique<DriveModel<Fixed>>();
      const auto runs = std::make_unique<DriveModel<Fixed, EveryFourth<kId % kParts>>>();
      ASSERT_TRUE(asks->template add<Effect>(usual<Effect>()) && runs->template add<Effect>(usual<Effect>()));
      if constexpr (kId != kFriction) {
        ASSERT_TRUE(asks->template add<Friction>(usual<Friction>()) && runs->template add<Friction>(usual<Friction>()));
      }
      std::mt19937_64 random(kId);
      std::uint64_t moved = 0;
      for (int k = 0; k < kTicks; ++k) {
        const Inputs<Fixed> in = random_inputs(random);
        const Torques<Fixed> one = asks->tick(in), other = runs->tick(in);
        ASSERT_TRUE(same(one, other)) << Effect::kInfo.name << " at tick " << k;
        moved |= static_cast<std::uint64_t>(one.motor.raw | one.transmission.raw | one.load.raw);
      }
      EXPECT_NE(moved, 0u) << Effect::kInfo.name;
    }
  });
}

TEST(PresentEffects, WithoutOneThatReadsTheOutputItsSignalsChangeNothing) {
  int without = 0, with = 0;
  effects::for_each_effect([&]<class Effect>(std::size_t id) {
    if constexpr (on_a_drive<Effect>()) {
      const auto one = std::make_unique<DriveModel<Fixed>>(), other = std::make_unique<DriveModel<Fixed>>();
      ASSERT_TRUE(one->template add<Effect>(usual<Effect>()) && other->template add<Effect>(usual<Effect>()));
      const bool reads_angle = one->reads(effects::kOutputAngle), reads_motion = one->reads(effects::kOutputMotion);
      (reads_angle || reads_motion ? with : without) += 1;
      std::mt19937_64 random(id);
      for (int k = 0; k < kTicks; ++k) {
        const Inputs<Fixed> in = random_inputs(random);
        Inputs<Fixed> blind = in;
        if (!reads_angle) blind.output_angle = {};
        if (!reads_motion) blind.output_velocity = blind.output_acceleration = {};
        ASSERT_TRUE(same(one->tick(in), other->tick(blind))) << Effect::kInfo.name << " at tick " << k;
      }
    }
  });
  EXPECT_GT(without, 20);
  EXPECT_GT(with, 2);
}

TEST(PresentEffects, ScalesFollowTheTemperatureFromTickToTick) {
  const auto model = std::make_unique<DriveModel<Fixed>>();
  const auto fill = [](DriveModel<Fixed>& m) {
    ASSERT_TRUE(m.add<effects::ViscousFriction>(usual<effects::ViscousFriction>()));
    ASSERT_TRUE(m.add<effects::TemperatureViscous>(usual<effects::TemperatureViscous>()));
  };
  fill(*model);
  std::mt19937_64 random(3);
  Inputs<Fixed> in = random_inputs(random);
  std::int64_t before = 0;
  int changes = 0;
  for (int k = 0; k < kTicks; ++k) {
    if (k % 4 == 0) in.temperature = random_inputs(random).temperature;
    const auto fresh = std::make_unique<DriveModel<Fixed>>();
    fill(*fresh);
    const Torques<Fixed> torques = model->tick(in);
    ASSERT_TRUE(same(torques, fresh->tick(in))) << k;
    changes += torques.motor.raw != before ? 1 : 0;
    before = torques.motor.raw;
  }
  EXPECT_NEAR(changes, kTicks / 4, 2);
}

// Amplitude of the second order of the motor's turn in the torque that the drive tells of.
struct Ripple {
  double told = 0.0;
  double true_one = 0.0;
};
Ripple ripple_at(double velocity) {
  plant::Drive truth = demo_drive();
  plant::with(truth, "torque_sensor_ripple");
  Ripple ripple;
  for (const auto& effect : truth.effects)
    if (effect.type == "torque_sensor_ripple")
      ripple.true_one = std::hypot(effect.value("cosine"), effect.value("sine"));
  VirtualDrive drive({.drive = truth, .seed = 11}, demo_block(),
                     {.every = 1, .count = 2, .channels = {Channel::motor_fraction, Channel::torque}});
  drive.run(100);
  EXPECT_EQ(drive.command(arm_velocity(velocity)).refusal, Refusal::none);
  run_with_host(drive, 8.0 + 400.0 / velocity);
  drive.keep_frames(true);
  run_with_host(drive, 20.0 * kTurn / velocity);  // whole turns
  double cosine = 0.0, sine = 0.0;
  for (const auto& frame : drive.frames()) {
    const double phase = 2.0 * kTurn * std::ldexp(frame.values[0], -32);
    const double torque = real(frame.values[1]) * demo_constants().output_torque_base;
    cosine += torque * std::cos(phase);
    sine += torque * std::sin(phase);
  }
  ripple.told = 2.0 * std::hypot(cosine, sine) / static_cast<double>(drive.frames().size());
  return ripple;
}

// It is learnt at every eighth tick, and taken out as it is at the next one, up to six ticks away: at 100 rad/s less
// than a tenth of a radian of its phase.
TEST(RippleOfTheTorqueSensor, IsTakenOutOfWhatTheDriveReportsAtEverySpeed) {
  for (const double velocity : {20.0, 100.0}) {
    const Ripple ripple = ripple_at(velocity);
    RecordProperty("told", std::to_string(ripple.told / ripple.true_one));
    EXPECT_GT(ripple.true_one, 0.1);
    EXPECT_LT(ripple.told, (velocity < 50.0 ? 0.03 : 0.06) * ripple.true_one) << velocity;
  }
}

}  // namespace
}  // namespace flexspline::tests::model_present_effects_test
