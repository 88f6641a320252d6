// The numbers of the boards' stages are those that the host's formulas make of ohms, volts and seconds.
#include <gtest/gtest.h>

#include <cmath>

#include "boards/nucleo_ihm08m1/stage.hpp"
#include "boards/odrive_v36/stage.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "host/drive_link/deployment/foc_settings.hpp"
#include "host/drive_link/deployment/stage_settings.hpp"

namespace flexspline::tests {
namespace {

struct StageNumbers {
  double full_scale_a, bus_full_scale_v, most_a, trip_a, sum_a, dead_time_s, zone_a, least_v, most_v, bootstrap_s;
  int timer_counts;
  bool two_sensors;
  deployment::ThermistorSetup thermistor;
};
std::int32_t word(double share, int bits) {
  return static_cast<std::int32_t>(std::lround(std::ldexp(share, bits)));
}
void expect_near(std::int32_t a, std::int32_t b) {
  EXPECT_NEAR(a, b, 1.0 + 1e-6 * std::abs(static_cast<double>(b)));
}
void expect_modulation(const control::foc::ModulationSettings& a, const control::foc::ModulationSettings& b) {
  expect_near(a.window, b.window);
  expect_near(a.pulse, b.pulse);
  expect_near(a.dead_time, b.dead_time);
  expect_near(a.dead_time_gain, b.dead_time_gain);
  EXPECT_EQ(a.period, b.period);
}
void expect_axis(const control::foc::AxisSettings& a, const control::foc::AxisSettings& b) {
  expect_near(a.proportional, b.proportional);
  expect_near(a.integral, b.integral);
  expect_near(a.resistance, b.resistance);
  expect_near(a.volts_per_change, b.volts_per_change);
  expect_near(a.change_per_volt, b.change_per_volt);
  expect_near(a.half_period_gain_less_one, b.half_period_gain_less_one);
  expect_near(a.sample_weight_less_one, b.sample_weight_less_one);
  expect_near(a.pending_gain, b.pending_gain);
  expect_near(a.reactance, b.reactance);
}
constexpr double kPwmHz = 20e3, kShortestPulseS = 0.3e-6, kSamplingWindowS = 3e-6;

void expect_settings(const firmware::ThreePhaseSettings& s, const StageNumbers& n) {
  deployment::FocSetup f;
  f.resistance_ohm = 0.3;
  f.inductance_d_h = f.inductance_q_h = 0.3e-3;
  f.flux_vs = 0.006;
  f.current_full_scale_a = n.full_scale_a;
  f.bus_full_scale_v = n.bus_full_scale_v;
  f.pwm_hz = kPwmHz;
  f.timer_counts = n.timer_counts;
  f.dead_time_s = n.dead_time_s;
  f.dead_time_zone_a = n.zone_a;
  f.diode_drop_v = 0.8;
  f.bus_v = 24.0;
  f.shortest_pulse_s = kShortestPulseS;
  f.sampling_window_s = kSamplingWindowS;
  const control::foc::Settings made = deployment::foc_settings(f);
  expect_axis(s.foc.current.d, made.current.d);
  expect_axis(s.foc.current.q, made.current.q);
  expect_near(s.foc.current.flux, made.current.flux);
  EXPECT_EQ(s.foc.current.voltage_exponent, made.current.voltage_exponent);
  expect_modulation(s.foc.modulation, made.modulation);
  EXPECT_EQ(s.foc.sensors.two, n.two_sensors);

  deployment::CommissioningSetup c;
  c.current_full_scale_a = n.full_scale_a;
  c.bus_full_scale_v = n.bus_full_scale_v;
  c.pwm_hz = kPwmHz;
  c.timer_counts = n.timer_counts;
  c.shortest_pulse_s = kShortestPulseS;
  c.sampling_window_s = kSamplingWindowS;
  c.dead_time_s = n.dead_time_s;
  c.current_a = 0.1 * n.full_scale_a;
  c.bus_v = 24.0;
  expect_modulation(s.test_modulation, deployment::commissioning_settings(c).modulation);

  const auto winding = deployment::winding_settings(f, n.most_a);
  expect_near(s.protection.winding.least_current, winding.least_current);
  expect_near(s.protection.winding.resistance_error, winding.resistance_error);
  expect_near(s.protection.winding.lost_voltage, winding.lost_voltage);
  EXPECT_EQ(s.protection.winding.every, 2U) << "10 000 samples a second";
  const auto thermistor = deployment::thermistor_settings(n.thermistor);
  EXPECT_EQ(s.protection.thermistor.celsius, thermistor.celsius);
  EXPECT_EQ(s.protection.thermistor.least, thermistor.least);
  EXPECT_EQ(s.protection.thermistor.most, thermistor.most);
  EXPECT_EQ(s.protection.thermistor.opens_upwards, thermistor.opens_upwards);
  EXPECT_EQ(s.protection.thermistor.limit, thermistor.limit);
  EXPECT_EQ(s.protection.thermistor.restart, thermistor.restart);

  const double peak = n.most_a / n.full_scale_a;
  expect_near(static_cast<std::int32_t>(s.limits.peak_square), word(peak * peak, 30));
  EXPECT_EQ(s.set_point, word(peak, 12));
  EXPECT_EQ(s.reading, 1 << 20) << "the reading's full scale is the current's base";
  expect_near(s.most_phase, word(n.trip_a / n.full_scale_a, 27));
  if (!n.two_sensors) expect_near(s.most_sum, word(n.sum_a / n.full_scale_a, 27));
  EXPECT_EQ(s.least_bus, word(n.least_v / n.bus_full_scale_v, 15));
  EXPECT_EQ(s.most_bus, word(n.most_v / n.bus_full_scale_v, 15));
  EXPECT_EQ(s.protection.bootstrap_periods, std::lround(n.bootstrap_s * kPwmHz));
  EXPECT_EQ(s.timer_counts, n.timer_counts);
  EXPECT_EQ(s.pole_pairs, 0) << "it cannot be armed before its motor was measured";
  EXPECT_NEAR(s.current_full_scale_ma, 1e3 * n.full_scale_a, 0.5);
  EXPECT_NEAR(s.bus_full_scale_mv, 1e3 * n.bus_full_scale_v, 0.5);
}

TEST(BoardStageSettings, OfTheNucleoWithAnIhm08m1) {
  const double full = 31.842;
  EXPECT_NEAR(full, 1.65 / (0.01 * (6.8 / 7.48) * 5.7), 1e-3);
  EXPECT_NEAR(63.203, 3.3 * (169.0 + 9.31) / 9.31, 1e-3);
  expect_settings(nucleo_ihm08m1::stage_settings(4096),
                  {full,
                   63.203,
                   15.0,
                   21.0,
                   full / 16.0,
                   0.5e-6,
                   0.3,
                   10.0,
                   50.0,
                   2e-3,
                   4000,
                   false,
                   {.beta = 3434.0, .divider_ohm = 4.7e3, .to_ground = false, .limit_c = 90.0, .restart_c = 80.0}});
}

TEST(BoardStageSettings, OfTheOdrive) {
  EXPECT_DOUBLE_EQ(82.5, 1.65 / (40.0 * 0.5e-3));
  EXPECT_DOUBLE_EQ(62.7, 3.3 * 19.0);
  const firmware::ThreePhaseSettings s = odrive_v36::stage_settings(8192);
  expect_settings(s, {82.5,
                      62.7,
                      40.0,
                      56.0,
                      0.0,
                      0.24e-6,
                      0.6,
                      12.0,
                      56.0,
                      2e-3,
                      4200,
                      true,
                      {.beta = 3434.0, .divider_ohm = 3.3e3, .to_ground = false}});
  const auto chopper = deployment::chopper_settings({.bus_full_scale_v = 62.7,
                                                     .pwm_hz = kPwmHz,
                                                     .begin_v = 51.0,
                                                     .full_v = 54.0,
                                                     .most_duty = 0.9,
                                                     .ohm = 2.0,
                                                     .energy_j = 300.0,
                                                     .continuous_w = 50.0});
  EXPECT_EQ(s.protection.chopper.begin, chopper.begin);
  EXPECT_EQ(s.protection.chopper.slope, chopper.slope);
  EXPECT_EQ(s.protection.chopper.most_duty, chopper.most_duty);
  EXPECT_EQ(s.protection.chopper.most_heat, chopper.most_heat);
  EXPECT_EQ(s.protection.chopper.cooling, chopper.cooling);
  // The low sides of both shunts are always on for the sampling window.
  const double window = std::ldexp(s.foc.modulation.window, -control::foc::kDutyBits);
  const double circle = std::ldexp(s.foc.circle, -26 + s.foc.current.voltage_exponent - 5);
  EXPECT_NEAR(circle, (1.0 - window) / std::sqrt(3.0), 1e-6);
}

}  // namespace
}  // namespace flexspline::tests
