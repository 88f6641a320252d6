// Feedforward from the set point: against the sum of its parts written in SI units, what is measured and what is not,
// and what it saves the loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "host/common/numbers/real.hpp"
#include "shared/control/feedforward.hpp"
#include "shared/control/loops.hpp"
#include "shared/control/trajectory.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests::control_feedforward_test {
namespace {

using control::Feedforward;
using control::FeedforwardSetup;
using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;

constexpr double kTickS = 1.0 / 16000.0;
constexpr double kGear = 100.0;
constexpr double kInertia = 1e-4, kViscous = 2e-4, kCoulomb = 0.045, kRipple = 0.006, kMesh = 0.05;
constexpr double kOutputInertia = 0.5, kGravity = 4.0, kStiffness = 6300.0;
constexpr double kBand = 0.5;  // rad/s

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.gear_ratio = kGear;
  d.rated_velocity = d.velocity_base = 200.0;
  d.torque_base = 0.5;
  d.output_torque_base = 40.0;
  d.output_velocity_base = 2.0;
  d.acceleration_base = 5000.0;
  d.output_acceleration_base = 50.0;
  d.torsion_base = 40.0 / 6300.0;
  d.angle_base = kTurn;
  d.time_base = kTickS;
  d.torque_constant = 0.125;
  d.current_base = 4.0;
  return d;
}
FeedforwardSetup<double> setup() {
  return {.direction_band = kBand,
          .torque_limit = 0.9,
          .load_limit = 70.0,
          .stiffness = kStiffness,
          .torsion_limit = 0.01,
          .torsion_rate_limit = 1.0,
          .output_zero_turns = 3.25};
}
template <class N>
Feedforward::Coefficients<N> made(const FeedforwardSetup<double>& s = setup()) {
  return Feedforward::derive<N>(s, drive());
}
template <class Effect, class N>
void add(model::DriveModel<N>& model, std::initializer_list<double> parameters) {
  EXPECT_TRUE(model.template add<Effect>(Effect::template derive<N>(parameters.begin(), drive())));
}
template <class N>
model::DriveModel<N> whole() {
  model::DriveModel<N> model;
  add<effects::Inertia>(model, {kInertia});
  add<effects::ViscousFriction>(model, {kViscous});
  add<effects::CoulombFriction>(model, {kCoulomb});
  add<effects::LoadDependentFriction>(model, {kMesh});
  add<effects::TorqueRipple>(model, {2.0, kRipple, 0.0});
  add<effects::OutputInertia>(model, {kOutputInertia});
  add<effects::Gravity>(model, {0.0, kGravity});
  add<effects::LinearStiffness>(model, {kStiffness});
  return model;
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
double turns(fixed::Step x) {
  return std::ldexp(static_cast<double>(x.raw), -32);
}
fixed::Angle angle(double turns_of_motor) {
  return {std::llround(std::ldexp(turns_of_motor, 32))};
}
// A sine in position: 30 turns at 0.4 Hz, so that all signals stay within their bases.
struct Point {
  double turns, velocity, acceleration;
};
Point at(int k) {
  const double w = kTurn * 0.4, t = k * kTickS;
  return {12.0 * std::sin(w * t), 12.0 * kTurn * w * std::cos(w * t), -12.0 * kTurn * w * w * std::sin(w * t)};
}
Feedforward::SetPoint<Fixed> set_point(const Point& p) {
  return {angle(p.turns), Fixed::value(p.velocity / 200.0), Fixed::value(p.acceleration / 5000.0)};
}

TEST(Feedforward, IsTheSumOfItsPartsInSiUnits) {
  const auto c = made<Fixed>();
  auto model = whole<Fixed>();
  Feedforward::State<Fixed> s;
  double worst = 0.0, worst_lead = 0.0, load_before = 0.0, largest = 0.0, largest_lead = 0.0;
  for (int k = 0; k < 40'000; ++k) {
    const Point p = at(k);
    const double measured = p.turns + 0.01;
    const auto out = Feedforward::update(s, c, model, set_point(p), {angle(measured), {}, Fixed::value(2.0 / 40.0)});
    const double direction = std::clamp(p.velocity / kBand, -1.0, 1.0);
    const double load =
        kOutputInertia * p.acceleration / kGear + kGravity * std::sin(kTurn * (p.turns - 3.25) / kGear) + 2.0;
    const double torque = kInertia * p.acceleration + kViscous * p.velocity + kCoulomb * direction +
                          kMesh / kGear * std::abs(load_before) * direction +
                          kRipple * std::cos(2.0 * kTurn * measured) + load / kGear;
    worst = std::max(worst, std::abs(real(out.torque) * 0.5 - torque));
    // The torsion settles in one step, but for what its rate allows at the start.
    if (k > 1000) worst_lead = std::max(worst_lead, std::abs(turns(out.lead) - kGear * load / kStiffness / kTurn));
    ASSERT_TRUE(k <= 1000 || std::abs(real(out.velocity)) < 0.01);
    load_before = load;
    largest = std::max(largest, std::abs(torque));
    largest_lead = std::max(largest_lead, std::abs(turns(out.lead)));
  }
  EXPECT_LT(worst, 2e-7);
  EXPECT_GT(largest, 0.1);
  EXPECT_LT(worst_lead, 1e-8);
  EXPECT_GT(largest_lead, 0.003);
}

// K dq + c v^(1/2) = T from dq = 0: what is missing, e = T - K dq, obeys e' = -K (e/c)^2, so e = T/(1 + K T t/c^2).
TEST(Feedforward, WithStructuralDampingTheLeadCreepsAsTheSpringDoes) {
  auto s = setup();
  s.damping_torque = 57.0;
  s.damping_exponent = 0.5;
  const auto c = made<Fixed>(s);
  const auto c_checked = made<Checked>(s);
  const auto c_real = made<Real>(s);
  auto model = whole<Fixed>();
  auto checked = whole<Checked>();
  auto exact = whole<Real>();
  Feedforward::State<Fixed> state;
  Feedforward::State<Checked> state_checked;
  Feedforward::State<Real> state_real;
  OverflowLog::clear();
  const double load = 1.2;
  const fixed::Angle level{std::llround(3.25 * 0x1p32)};  // where gravity is zero
  double lead = 0.0;
  for (int k = 1; k <= 160'000; ++k) {
    const auto out = Feedforward::update<Fixed>(state, c, model, {level, {}, {}}, {{}, {}, Fixed::value(load / 40.0)});
    const auto out_checked = Feedforward::update<Checked>(state_checked, c_checked, checked, {level, {}, {}},
                                                          {{}, {}, Checked::value(load / 40.0)});
    const auto out_real =
        Feedforward::update<Real>(state_real, c_real, exact, {3.25, 0.0, 0.0}, {0.0, 0.0, load / 40.0});
    const double missing = load / (1.0 + kStiffness * load * k * kTickS / (57.0 * 57.0));
    lead = kGear * (load - missing) / kStiffness / kTurn;
    ASSERT_NEAR(turns(out.lead), lead, 1e-6) << k;
    ASSERT_NEAR(turns(out.lead), out_real.lead, 5e-7) << k;
    ASSERT_EQ(out.lead.raw, out_checked.lead.raw);
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  // Ten seconds later some of it is still to come.
  EXPECT_LT(lead, 0.97 * kGear * load / kStiffness / kTurn);
}

TEST(Feedforward, OnADriveAgreesWithDouble) {
  const auto c = made<Fixed>();
  const auto c_checked = made<Checked>();
  const auto c_real = made<Real>();
  auto model = whole<Fixed>();
  auto checked = whole<Checked>();
  auto exact = whole<Real>();
  Feedforward::State<Fixed> s;
  Feedforward::State<Checked> s_checked;
  Feedforward::State<Real> s_real;
  std::mt19937_64 random(9);
  OverflowLog::clear();
  double worst = 0.0, worst_lead = 0.0, worst_velocity = 0.0;
  Point p{};
  for (int k = 0; k < 100'000; ++k) {
    // Set points that jump over the whole envelope as well.
    if (k < 50'000) {
      p = at(k);
    } else if (random() % 30 == 0) {
      const auto any = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-52 - 1.0); };
      p = {1000.0 * any(), 200.0 * any(), 5000.0 * any()};
    }
    const auto set = set_point(p);
    const fixed::Angle measured = angle(p.turns + 0.3);
    const auto load = Fixed::value(0.2 * std::sin(0.01 * k));
    const auto out = Feedforward::update(s, c, model, set, {measured, {}, load});
    const auto looked_at = Feedforward::update(
        s_checked, c_checked, checked, {set.position, {set.velocity}, {set.acceleration}}, {measured, {}, {load}});
    const auto expected = Feedforward::update(
        s_real, c_real, exact, {turns(set.position - fixed::Angle{}), real(set.velocity), real(set.acceleration)},
        {turns(measured - fixed::Angle{}), 0.0, real(load)});
    ASSERT_EQ(out.torque.raw, looked_at.torque.raw);
    ASSERT_EQ(out.lead.raw, looked_at.lead.raw);
    ASSERT_LE(std::abs(real(out.torque)), 0.9 / 0.5 + 1e-8);
    worst = std::max(worst, std::abs(real(out.torque) - expected.torque));
    worst_lead = std::max(worst_lead, std::abs(turns(out.lead) - expected.lead));
    worst_velocity = std::max(worst_velocity, std::abs(real(out.velocity) - expected.velocity));
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  EXPECT_LT(worst, 2e-7);
  EXPECT_LT(worst_lead, 1e-7);
  EXPECT_LT(worst_velocity, 5e-5);
}

TEST(Feedforward, TakesOnlyWhatRepeatsWithTheMotorFromWhereItStands) {
  const auto c = made<Fixed>();
  const auto torque = [&]<class Effect>(double measured_turns, std::initializer_list<double> parameters) {
    model::DriveModel<Fixed> model;
    add<Effect>(model, parameters);
    Feedforward::State<Fixed> s;
    double last = 0.0;
    for (int k = 0; k < 2000; ++k)
      last = real(Feedforward::update(s, c, model, set_point(at(k)), {angle(measured_turns * k), {}, {}}).torque);
    return last;
  };
  // Friction with a memory of the way does not see the measured angle,
  const double dahl = torque.operator()<effects::DahlFriction>(0.0, {kCoulomb, 0.05});
  EXPECT_GT(dahl, 0.08);
  EXPECT_EQ(torque.operator()<effects::DahlFriction>(-0.01, {kCoulomb, 0.05}), dahl);
  // a ripple sees nothing else.
  EXPECT_NEAR(torque.operator()<effects::TorqueRipple>(0.0, {2.0, kRipple, 0.0}), kRipple / 0.5, 1e-8);
  EXPECT_NEAR(torque.operator()<effects::TorqueRipple>(-0.01, {2.0, kRipple, 0.0}),
              kRipple / 0.5 * std::cos(2.0 * kTurn * 0.01 * 1999.0), 1e-7);
}

TEST(Feedforward, FrictionDoesNotChatterAtStandstill) {
  const auto c = made<Fixed>();
  model::DriveModel<Fixed> model;
  add<effects::CoulombFriction>(model, {kCoulomb});
  Feedforward::State<Fixed> s;
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0.0, 0.01);  // rad/s, a fiftieth of the band
  double largest = 0.0;
  for (int k = 0; k < 20'000; ++k) {
    const auto out = Feedforward::update(s, c, model, {{}, Fixed::value(noise(random) / 200.0), {}}, {});
    largest = std::max(largest, std::abs(real(out.torque)) * 0.5);
  }
  EXPECT_LT(largest, 0.1 * kCoulomb);
  EXPECT_EQ(Feedforward::update(s, c, model, {}, {}).torque.raw, 0);
  EXPECT_NEAR(real(Feedforward::update(s, c, model, {{}, Fixed::value(-0.6 / 200.0), {}}, {}).torque) * 0.5, -kCoulomb,
              1e-8);
}

// T = K1 dq + K3 dq^3, inverted by Cardano's formula.
TEST(Feedforward, LeadsByTheTorsionOfAStiffeningTransmission) {
  const double k1 = 4000.0, k3 = 4e7, limit = 0.008;
  auto wanted = setup();
  wanted.stiffness = k1 + 3.0 * k3 * limit * limit;  // where it is stiffest
  const auto c = made<Fixed>(wanted);
  model::DriveModel<Fixed> model;
  add<effects::LinearStiffness>(model, {k1});
  add<effects::CubicStiffness>(model, {k3});
  for (const double load : {0.0, 3.0, -12.0, 35.0}) {
    Feedforward::State<Fixed> s;
    Feedforward::Output<Fixed> out;
    for (int k = 0; k < 200; ++k) out = Feedforward::update(s, c, model, {}, {{}, {}, Fixed::value(load / 40.0)});
    const double p = k1 / k3, q = -load / k3, root = std::sqrt(q * q / 4.0 + p * p * p / 27.0);
    const double torsion = std::cbrt(-q / 2.0 + root) + std::cbrt(-q / 2.0 - root);
    EXPECT_NEAR(turns(out.lead), kGear * torsion / kTurn, 1e-7) << load;
    EXPECT_NEAR(real(out.velocity), 0.0, 1e-6);
  }
}

TEST(Feedforward, TheLeadChangesNoFasterThanItMay) {
  const auto c = made<Fixed>();
  auto model = whole<Fixed>();
  Feedforward::State<Fixed> s;
  double before = 0.0, fastest = 0.0;
  for (int k = 0; k < 4000; ++k) {
    // The output's acceleration jumps from end to end.
    const auto out = Feedforward::update(s, c, model, {{}, {}, Fixed::value(k / 500 % 2 == 0 ? 1.0 : -1.0)}, {});
    const double lead = turns(out.lead) * kTurn;
    fastest = std::max(fastest, std::abs(lead - before) / kTickS / kGear);
    ASSERT_NEAR(real(out.velocity) * 200.0, (lead - before) / kTickS, 2e-3);
    before = lead;
  }
  EXPECT_LT(fastest, 1.0001);
  EXPECT_GT(fastest, 0.99);
}

// Inertia, viscous and dry friction (sticking at rest) and a ripple, in steps of a tick.
struct Motor {
  double velocity = 0.0, turns = 0.0;
  void tick(double torque) {
    torque -= kRipple * std::cos(2.0 * kTurn * turns) + kViscous * velocity;
    const double free = velocity + torque * kTickS / kInertia, most = kCoulomb * kTickS / kInertia;
    velocity = std::abs(free) <= most ? 0.0 : free - std::copysign(most, free);
    turns += velocity * kTickS / kTurn;
  }
};

// Trajectory, feedforward and loops on a motor: there, rest, back.
TEST(Feedforward, SavesTheLoopsSevenEighthsOfTheFollowingError) {
  const auto d = drive();
  const auto loops = control::Loops::derive<Fixed>(control::LoopSetup<double>{.position_gain = 20.0,
                                                                              .velocity_gain = 0.02,
                                                                              .integral_gain = 0.8,
                                                                              .velocity_limit = 150.0,
                                                                              .overspeed = 170.0,
                                                                              .torque_limit = 0.4,
                                                                              .current_limit = 3.2},
                                                   d);
  const auto path = control::Trajectory::derive<Fixed>(
      control::TrajectorySetup<double>{.velocity_limit = 60.0, .acceleration_limit = 600.0}, d);
  const auto c = made<Fixed>();
  const auto error = [&](bool with_feedforward) {
    model::DriveModel<Fixed> model;
    add<effects::Inertia>(model, {kInertia});
    add<effects::ViscousFriction>(model, {kViscous});
    add<effects::CoulombFriction>(model, {kCoulomb});
    add<effects::TorqueRipple>(model, {2.0, kRipple, 0.0});
    Motor motor;
    control::Loops::State<Fixed> s;
    Feedforward::State<Fixed> ahead;
    auto place = control::Trajectory::at(0);
    fixed::Angle begin{};  // of the tick, where the set point was
    double sum = 0.0;
    for (int k = 0; k < 48'000; ++k) {
      const auto set = control::Trajectory::update(place, path, k > 3000 && k < 24'000 ? std::int64_t{5} << 32 : 0);
      const fixed::Angle here = angle(motor.turns);
      control::Loops::Command<Fixed> command{control::Loop::position, begin, set.velocity, {}};
      const auto out =
          Feedforward::update(ahead, c, model, {set.position, set.velocity, set.acceleration}, {here, {}, {}});
      if (with_feedforward) command.torque = out.torque;
      const auto torque = control::Loops::update(s, loops, command, here, Fixed::value(motor.velocity / 200.0)).torque;
      const double off = turns(begin - here) * kTurn;
      begin = set.position;
      sum += off * off;
      motor.tick(real(torque) * 0.5);
    }
    return std::sqrt(sum / 48'000);
  };
  const double without = error(false), with = error(true);
  EXPECT_LT(with, 0.125 * without);
  EXPECT_GT(without, 0.01);  // rad
  RecordProperty("rms_rad_without", std::to_string(without));
  RecordProperty("rms_rad_with", std::to_string(with));
}

}  // namespace
}  // namespace flexspline::tests::control_feedforward_test
