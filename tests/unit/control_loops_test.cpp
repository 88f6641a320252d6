// Cascaded loops: their answers in closed form, what holds whatever comes in, and the drive's numbers against double.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <random>

#include "host/common/numbers/real.hpp"
#include "shared/control/loops.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests::control_loops_test {
namespace {

using control::Loop;
using control::Loops;
using control::LoopSetup;
using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;

constexpr double kTickS = 1.0 / 16000.0;
constexpr double kVelocityBase = 200.0;
constexpr double kTorqueBase = 0.5;
constexpr double kInertia = 1e-4;
constexpr double kViscous = 2e-4;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.velocity_base = kVelocityBase;
  d.torque_base = kTorqueBase;
  d.torque_constant = 0.125;
  d.current_base = 4.0;
  d.angle_base = kTurn;
  d.time_base = kTickS;
  return d;
}
LoopSetup<double> setup() {
  return {.position_gain = 20.0,
          .velocity_gain = 0.02,
          .integral_gain = 0.8,
          .velocity_limit = 150.0,
          .overspeed = 170.0,
          .torque_limit = 0.4,
          .current_limit = 3.0};
}
constexpr double kTorqueLimit = 0.375 / kTorqueBase;  // 3 A: below 0.4 N m
template <class N>
Loops::Coefficients<N> loops(const LoopSetup<double>& s = setup()) {
  return Loops::derive<N>(s, drive());
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
Loops::Command<Fixed> velocity_command(double rad_s, double feedforward = 0.0) {
  return {Loop::velocity, {}, Fixed::value(rad_s / kVelocityBase), Fixed::value(feedforward / kTorqueBase)};
}

// J w' = t - b w, exactly, with the torque held over a tick.
struct Motor {
  double velocity = 0.0;  // rad/s
  double turns = 0.0;
  bool locked = false;
  double viscous = kViscous;

  fixed::Angle angle() const { return {std::llround(std::ldexp(turns, 32))}; }
  Fixed::Value measured() const { return Fixed::value(velocity / kVelocityBase); }
  void tick(double torque) {
    if (locked) return;
    const double b = viscous, kept = std::exp(-b * kTickS / kInertia), end = torque / b;
    turns += (end * kTickS + (velocity - end) * (1.0 - kept) * kInertia / b) / kTurn;
    velocity = end + (velocity - end) * kept;
  }
};

TEST(Loops, TheVelocityLoopAnswersAStepAsItsDifferenceEquationDoes) {
  const auto c = loops<Fixed>();
  Loops::State<Fixed> s;
  Motor motor;
  const double set = 10.0;
  // w' = a w + g (Kv (r - w) + x), x' = x + Ki T (r - w): w[k] = r + C1 l1^k + C2 l2^k with w[0] = 0, w[1] = g Kv r.
  const double a = std::exp(-kViscous * kTickS / kInertia), g = (1.0 - a) / kViscous;
  const double half = (1.0 + a - g * 0.02) / 2.0, product = a - g * 0.02 + g * 0.8 * kTickS;
  const std::complex<double> root = std::sqrt(std::complex<double>(half * half - product)), l1 = half + root,
                             l2 = half - root;
  const std::complex<double> c1 = (g * 0.02 * set - set + set * l2) / (l1 - l2), c2 = -set - c1;
  double worst = 0.0, overshoot = 0.0;
  Loops::update(s, c, velocity_command(0.0), {}, motor.measured());  // closed at rest
  for (int k = 0; k < 8000; ++k) {
    const double expected = set + (c1 * std::pow(l1, k) + c2 * std::pow(l2, k)).real();
    worst = std::max(worst, std::abs(motor.velocity - expected));
    overshoot = std::max(overshoot, motor.velocity - set);
    const auto out = Loops::update(s, c, velocity_command(set), {}, motor.measured());
    ASSERT_FALSE(out.limited);
    motor.tick(real(out.torque) * kTorqueBase);
  }
  EXPECT_LT(worst, 1e-5);
  EXPECT_NEAR(motor.velocity, set, 1e-5);
  EXPECT_GT(overshoot, 0.05);  // as a PI loop does: it is not a loop at rest that agrees
}

TEST(Loops, ThePositionLoopFollowsARampWithItsLagAndWithFeedforwardWithoutAny) {
  for (const double feedforward : {0.0, 1.0}) {
    const auto c = loops<Fixed>();
    Loops::State<Fixed> s;
    Motor motor;
    const double speed = 30.0;  // rad/s
    double lag = 0.0;
    for (int k = 0; k < 32'000; ++k) {
      const double set = speed / kTurn * k * kTickS;
      lag = (set - motor.turns) * kTurn;
      const Loops::Command<Fixed> command{
          Loop::position, {std::llround(std::ldexp(set, 32))}, Fixed::value(feedforward * speed / kVelocityBase), {}};
      motor.tick(real(Loops::update(s, c, command, motor.angle(), motor.measured()).torque) * kTorqueBase);
    }
    EXPECT_NEAR(lag, (1.0 - feedforward) * speed / 20.0, 1e-5);
  }
}

// Many turns away: no step of the distance is lost, and the velocity limit holds.
TEST(Loops, ThePositionLoopComesFromFarWithinItsVelocityAndArrives) {
  const auto c = loops<Fixed>();
  for (const double start : {-300.0, 40.0, 0.7}) {
    Loops::State<Fixed> s;
    Motor motor{0.0, start};
    double fastest = 0.0;
    for (int k = 0; k < 16'000 * 15; ++k) {
      motor.tick(real(Loops::update(s, c, {Loop::position, {}, {}, {}}, motor.angle(), motor.measured()).torque) *
                 kTorqueBase);
      fastest = std::max(fastest, std::abs(motor.velocity));
    }
    EXPECT_NEAR(motor.turns, 0.0, 1e-7) << start;
    EXPECT_LT(fastest, 153.0);
    if (std::abs(start) > 10.0) {
      EXPECT_GT(fastest, 149.0);
    }
  }
}

TEST(Loops, AShaftThatIsHeldWindsNothingUp) {
  const auto c = loops<Fixed>();
  Loops::State<Fixed> s;
  Motor motor;
  motor.locked = true;
  Loops::Output<Fixed> out;
  for (int k = 0; k < 5 * 16'000; ++k) out = Loops::update(s, c, velocity_command(100.0), {}, motor.measured());
  EXPECT_TRUE(out.limited);
  EXPECT_NEAR(real(out.torque), kTorqueLimit, 1e-8);
  // The other way: at once at the other limit.
  out = Loops::update(s, c, velocity_command(-100.0), {}, motor.measured());
  EXPECT_NEAR(real(out.torque), -kTorqueLimit, 1e-8);
  // Let go: no more overshoot than from rest, where a loop that went on summing would run off.
  motor.locked = false;
  double highest = 0.0;
  for (int k = 0; k < 16'000; ++k) {
    motor.tick(real(Loops::update(s, c, velocity_command(100.0), {}, motor.measured()).torque) * kTorqueBase);
    highest = std::max(highest, motor.velocity);
  }
  EXPECT_NEAR(motor.velocity, 100.0, 0.01);
  EXPECT_LT(highest, 112.0);
}

// Beside it a loop without any guard against windup, in double.
TEST(Loops, AJumpThatSaturatesOvershootsFarLessThanWithoutAntiWindup) {
  const auto c = loops<Fixed>();
  Loops::State<Fixed> s;
  Motor motor, plain;
  double sum = 0.0, highest = 0.0, highest_plain = 0.0;
  for (int k = 0; k < 16'000; ++k) {
    motor.tick(real(Loops::update(s, c, velocity_command(140.0), {}, motor.measured()).torque) * kTorqueBase);
    const double error = 140.0 - plain.velocity;
    plain.tick(std::clamp(0.02 * error + sum, -0.375, 0.375));
    sum += 0.8 * kTickS * error;
    highest = std::max(highest, motor.velocity - 140.0);
    highest_plain = std::max(highest_plain, plain.velocity - 140.0);
  }
  EXPECT_GT(highest_plain, 50.0);
  EXPECT_LT(highest, 5.0);
}

TEST(Loops, NoTorqueAcceleratesTheMotorBeyondItsOverspeedAndOneThatIsDrivenThereIsBraked) {
  const auto c = loops<Fixed>();
  for (const auto loop : {Loop::torque, Loop::velocity, Loop::position}) {
    Loops::State<Fixed> s;
    Motor motor;
    motor.viscous = 1e-9;
    double fastest = 0.0;
    const Loops::Command<Fixed> command{loop, {std::int64_t{1} << 60}, Fixed::value(2.0), Fixed::value(2.0)};
    for (int k = 0; k < 32'000; ++k) {
      motor.tick(real(Loops::update(s, c, command, motor.angle(), motor.measured()).torque) * kTorqueBase);
      fastest = std::max(fastest, motor.velocity);
    }
    EXPECT_LT(fastest, 170.0);
    EXPECT_GT(fastest, 149.0);
    const auto out = Loops::update(s, c, command, {}, Fixed::value(1.0));  // 200 rad/s
    EXPECT_NEAR(real(out.torque), -kTorqueLimit, 1e-8);
  }
}

TEST(Loops, ClosingALoopAndChangingTheModeMakeNoStepOfTheTorque) {
  const auto c = loops<Fixed>();
  Loops::State<Fixed> s;
  const auto velocity = Fixed::value(0.2);
  const fixed::Angle angle{12345};
  // Closed on a turning shaft: from zero.
  auto out = Loops::update(s, c, velocity_command(42.0), angle, velocity);
  EXPECT_NEAR(real(out.torque), 0.0, 1e-8);
  // Torque loop gives the commanded torque; then back.
  out = Loops::update(s, c, {Loop::torque, {}, {}, Fixed::value(0.31)}, angle, velocity);
  EXPECT_NEAR(real(out.torque), 0.31, 1e-8);
  out = Loops::update(s, c, velocity_command(41.0, 0.05), angle, velocity);
  EXPECT_NEAR(real(out.torque), 0.31, 1e-8);
  for (int k = 0; k < 5; ++k) out = Loops::update(s, c, velocity_command(41.0, 0.05), angle, velocity);
  const double before = real(out.torque);
  out = Loops::update(s, c, {Loop::position, {12345 + 1'000'000}, velocity, {}}, angle, velocity);
  EXPECT_NEAR(real(out.torque), before, 1e-8);
  EXPECT_GT(before, 0.3);
  // Off is zero at once, and nothing is left over.
  out = Loops::update(s, c, {}, angle, velocity);
  EXPECT_EQ(out.torque.raw, 0);
  EXPECT_EQ(out.current.raw, 0);
  EXPECT_EQ(s.integral.raw, 0);
}

TEST(Loops, FeedforwardOfWhatTheMotorNeedsLeavesTheIntegralAlone) {
  const auto c = loops<Fixed>();
  Loops::State<Fixed> s;
  Motor motor;
  motor.velocity = 80.0;
  for (int k = 0; k < 16'000; ++k)
    motor.tick(real(Loops::update(s, c, velocity_command(80.0, kViscous * 80.0), {}, motor.measured()).torque) *
               kTorqueBase);
  EXPECT_NEAR(motor.velocity, 80.0, 1e-4);
  // Closed from no torque at all, so the integral first took the feedforward back, and then gave it up.
  EXPECT_NEAR(std::ldexp(static_cast<double>(s.integral.raw), -60), 0.0, 1e-4);
}

// The equations as the header states them, written a second time, in plain double.
class Equations {
 public:
  double tick(Loop loop, double distance_turns, double velocity_set, double torque_set, double w) {
    if (loop == Loop::off) {
      before_ = Loop::off;
      x_ = t_ = 0.0;
      return 0.0;
    }
    const double wl = 150.0 / 200.0, wo = 170.0 / 200.0, tl = kTorqueLimit;
    w = std::clamp(w, -2 * wo, 2 * wo);
    const double ff = std::clamp(torque_set, -2 * tl, 2 * tl), wf = std::clamp(velocity_set, -2 * wo, 2 * wo);
    double u = ff, e = 0.0;
    if (loop != Loop::torque) {
      const double from_position = std::clamp(20.0 * kTurn / 200.0 * distance_turns, -4.0, 4.0);
      e = std::clamp(wf + (loop == Loop::position ? from_position : 0.0), -wl, wl) - w;
      const double p = 0.02 * 200.0 / 0.5 * e;
      if (loop != before_) x_ = std::clamp(t_ - p - ff, -tl, tl);
      u = p + x_ + ff;
    }
    before_ = loop;
    const double high = std::clamp(tl * (wo - w) / (wo - wl), -tl, tl);
    const double low = std::clamp(-tl * (wo + w) / (wo - wl), -tl, tl);
    t_ = std::clamp(u, low, high);
    const bool pushes = (u > high && e > 0.0) || (u < low && e < 0.0);
    if (loop != Loop::torque && !pushes) x_ = std::clamp(x_ + 0.8 * kTickS * 200.0 / 0.5 * e, -tl, tl);
    return t_;
  }

 private:
  double x_ = 0.0, t_ = 0.0;
  Loop before_ = Loop::off;
};

TEST(Loops, HoldAllLimitsForAHundredThousandAdversarialTicksAndAgreeWithTheirEquations) {
  std::mt19937_64 random(23);
  const auto c = loops<Checked>();
  const auto c_fixed = loops<Fixed>();
  const auto c_real = loops<Real>();
  Loops::State<Checked> s;
  Loops::State<Fixed> s_fixed;
  Loops::State<Real> s_real;
  Equations equations;
  OverflowLog::clear();
  double worst = 0.0, worst_real = 0.0, largest = 0.0;
  int inside = 0;
  const auto signal = [&] { return static_cast<std::int32_t>(random()) >> (random() % 32); };
  Loop loop = Loop::velocity;
  for (int k = 0; k < 100'000; ++k) {
    if (random() % 50 == 0) loop = static_cast<Loop>(random() % 4);
    const fixed::Angle set{static_cast<std::int64_t>(random()) >> (random() % 64)};
    const fixed::Angle at{static_cast<std::int64_t>(random()) >> (random() % 64)};
    const fixed::Value velocity_set{signal()}, torque_set{signal()}, velocity{signal()};
    const auto out = Loops::update(s, c, {loop, set, {velocity_set}, {torque_set}}, at, Checked::Value{velocity});
    const auto fixed_out =
        Loops::update(s_fixed, c_fixed, {loop, set, {velocity_set}, {torque_set}}, at, Fixed::Value{velocity});
    ASSERT_EQ(out.torque.raw, fixed_out.torque.raw);
    const double distance = std::ldexp(static_cast<double>((set - at).raw), -32);
    const auto real_out =
        Loops::update(s_real, c_real, {loop, distance, real(velocity_set), real(torque_set)}, 0.0, real(velocity));
    const double expected = equations.tick(loop, distance, real(velocity_set), real(torque_set), real(velocity));
    worst = std::max(worst, std::abs(real(out.torque) - expected));
    worst_real = std::max(worst_real, std::abs(real_out.torque - expected));
    ASSERT_LE(std::abs(real(out.torque)), kTorqueLimit + 1e-8);
    ASSERT_LE(std::abs(real(out.current)), 3.0 / 4.0 + 1e-8);
    ASSERT_LE(std::abs(std::ldexp(static_cast<double>(s.integral.raw), -60)), kTorqueLimit + 1e-8);
    EXPECT_NEAR(real(out.current), real(out.torque) * 0.5 / 0.125 / 4.0, 1e-8);
    largest = std::max(largest, std::abs(real(out.torque)));
    if (loop != Loop::off && !out.limited) ++inside;
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  EXPECT_LT(worst, 3e-7);
  EXPECT_LT(worst_real, 1e-12);
  EXPECT_NEAR(largest, kTorqueLimit, 1e-8);
  EXPECT_GT(inside, 5000);
}

TEST(Loops, ReportGainsAndLimitsThatDoNotFit) {
  const auto found = [](LoopSetup<double> s) {
    OverflowLog::clear();
    loops<Fixed>(s);
    return OverflowLog::count() > 0;
  };
  EXPECT_FALSE(found(setup()));
  auto s = setup();
  s.integral_gain = 0.5 / kTickS / 200.0 * 1.1;
  EXPECT_TRUE(found(s));
  s = setup();
  s.overspeed = 150.0;
  EXPECT_TRUE(found(s));
  s = setup();
  s.overspeed = 401.0;
  EXPECT_TRUE(found(s));
  s = setup();
  s.torque_limit = 0.0;
  EXPECT_TRUE(found(s));
}

}  // namespace
}  // namespace flexspline::tests::control_loops_test
