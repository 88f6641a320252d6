// What the counts of instructions stand on: their numbers, and that the loop in floating point does the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>

#include "tests/counts/current_loop_example.hpp"
#include "tests/counts/float_current_loop.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::foc_rig::foc_example_test {
namespace {

Bench example_bench() {
  Bench b;
  b.inverter.pwm_hz = 40e3;
  return b;
}
deployment::FocSetup example_setup() {
  auto s = setup_of(example_bench());
  s.timer_counts = 2100;
  return s;
}
// All numbers are words without gaps.
template <class T>
void expect_equal(const T& x, const T& y, const char* what) {
  constexpr std::size_t kWords = sizeof(T) / sizeof(std::int32_t);
  std::int32_t a[kWords], b[kWords];
  std::memcpy(a, &x, sizeof(T));
  std::memcpy(b, &y, sizeof(T));
  for (std::size_t k = 0; k < kWords; ++k) EXPECT_EQ(a[k], b[k]) << what << " " << k;
}

TEST(FocExample, ItsNumbersAreThoseThatTheHostMakes) {
  const auto setup = example_setup();
  const foc::Settings made = deployment::foc_settings(setup);
  expect_equal(made.current, counts::kExampleSettings.current, "current");
  expect_equal(made.modulation, counts::kExampleSettings.modulation, "modulation");
  EXPECT_EQ(made.circle, counts::kExampleSettings.circle);
  deployment::FocLimitSetup l;
  l.peak_a = 20.0;
  l.continuous_a = 8.0;
  l.thermal_s = 2.0;
  l.weakening_a = 12.0;
  l.highest_speed = 2.0 * std::numbers::pi * 600.0;
  expect_equal(deployment::foc_limits(setup, l), counts::kExampleLimits, "limits");
}

peers::FloatSetup float_setup(const deployment::FocSetup& s) {
  const double lost = s.dead_time_s * s.pwm_hz * (1.0 + 2.0 * s.diode_drop_v / s.bus_v);
  peers::FloatSetup f;
  f.resistance_ohm = s.resistance_ohm;
  f.inductance_d_h = s.inductance_d_h;
  f.inductance_q_h = s.inductance_q_h;
  f.flux_vs = s.flux_vs;
  f.current_full_scale_a = s.current_full_scale_a;
  f.bus_full_scale_v = s.bus_full_scale_v;
  f.pwm_hz = s.pwm_hz;
  f.timer_counts = s.timer_counts;
  f.lost = lost;
  f.zone_a = s.dead_time_zone_a;
  f.pulse = s.shortest_pulse_s * s.pwm_hz + lost;
  f.window = (s.sampling_window_s + 2.0 * s.dead_time_s) * s.pwm_hz + lost;
  f.bandwidth_hz = s.bandwidth_hz;
  const deployment::Corrections& k = s.corrections;
  f.proportional = k.proportional;
  f.integral = k.integral;
  f.extrapolated = k.extrapolated;
  return f;
}

// The integers drive; the loop in floating point sees the same inputs, with steps in q of up to `step` amperes. Returns
// by how many counts the on-times differ at most.
std::int32_t difference_to_float(const deployment::Corrections& corrections, double step) {
  auto setup = example_setup();
  setup.corrections = corrections;
  Rig rig(example_bench(), setup, motor::Fidelity::averaged, 2.0 * std::numbers::pi * 150.0);
  peers::FloatCurrentLoop in_float(float_setup(setup));
  std::int32_t worst = 0;
  for (int k = 0; k < 8000; ++k) {
    const double d = k / 700 % 3 == 1 ? -0.16 * step : 0.0, q = k / 500 % 4 == 0   ? 0.12 * step
                                                                : k / 500 % 4 == 1 ? -0.48 * step
                                                                : k / 500 % 4 == 2 ? step
                                                                                   : 0.008 * step;
    rig.set_speed(2.0 * std::numbers::pi * 150.0 * std::sin(k / 900.0));
    rig.step(d, q);
    const foc::Inputs& in = rig.inputs();
    peers::FloatCurrentLoop::Outputs out;
    in_float.tick({in.readings.a, in.readings.b, in.readings.c, in.bus, in.angle, in.step, static_cast<float>(d),
                   static_cast<float>(q)},
                  out);
    const auto& counts = rig.outputs().counts;
    worst = std::max({worst, std::abs(counts.a - out.a), std::abs(counts.b - out.b), std::abs(counts.c - out.c)});
  }
  std::printf("the loop in floating point: on-times %d of 2100 counts apart at most\n", static_cast<int>(worst));
  return worst;
}

// Steps of 25 A go into the limit of the voltage and out of it. The integers keep half of the pending part, which costs
// its last bit.
TEST(FocExample, TheLoopInFloatingPointGivesTheSameOnTimesUpToAFewCounts) {
  EXPECT_LE(difference_to_float(deployment::usual_corrections(40e3, 1000.0), 25.0), 4);
}
// Within the limit: at it a rounding decides for one period whether the integral part is held, which the larger
// integral gain shows.
TEST(FocExample, WithTheGainsOfALowRateItDoesSoWithinTheLimitOfTheVoltage) {
  for (const double step : {0.5, 1.0, 2.0, 4.0})
    EXPECT_LE(difference_to_float(deployment::usual_corrections(20e3, 1000.0), step), 4) << step;
}

}  // namespace
}  // namespace flexspline::foc_rig::foc_example_test
