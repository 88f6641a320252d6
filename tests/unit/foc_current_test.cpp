// The response of the current loop to a step on motors that it is told wrong parameters of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "tests/unit/foc_rig.hpp"

namespace flexspline::foc_rig::foc_current_test {
namespace {

// The design's response as the samples show it: it begins half a period after the one at which the set point steps.
double design_rise_s(double period) {
  std::vector<double> y(200);
  for (std::size_t k = 1; k < y.size(); ++k)
    y[k] = -std::expm1(-2.0 * std::numbers::pi * 1000.0 * (static_cast<double>(k) - 0.5) * period);
  return response_of(y, 0.0, 1.0, period).rise_s;
}

struct Worst {
  double rise_low = 1e9, rise_high = 0.0, overshoot = 0.0;
};

// A step in q that needs a third of the voltage, at a speed whose back-EMF needs up to a third more.
Response step_response(std::mt19937_64& random, motor::Fidelity fidelity, double error, double pwm_hz) {
  const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
  Bench b = random_bench(random);
  b.inverter.pwm_hz = pwm_hz;
  const auto off = [&] { return error * (2.0 * uniform() - 1.0); };
  const double e_r = off(), e_d = off(), e_q = off(), e_flux = off();
  const auto setup = setup_of(b, e_r, e_d, e_q, e_flux);
  const double voltage = b.inverter.supply_v / std::sqrt(3.0);
  const double speed = std::min(2.0 * std::numbers::pi * 500.0, voltage / 3.0 / b.motor.flux_vs) * uniform();
  const double per_ampere = b.motor.resistance_ohm + 2.0 * std::numbers::pi * 1000.0 * b.motor.inductance_q_h * 1.3;
  const double step = std::min(20.0, voltage / 3.0 / per_ampere) * (random() % 2 == 0 ? 1.0 : -1.0);
  Rig rig(b, setup, fidelity, speed);
  const int settling_ticks = 400, after = 120;
  for (int k = 0; k < settling_ticks; ++k) rig.step(0.0, 0.0);
  const double start = rig.sample().current.q;
  std::vector<double> y;
  for (int k = 0; k < after; ++k) y.push_back(rig.step(0.0, step).current.q);
  return response_of(y, start, step, rig.stage().period_s());
}

// Rise over that of the design, and overshoot, of the worst of `motors`.
Worst worst_of(int motors, motor::Fidelity fidelity, double error, double pwm_hz, double bound) {
  std::mt19937_64 random(11);
  Worst worst;
  const double design = design_rise_s(1.0 / pwm_hz);
  for (int k = 0; k < motors; ++k) {
    const Response r = step_response(random, fidelity, error, pwm_hz);
    EXPECT_NEAR(r.rise_s / design, 1.0, bound) << k;
    EXPECT_LE(r.overshoot, 0.1) << k;
    worst.rise_low = std::min(worst.rise_low, r.rise_s / design);
    worst.rise_high = std::max(worst.rise_high, r.rise_s / design);
    worst.overshoot = std::max(worst.overshoot, r.overshoot);
  }
  std::printf("%s, %.0f kHz, %d motors, errors of %.0f %%: rise %.3f to %.3f of the design, overshoot at most %.3f\n",
              fidelity == motor::Fidelity::averaged ? "averaged" : "switched", pwm_hz / 1e3, motors, 100.0 * error,
              worst.rise_low, worst.rise_high, worst.overshoot);
  return worst;
}

TEST(FocCurrentLoop, AStepHasTheDesignsRiseAndOvershootOnAveragedMotorsWithWrongParameters) {
  worst_of(200, motor::Fidelity::averaged, 0.2, 40e3, 0.1);
}
TEST(FocCurrentLoop, AStepHasTheDesignsRiseAndOvershootOnSwitchedMotorsWithWrongParameters) {
  worst_of(40, motor::Fidelity::switched, 0.2, 40e3, 0.1);
}
TEST(FocCurrentLoop, AStepIsTheDesignsOwnWhereTheParametersAreExact) {
  worst_of(50, motor::Fidelity::averaged, 0.0, 40e3, 0.05);
  worst_of(50, motor::Fidelity::averaged, 0.0, 20e3, 0.06);
}
// At 20 kHz a rise lasts seven periods, and the loop has other gains.
TEST(FocCurrentLoop, AtHalfTheRateAStepHasTheDesignsRiseAndOvershootOnMotorsWithWrongParameters) {
  worst_of(200, motor::Fidelity::averaged, 0.2, 20e3, 0.1);
  worst_of(40, motor::Fidelity::switched, 0.2, 20e3, 0.1);
}
// The voltage noise of these gains, which is what they cost, over that of the current's reading.
TEST(FocCurrentLoop, NoiseOfTheReadingsShowsInTheVoltageByTheRateOverTheBandwidth) {
  for (const auto& [pwm_hz, most] : {std::pair{40e3, 1.3}, std::pair{20e3, 4.5}}) {
    Bench b;
    b.inverter.pwm_hz = pwm_hz;
    b.inverter.dead_time_s = 0.0;
    b.sensors.noise_a = 0.05;
    Rig rig(b, setup_of(b), motor::Fidelity::averaged, 0.0);
    double sum = 0.0, square = 0.0;
    const int settling = 400, all = 20000;
    for (int k = 0; k < settling; ++k) rig.step(0.0, 5.0);
    const double volt = std::ldexp(b.sensors.bus_full_scale_v, rig.settings().current.voltage_exponent - 30);
    for (int k = 0; k < all; ++k) {
      rig.step(0.0, 5.0);
      const double u = rig.outputs().wanted.q * volt;
      sum += u / all;
      square += u * u / all;
    }
    // Noise of three sensors, of which Clarke's transform leaves sqrt(2/3) in each axis; by L/T to a voltage.
    const double seen = std::sqrt(2.0 / 3.0) * b.sensors.noise_a * b.motor.inductance_q_h * pwm_hz;
    const double gain = std::sqrt(square - sum * sum) / seen;
    std::printf("%.0f kHz: noise in the voltage %.2f of the reading's by L/T\n", pwm_hz / 1e3, gain);
    EXPECT_LT(gain, most);
    EXPECT_GT(gain, most / 3.0);
  }
}

Bench fast_motor() {
  Bench b;
  b.motor.flux_vs = 0.012;
  return b;
}

TEST(FocCurrentLoop, ChangesOfOneAxisHardlyReachTheOtherAtSpeed) {
  const Bench b = fast_motor();
  Rig rig(b, setup_of(b), motor::Fidelity::averaged, 2.0 * std::numbers::pi * 250.0);
  for (int k = 0; k < 400; ++k) rig.step(0.0, 0.0);
  double worst = 0.0;
  for (int k = 0; k < 200; ++k) worst = std::max(worst, std::abs(rig.step(0.0, 4.0).current.d));
  std::printf("a step of 4 A in q at 250 Hz moves d by %.3f A at most\n", worst);
  EXPECT_LT(worst, 0.15);
  EXPECT_NEAR(rig.sample().current.q, 4.0, 0.05);
}

TEST(FocCurrentLoop, AfterLongSaturationItIsBackWithoutOvershoot) {
  const Bench b = fast_motor();
  // The back-EMF alone needs more than the bus has: the current is where the voltage lets it be.
  const double speed = 2.0 * std::numbers::pi * 380.0;
  Rig rig(b, setup_of(b), motor::Fidelity::averaged, speed);
  for (int k = 0; k < 4000; ++k) rig.step(0.0, 15.0);
  const double held = rig.sample().current.q;
  EXPECT_LT(held, 10.0);
  // In its range again: the current goes to its set point as a step does.
  rig.set_speed(speed / 4.0);
  std::vector<double> y;
  for (int k = 0; k < 200; ++k) y.push_back(rig.step(0.0, 5.0).current.q);
  double most = 0.0;
  for (std::size_t k = 40; k < y.size(); ++k) most = std::max(most, std::abs(y[k] - 5.0));
  std::printf("after 0.2 s in saturation (%.2f A of 15): within %.3f A of 5 A two milliseconds later\n", held, most);
  EXPECT_LT(most, 0.25);
}

TEST(FocCurrentLoop, WithoutVoltageForBothTheFluxAxisHasItFirst) {
  const Bench b = fast_motor();
  Rig rig(b, setup_of(b), motor::Fidelity::averaged, 2.0 * std::numbers::pi * 380.0);
  for (int k = 0; k < 4000; ++k) rig.step(-3.0, 15.0);
  double d = 0.0;
  for (int k = 0; k < 500; ++k) {
    d += rig.step(-3.0, 15.0).current.d / 500.0;
    const motor::Plane u = motor::to_plane(rig.duties());
    EXPECT_LT(std::hypot(u.alpha, u.beta), 1.02 / std::sqrt(3.0));  // two per cent: compensation of the dead time
  }
  EXPECT_NEAR(d, -3.0, 0.1);
  EXPECT_LT(rig.sample().current.q, 14.0);
}

}  // namespace
}  // namespace flexspline::foc_rig::foc_current_test
