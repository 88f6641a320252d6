// The interface of effects: the same header runs in double, in dual numbers and in fixed point with a type for each
// kind of number. Three effects stand for all: one without memory, one with a state that is moved by travel, and a
// shift.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <type_traits>
#include <vector>

#include "host/numbers/dual.hpp"
#include "host/numbers/real.hpp"
#include "shared/effects/backlash.hpp"
#include "shared/effects/coulomb_friction.hpp"
#include "shared/effects/dahl_friction.hpp"
#include "tests/unit/trial_fixed.hpp"

namespace flexspline::tests {
namespace {

using effects::Backlash;
using effects::CoulombFriction;
using effects::DahlFriction;
using effects::DriveConstants;
using effects::Inputs;
using effects::Torques;
using numbers::Dual;
using numbers::Jet;
using numbers::Real;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kRatedVelocityRadS = 200.0;
constexpr double kTickS = 1.0 / 16000.0;
const double kValueUnit = std::ldexp(1.0, -TrialFixed::kValueBits);
const double kAngleUnit = std::ldexp(1.0, -TrialFixed::kAngleBits);

// Rated values of the report's drive as bases; angles count in turns.
DriveConstants<double> per_unit() {
  DriveConstants<double> drive;
  drive.torque_base = 0.4;
  drive.angle_base = kTurn;
  drive.torsion_base = 1e-3;
  return drive;
}
const DriveConstants<double> kSi;

// Torque of dahl_friction in N m after each sample of the path, in double and SI units.
template <class N, class P>
std::vector<typename N::Value> dahl_along(const P* parameters, const std::vector<double>& path_rad) {
  const auto c = DahlFriction::derive<N>(parameters, DriveConstants<P>{});
  DahlFriction::State<N> state;
  Inputs<N> now;
  Inputs<N> before;
  now.coulomb_scale = typename N::Value(1.0);
  now.angle = typename N::Angle(path_rad.front());
  std::vector<typename N::Value> torque;
  for (const double angle : path_rad) {
    before = now;
    now.angle = typename N::Angle(angle);
    DahlFriction::advance(state, c, now, before);
    Torques<N> out{};
    DahlFriction::evaluate(state, c, now, out);
    torque.push_back(out.motor);
  }
  return torque;
}

// The same on a drive: angles in fixed point, torque per unit.
class DahlOnDrive {
 public:
  DahlOnDrive(double torque_nm, double presliding_rad) {
    const double parameters[] = {torque_nm, presliding_rad};
    coefficients_ = DahlFriction::derive<TrialFixed>(parameters, per_unit());
    now_.coulomb_scale = TrialFixed::value(1.0);
  }
  void start_at(TrialFixed::Angle angle) { now_.angle = angle; }
  double move_to(TrialFixed::Angle angle) {
    before_ = now_;
    now_.angle = angle;
    DahlFriction::advance(state_, coefficients_, now_, before_);
    Torques<TrialFixed> out{};
    DahlFriction::evaluate(state_, coefficients_, now_, out);
    return to_double(out.motor) * per_unit().torque_base;
  }
  double share() const { return to_double(state_.deflection); }
  void round_state_to_32_bits() {
    const double rounded = to_double(TrialFixed::narrow(state_.deflection));
    state_.deflection.raw = static_cast<std::int64_t>(std::ldexp(rounded, TrialFixed::kStateBits));
  }

 private:
  DahlFriction::Coefficients<TrialFixed> coefficients_;
  DahlFriction::State<TrialFixed> state_;
  Inputs<TrialFixed> now_;
  Inputs<TrialFixed> before_;
};

// Kinds of numbers that become one another only through a named function, and never from a double by themselves.
static_assert(!std::is_convertible_v<double, TrialFixed::Value> && !std::is_convertible_v<int, TrialFixed::Value>);
static_assert(!std::is_convertible_v<TrialFixed::Step, TrialFixed::Value>);
static_assert(!std::is_convertible_v<TrialFixed::State, TrialFixed::Value>);
static_assert(!std::is_convertible_v<TrialFixed::Value, TrialFixed::Sum>);
static_assert(!std::is_convertible_v<TrialFixed::Angle, TrialFixed::Step>);

TEST(TrialFixed, ExponentialIsWithinItsStatedErrorAndKeepsTheSmallestTravel) {
  double worst = 0.0;
  for (int k = 0; k <= 20000; ++k) {
    const TrialFixed::Travel x{static_cast<std::int64_t>(k) * 446'000'000'000'000};  // 0 to 30.9
    const long double exact = expl(-ldexpl(static_cast<long double>(x.raw), -TrialFixed::kTravelBits));
    const auto given = ldexpl(static_cast<long double>(TrialFixed::exp_negative(x).raw), -TrialFixed::kStateBits);
    worst = std::max(worst, static_cast<double>(fabsl(given - exact)));
  }
  EXPECT_LT(worst, 1e-16);
  EXPECT_EQ(TrialFixed::exp_negative({0}).raw, std::int64_t{1} << TrialFixed::kStateBits);
  // A travel of 1e-12 of the presliding length: 1 - exp(-x) to four digits.
  const TrialFixed::Travel small{static_cast<std::int64_t>(std::ldexp(1e-12, TrialFixed::kTravelBits))};
  const double lost = 1.0 - std::ldexp(static_cast<double>(TrialFixed::exp_negative(small).raw >> 10), -50);
  EXPECT_NEAR(lost, 1e-12, 1e-15);
}

TEST(TrialFixed, GainClampsItsInputSoThatNoSizeOfGainOverflows) {
  for (const double size : {1e-9, 3e-4, 0.3, 1.0, 7.0, 900.0, 1e6}) {
    for (const double sign : {-1.0, 1.0}) {
      const TrialFixed::Gain gain = TrialFixed::gain(sign * size);
      for (const double x : {-15.99, -1.0, -1e-4, 0.0, 2e-6, 0.7, 15.99}) {
        const double limit = TrialFixed::kLargestValue / size;
        const double input = to_double(TrialFixed::value(x));
        const double expected = sign * size * std::clamp(input, -limit, limit);
        // Half a unit of the mantissa; what the limit loses by rounding down; half a unit of the result.
        const double bound = 16.0 * std::ldexp(1.0, -30) + size * kValueUnit;
        EXPECT_NEAR(to_double(gain * TrialFixed::value(x)), expected, bound + std::ldexp(1.0, -45));
        EXPECT_NEAR(to_double(TrialFixed::scaled(gain, TrialFixed::value(x))), expected, bound + kValueUnit / 2);
      }
    }
  }
  EXPECT_THROW(TrialFixed::gain(1e12), std::range_error);
  EXPECT_THROW(TrialFixed::value(16.0), std::range_error);
  EXPECT_THROW(TrialFixed::value(std::nan("")), std::range_error);
}

TEST(EffectInterface, CoulombFrictionInFixedPointAgreesWithDouble) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  double worst_share = 0.0;
  for (int k = 0; k < 20000; ++k) {
    const double torque_nm = std::pow(10.0, 2.0 * unit(random) - 2.0);  // 1e-4 to 1
    const double direction = k % 3 == 0 ? (k % 2 == 0 ? 1.0 : -1.0) : unit(random);
    const double scale = 1.0 + unit(random);
    const auto run = [&]<class N>(const N&, const DriveConstants<double>& drive, auto to_value) {
      const auto c = CoulombFriction::derive<N>(&torque_nm, drive);
      Inputs<N> in;
      in.direction = to_value(direction);
      in.coulomb_scale = to_value(scale);
      Torques<N> out{};
      CoulombFriction::evaluate(CoulombFriction::State<N>{}, c, in, out);
      return out.motor;
    };
    const double real = run(Real{}, kSi, [](double x) { return x; });
    const double fixed = to_double(run(TrialFixed{}, per_unit(), &TrialFixed::value)) * per_unit().torque_base;
    EXPECT_NEAR(real, torque_nm * direction * scale, 1e-15);
    worst_share = std::max(worst_share, std::abs(fixed - real) / torque_nm);
  }
  // Half a unit for direction times a scale of up to two, half for the scale, half for their product, and some 2^-30
  // for the gain; the sum's own 2^-45 is below that for the torques here.
  EXPECT_LT(worst_share, 2.3 * kValueUnit);
  EXPECT_GT(worst_share, 0.1 * kValueUnit);  // it is fixed point that was measured
}

TEST(EffectInterface, DahlFrictionInFixedPointFollowsDoubleAlongReversals) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 20; ++run) {
    const double torque_nm = 0.01 + 0.2 * unit(random);
    const double presliding_rad = 0.005 * std::pow(20.0, unit(random));
    const double amplitude_rad = presliding_rad * std::pow(10.0, 2.0 * unit(random) - 0.5);
    const double ratio = 1.5 + 3.0 * unit(random);
    const double start_rad = 1000.0 * kTurn * (unit(random) - 0.5);
    std::vector<double> path;
    for (int k = 0; k < 8000; ++k)
      path.push_back(start_rad + amplitude_rad * (std::sin(1e-3 * k) + 0.6 * std::sin(1e-3 * ratio * k)));
    const double parameters[] = {torque_nm, presliding_rad};
    const std::vector<double> real = dahl_along<Real>(parameters, path);

    DahlOnDrive drive(torque_nm, presliding_rad);
    drive.start_at(TrialFixed::angle(path.front() / kTurn));
    double worst = 0.0;
    double largest = 0.0;
    for (std::size_t k = 0; k < path.size(); ++k) {
      worst = std::max(worst, std::abs(drive.move_to(TrialFixed::angle(path[k] / kTurn)) - real[k]));
      largest = std::max(largest, std::abs(real[k]));
    }
    EXPECT_GT(largest, 0.2 * torque_nm);
    // The angle is off by half a unit at each reversal that friction still remembers (eight at most here), the torque
    // by a unit; the double's own angle far from nought by some 1e-12 rad.
    const double bound = 2.0 * kValueUnit + 4.0 * kTurn * kAngleUnit / presliding_rad;
    EXPECT_LT(worst, torque_nm * bound) << "run " << run;
  }
}

// At a millionth of rated speed a tick moves the shaft by nine units of the angle.
TEST(EffectInterface, DahlFrictionInFixedPointLosesNothingInSlowMotion) {
  const double step_turns = 1e-6 * kRatedVelocityRadS * kTickS / kTurn;
  const double presliding_rad = 0.05;
  const auto angle_at = [&](int tick) { return TrialFixed::angle(3.7 + step_turns * tick); };
  DahlOnDrive drive(0.045, presliding_rad);
  drive.start_at(angle_at(0));
  const int turning_point = 600'000;
  double torque = 0.0;
  for (int tick = 1; tick <= turning_point; ++tick) torque = drive.move_to(angle_at(tick));
  const auto travel_rad = [&](int from, int to) {
    return kTurn * kAngleUnit * std::abs(static_cast<double>(angle_at(to).raw - angle_at(from).raw));
  };
  const double peak = -std::expm1(-travel_rad(0, turning_point) / presliding_rad);
  EXPECT_GT(peak, 0.1);
  EXPECT_NEAR(drive.share(), peak, 1e-9 * peak);  // of the gain's 30 bits
  EXPECT_NEAR(torque, 0.045 * peak, 0.045 * kValueUnit);
  for (int tick = turning_point - 1; tick >= turning_point / 2; --tick) drive.move_to(angle_at(tick));
  const double back = std::exp(-travel_rad(turning_point, turning_point / 2) / presliding_rad);
  EXPECT_NEAR(drive.share(), -1.0 + (peak + 1.0) * back, 2e-9 * peak);
}

TEST(EffectInterface, AStateOf32BitsWouldLoseWhatTheWideStateKeeps) {
  const double presliding_rad = 2.0;  // the smallest step of angle is then below half a unit of a Value
  DahlOnDrive wide(0.045, presliding_rad);
  DahlOnDrive narrow(0.045, presliding_rad);
  const int ticks = 100'000;
  for (int tick = 1; tick <= ticks; ++tick) {
    wide.move_to({tick});
    narrow.move_to({tick});
    narrow.round_state_to_32_bits();
  }
  const double expected = -std::expm1(-kTurn * kAngleUnit * ticks / presliding_rad);
  EXPECT_NEAR(wide.share(), expected, 1e-8 * expected);
  EXPECT_EQ(narrow.share(), 0.0);
}

TEST(EffectInterface, DahlFrictionDoesNotSeeTheWrapOfTheAngle) {
  DahlOnDrive wrapped(0.045, 0.05);
  DahlOnDrive plain(0.045, 0.05);
  const auto shifted = [](std::uint64_t by, int tick) {
    return TrialFixed::Angle{static_cast<std::int64_t>(by + static_cast<std::uint64_t>(tick) * 1'000'000)};
  };
  const std::uint64_t near_the_end = (std::uint64_t{1} << 63) - 50'000'000;
  wrapped.start_at(shifted(near_the_end, 0));
  plain.start_at(shifted(0, 0));
  for (int tick = 1; tick <= 100; ++tick)
    EXPECT_EQ(wrapped.move_to(shifted(near_the_end, tick)), plain.move_to(shifted(0, tick)));
  EXPECT_GT(plain.share(), 0.9);
}

TEST(EffectInterface, BacklashInFixedPointAgreesWithDouble) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int inside = 0;
  for (int k = 0; k < 20000; ++k) {
    const double half_width_rad = 2e-4 * std::abs(unit(random));
    const double torsion_rad = 5e-4 * unit(random);
    const auto run = [&]<class N>(const N&, const DriveConstants<double>& drive, auto to_value) {
      const auto c = Backlash::derive<N>(&half_width_rad, drive);
      Inputs<N> in;
      in.torsion = to_value(torsion_rad / drive.torsion_base);
      Backlash::shift(c, in);
      return in.torsion;
    };
    const double real = run(Real{}, kSi, [](double x) { return x; });
    const double fixed = to_double(run(TrialFixed{}, per_unit(), &TrialFixed::value)) * per_unit().torsion_base;
    // Half a unit each for torsion and half width.
    EXPECT_NEAR(fixed, real, kValueUnit * per_unit().torsion_base * (1.0 + 1e-6));
    inside += real == 0.0 ? 1 : 0;
  }
  EXPECT_GT(inside, 1000);
}

TEST(EffectInterface, DualDerivativesOfTheThreeEffectsAgreeWithFiniteDifferences) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int run = 0; run < 20; ++run) {
    const double parameters[] = {0.01 + 0.1 * unit(random), 0.01 + 0.1 * unit(random)};
    std::vector<double> path;
    for (int k = 0; k < 300; ++k) path.push_back(0.1 * std::sin(0.05 * k) + 0.03 * std::sin(0.2 * k));
    for (int which = 0; which < 2; ++which) {
      const double step = 1e-5 * parameters[which];
      double above[] = {parameters[0], parameters[1]};
      double below[] = {parameters[0], parameters[1]};
      above[which] += step;
      below[which] -= step;
      Jet seeded[] = {Jet(parameters[0]), Jet(parameters[1])};
      seeded[which].v[0] = 1.0;

      const std::vector<Jet> dual = dahl_along<Dual>(seeded, path);
      const std::vector<double> high = dahl_along<Real>(above, path);
      const std::vector<double> low = dahl_along<Real>(below, path);
      const double scale = which == 0 ? 1.0 : parameters[0] / parameters[1];
      for (std::size_t k = 0; k < path.size(); ++k)
        ASSERT_NEAR(dual[k].v[0], (high[k] - low[k]) / (2.0 * step), 1e-7 * scale);
    }

    Inputs<Dual> in;
    in.direction = Jet(2.0 * unit(random) - 1.0);
    in.coulomb_scale = Jet(0.8);
    Torques<Dual> out{};
    const Jet torque(parameters[0], 0);
    CoulombFriction::evaluate(CoulombFriction::State<Dual>{}, CoulombFriction::derive<Dual>(&torque, {}), in, out);
    EXPECT_NEAR(out.motor.v[0], 0.8 * in.direction.a, 1e-15);

    const Jet half_width(1e-4, 0);
    for (const double torsion : {-3e-4, -0.5e-4, 0.0, 0.5e-4, 3e-4}) {
      in.torsion = Jet(torsion);
      Backlash::shift(Backlash::derive<Dual>(&half_width, {}), in);
      const double slope = torsion > 1e-4 ? -1.0 : torsion < -1e-4 ? 1.0 : 0.0;
      EXPECT_NEAR(in.torsion.v[0], slope, 1e-15);
    }
  }
}

}  // namespace
}  // namespace flexspline::tests
