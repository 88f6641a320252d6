// Orders of ripple from first principles and on the twin's motor and power stage: what the table of causes claims.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <functional>
#include <numbers>
#include <vector>

#include "shared/fixed/turn.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::order_causes_physics_test {
namespace {

// Amplitudes of the orders of one turn that is sampled evenly.
std::vector<double> amplitudes(const std::vector<double>& turn, int highest) {
  std::vector<double> list;
  for (int order = 0; order <= highest; ++order) {
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < turn.size(); ++k)
      sum += turn[k] * std::polar(1.0, -kTurn * order * static_cast<double>(k) / static_cast<double>(turn.size()));
    list.push_back(2.0 * std::abs(sum) / static_cast<double>(turn.size()));
  }
  return list;
}
int largest_order(const std::vector<double>& amplitudes) {
  return static_cast<int>(std::max_element(amplitudes.begin() + 1, amplitudes.end()) - amplitudes.begin());
}

// Park transform by its definition, of the q axis, over one mechanical turn.
std::vector<double> in_q(int pole_pairs, const std::function<double(double electrical, int phase)>& of_phase) {
  std::vector<double> turn;
  constexpr int kSteps = 5040;  // a multiple of many numbers
  for (int k = 0; k < kSteps; ++k) {
    const double electrical = pole_pairs * kTurn * (k + 0.5) / kSteps;
    double q = 0.0;
    for (int phase = 0; phase < 3; ++phase) {
      const double angle = electrical - kTurn * phase / 3.0;
      q -= 2.0 / 3.0 * std::sin(angle) * of_phase(angle, phase);
    }
    turn.push_back(q);
  }
  return turn;
}
// The phase current of a constant current in q.
double phase_current(double angle) {
  return -std::sin(angle);
}

TEST(OrdersByParkTransform, AnOffsetOfACurrentSensorTurnsOncePerElectricalTurn) {
  for (const int pole_pairs : {1, 4, 7}) {
    const auto list =
        amplitudes(in_q(pole_pairs, [](double, int phase) { return phase == 0 ? 0.1 : 0.0; }), 12 * pole_pairs);
    EXPECT_EQ(largest_order(list), pole_pairs);
    EXPECT_NEAR(list[static_cast<std::size_t>(pole_pairs)], 0.1 * 2.0 / 3.0, 1e-9);
    EXPECT_LT(list[2 * static_cast<std::size_t>(pole_pairs)], 1e-9);
  }
}

TEST(OrdersByParkTransform, AGainErrorTurnsTwicePerElectricalTurnInProportionToTheCurrent) {
  for (const int pole_pairs : {1, 4, 7})
    for (const double current : {1.0, 3.0}) {
      const auto list = amplitudes(
          in_q(pole_pairs,
               [&](double angle, int phase) { return phase == 0 ? 0.05 * current * phase_current(angle) : 0.0; }),
          12 * pole_pairs);
      EXPECT_EQ(largest_order(list), 2 * pole_pairs);
      EXPECT_NEAR(list[2 * static_cast<std::size_t>(pole_pairs)], 0.05 * current / 3.0, 1e-9);
      EXPECT_LT(list[static_cast<std::size_t>(pole_pairs)], 1e-9);
    }
}

TEST(OrdersByParkTransform, DeadTimeTurnsSixTimesPerElectricalTurnAndDoesNotDependOnTheCurrent) {
  for (const int pole_pairs : {1, 4, 7}) {
    const auto list = amplitudes(
        in_q(pole_pairs, [](double angle, int) { return std::copysign(1.0, -phase_current(angle)); }), 14 * pole_pairs);
    EXPECT_EQ(largest_order(list), 6 * pole_pairs);
    // The fifth and the seventh harmonic of a square wave, 4/(5 pi) and 4/(7 pi), one turning backwards.
    EXPECT_NEAR(list[6 * static_cast<std::size_t>(pole_pairs)], 4.0 / std::numbers::pi * (1.0 / 5.0 - 1.0 / 7.0), 2e-3);
    for (int order = 1; order <= 14 * pole_pairs; ++order)
      if (order % (6 * pole_pairs) != 0) {
        EXPECT_LT(list[static_cast<std::size_t>(order)], 1e-9) << order;
      }
  }
}

// Acceleration by second differences of the readings of an encoder whose disc is off centre, at constant speed.
TEST(OrdersOfAnEncoder, AnEccentricDiscLooksLikeAnAccelerationOnceATurnThatGrowsWithTheSquareOfTheSpeed) {
  constexpr double kEccentricity_rad = 1e-3;
  for (const double speed : {10.0, 20.0}) {
    constexpr int kSteps = 2000;
    const double step_s = kTurn / speed / kSteps;
    const auto reading = [&](int k) {
      const double angle = kTurn * k / kSteps;
      return std::atan2(std::sin(angle), std::cos(angle) - kEccentricity_rad);
    };
    std::vector<double> acceleration;
    for (int k = -kSteps / 2 + 2; k < kSteps / 2 - 2; ++k)
      acceleration.push_back((reading(k + 1) - 2.0 * reading(k) + reading(k - 1)) / (step_s * step_s));
    const auto list = amplitudes(acceleration, 20);
    EXPECT_EQ(largest_order(list), 1);
    EXPECT_NEAR(list[1], kEccentricity_rad * speed * speed, 0.01 * list[1]);
  }
}

// Attraction between every magnet and every slot: a short bump over the angle between them. Its slope is the torque.
std::vector<double> cogging(int poles, int slots, double odd_magnet, double odd_slot) {
  std::vector<double> turn;
  constexpr int kSteps = 5040;
  for (int k = 0; k < kSteps; ++k) {
    double torque = 0.0;
    for (int m = 0; m < poles; ++m)
      for (int s = 0; s < slots; ++s) {
        const double angle =
            kTurn * (static_cast<double>(k) / kSteps + static_cast<double>(m) / poles - static_cast<double>(s) / slots);
        const double weight = (m == 0 ? odd_magnet : 1.0) * (s == 0 ? odd_slot : 1.0);
        constexpr double kNarrow = 200.0;
        torque += weight * std::sin(angle) * std::exp(kNarrow * (std::cos(angle) - 1.0));
      }
    turn.push_back(torque);
  }
  return turn;
}

TEST(OrdersOfCogging, AreTheLeastCommonMultipleAndWithOneOddPartThatOfTheOtherKind) {
  struct Motor {
    int poles, slots, multiple;
  };
  for (const Motor m : {Motor{14, 12, 84}, Motor{8, 9, 72}, Motor{8, 12, 24}, Motor{10, 12, 60}}) {
    const auto even = amplitudes(cogging(m.poles, m.slots, 1.0, 1.0), 100);
    EXPECT_EQ(largest_order(even), m.multiple) << m.slots << " slots, " << m.poles << " poles";
    EXPECT_LT(even[static_cast<std::size_t>(m.slots)], 1e-6 + 1e-6 * even[static_cast<std::size_t>(m.multiple)]);
    const auto magnet = amplitudes(cogging(m.poles, m.slots, 0.9, 1.0), 100);
    EXPECT_GT(magnet[static_cast<std::size_t>(m.slots)], 1e-3);
    EXPECT_LT(magnet[static_cast<std::size_t>(m.poles)], 1e-9);
    const auto slot = amplitudes(cogging(m.poles, m.slots, 1.0, 0.9), 100);
    EXPECT_GT(slot[static_cast<std::size_t>(m.poles)], 1e-3);
    EXPECT_LT(slot[static_cast<std::size_t>(m.slots)], 1e-9);
  }
}

// How many teeth of a spline a lobe passes in a turn of the wave generator, in which the spline goes round by
// `spline_per_turn` of a turn.
long passed(int teeth, double spline_per_turn) {
  return std::lround(teeth * (1.0 - spline_per_turn));
}

TEST(OrdersOfTheMesh, AreThoseOfTheTeethOfTheFixedSplineForBothSplines) {
  for (const int flexspline_teeth : {100, 160, 200, 320}) {
    const int circular_teeth = flexspline_teeth + 2;
    // In a turn of the wave generator both splines move two teeth against each other. Fixed circular spline: the
    // flexspline turns back by two of its teeth, and the ratio is half their number.
    const double back = -2.0 / flexspline_teeth, ratio = 1.0 / -back;
    EXPECT_EQ(passed(circular_teeth, 0.0), std::lround(2.0 * ratio + 2.0));
    EXPECT_EQ(passed(flexspline_teeth, back), std::lround(2.0 * ratio + 2.0));
    // Fixed flexspline: the circular spline turns on by two of its own.
    const double on = 2.0 / circular_teeth, other = 1.0 / on;
    EXPECT_EQ(passed(flexspline_teeth, 0.0), std::lround(2.0 * other - 2.0));
    EXPECT_EQ(passed(circular_teeth, on), std::lround(2.0 * other - 2.0));
  }
}

// Orders over a mechanical turn at constant speed, under the drive's own current control.
struct TwinOrders {
  std::vector<double> torque_nm;
  std::vector<double> measured_a;  // in q, as the control measures it
};
TwinOrders orders_on_twin(const foc_rig::Bench& bench, const deployment::FocSetup& setup, double current_a) {
  const int periods = 2000;  // an electrical turn: 10 Hz at 20 kHz
  foc_rig::Rig rig(bench, setup, motor::Fidelity::averaged, kTurn * bench.inverter.pwm_hz / periods);
  for (int k = 0; k < periods; ++k) rig.step(0.0, current_a);
  std::vector<double> torque, measured;
  for (int k = 0; k < bench.motor.pole_pairs * periods; ++k) {
    torque.push_back(rig.step(0.0, current_a).torque_nm);
    measured.push_back(std::ldexp(rig.outputs().measured.q, -27) * bench.sensors.full_scale_a);
  }
  const int highest = 8 * bench.motor.pole_pairs;
  return {amplitudes(torque, highest), amplitudes(measured, highest)};
}

// A motor without errors of its own; the least ripple that counts is of its noise and steps.
foc_rig::Bench even_bench(int pole_pairs) {
  foc_rig::Bench bench;
  bench.motor.pole_pairs = pole_pairs;
  bench.sensors.bits = 16;
  return bench;
}

double newton_metre_per_ampere(const foc_rig::Bench& bench) {
  return 1.5 * bench.motor.pole_pairs * bench.motor.flux_vs;
}

TEST(OrdersOnTheTwin, AnOffsetOfACurrentSensorRipplesWithThePolePairsAtEveryLoadAndHidesInTheMeasuredCurrent) {
  for (const int pole_pairs : {4, 7}) {
    foc_rig::Bench bench = even_bench(pole_pairs);
    bench.sensors.offset_a = {0.4, -0.2, -0.2};
    for (const double current : {4.0, 8.0}) {
      const TwinOrders found = orders_on_twin(bench, foc_rig::setup_of(bench), current);
      EXPECT_EQ(largest_order(found.torque_nm), pole_pairs);
      // The offset's amplitude in the rotor's axes is 0.4 A.
      const auto order = static_cast<std::size_t>(pole_pairs);
      const double expected = newton_metre_per_ampere(bench) * 0.4;
      EXPECT_NEAR(found.torque_nm[order], expected, 0.05 * expected) << current;
      EXPECT_LT(found.measured_a[order], 0.02 * 0.4);
    }
  }
}

TEST(OrdersOnTheTwin, UnequalGainsOfTheCurrentSensorsRippleWithTwiceThePolePairsInProportionToTheLoad) {
  for (const int pole_pairs : {4, 7}) {
    foc_rig::Bench bench = even_bench(pole_pairs);
    bench.sensors.gain = {1.06, 0.97, 0.97};
    std::vector<double> ripple;
    for (const double current : {4.0, 8.0}) {
      const auto list = orders_on_twin(bench, foc_rig::setup_of(bench), current).torque_nm;
      EXPECT_EQ(largest_order(list), 2 * pole_pairs);
      ripple.push_back(list[2 * static_cast<std::size_t>(pole_pairs)]);
    }
    EXPECT_NEAR(ripple[1] / ripple[0], 2.0, 0.1);
  }
}

TEST(OrdersOnTheTwin, DeadTimeWithoutCompensationRipplesWithSixTimesThePolePairsAndShowsInTheMeasuredCurrent) {
  for (const int pole_pairs : {4, 7}) {
    foc_rig::Bench bench = even_bench(pole_pairs);
    deployment::FocSetup setup = foc_rig::setup_of(bench);
    const auto order = 6 * static_cast<std::size_t>(pole_pairs);
    const double with = orders_on_twin(bench, setup, 4.0).torque_nm[order];
    setup.dead_time_s = setup.dead_time_zone_a = setup.diode_drop_v = 0.0;
    const TwinOrders without = orders_on_twin(bench, setup, 4.0), loaded = orders_on_twin(bench, setup, 8.0);
    EXPECT_EQ(largest_order(without.torque_nm), static_cast<int>(order));
    std::printf(
        "%d pole pairs, order %zu: %.2e N m without compensation of dead time, %.2e at twice the load; %.2e "
        "with compensation\n",
        pole_pairs, order, without.torque_nm[order], loaded.torque_nm[order], with);
    EXPECT_GT(without.torque_nm[order], 10.0 * with);
    EXPECT_NEAR(loaded.torque_nm[order] / without.torque_nm[order], 1.0, 0.2);
    EXPECT_NEAR(without.measured_a[order] * newton_metre_per_ampere(bench) / without.torque_nm[order], 1.0, 0.1);
  }
}

TEST(OrdersOnTheTwin, HarmonicsOfTheBackEmfRippleWithSixTimesThePolePairsInProportionToTheLoad) {
  foc_rig::Bench bench = even_bench(4);
  bench.motor.harmonic_5 = 0.05;
  bench.motor.harmonic_7 = 0.01;
  const auto low = orders_on_twin(bench, foc_rig::setup_of(bench), 4.0).torque_nm;
  const auto high = orders_on_twin(bench, foc_rig::setup_of(bench), 8.0).torque_nm;
  EXPECT_EQ(largest_order(high), 24);
  EXPECT_NEAR(high[24] / low[24], 2.0, 0.2);
}

}  // namespace
}  // namespace flexspline::order_causes_physics_test
