#include "host/drive_link/deployment/stage_settings.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "host/drive_link/deployment/require.hpp"

namespace flexspline::deployment {
namespace {

constexpr double kZeroK = 273.15, kReferenceK = kZeroK + 25.0, kFullScale = 32768.0;
constexpr double kMostCelsius = 255.0;

std::int32_t rounded(double x) {
  return static_cast<std::int32_t>(std::lround(x));
}
std::int32_t in_celsius_units(double celsius) {
  return rounded(std::ldexp(celsius, control::protection::kCelsiusBits));
}

// Share of the divider's supply that the converter reads.
double share_at(const ThermistorSetup& s, double celsius) {
  const double ohm = s.ohm_at_25 * std::exp(s.beta * (1.0 / (celsius + kZeroK) - 1.0 / kReferenceK));
  return (s.to_ground ? ohm : s.divider_ohm) / (ohm + s.divider_ohm);
}
double celsius_at(const ThermistorSetup& s, double share) {
  const double of_thermistor = s.to_ground ? share : 1.0 - share;
  if (of_thermistor <= 0.0) return kMostCelsius;
  if (of_thermistor >= 1.0) return -kMostCelsius;
  const double ohm = s.divider_ohm * of_thermistor / (1.0 - of_thermistor);
  const double per_k = 1.0 / kReferenceK + std::log(ohm / s.ohm_at_25) / s.beta;
  return per_k > 0.0 ? std::clamp(1.0 / per_k - kZeroK, -kMostCelsius, kMostCelsius) : kMostCelsius;
}

}  // namespace

control::protection::ThermistorSettings thermistor_settings(const ThermistorSetup& s) {
  require(s.ohm_at_25 > 0.0 && s.beta > 0.0 && s.divider_ohm > 0.0,
          "the thermistor's resistance, its beta and its divider have to be above zero");
  require(-kZeroK < s.coldest_c && s.coldest_c < s.restart_c && s.restart_c <= s.limit_c && s.limit_c < s.hottest_c &&
              s.hottest_c < kMostCelsius,
          "the thermistor's temperatures have to rise from the coldest over restart and limit to the hottest");
  control::protection::ThermistorSettings out;
  for (std::size_t k = 0; k < out.celsius.size(); ++k) {
    const double share = std::ldexp(static_cast<double>(k), control::protection::kThermistorStepBits - 15);
    out.celsius[k] = static_cast<std::int16_t>(in_celsius_units(celsius_at(s, share)));
  }
  const double cold = share_at(s, s.coldest_c), hot = share_at(s, s.hottest_c);
  out.least = rounded(std::min(cold, hot) * kFullScale);
  out.most = rounded(std::max(cold, hot) * kFullScale);
  out.opens_upwards = s.to_ground;
  out.limit = in_celsius_units(s.limit_c);
  out.restart = in_celsius_units(s.restart_c);
  return out;
}

control::protection::ChopperSettings chopper_settings(const ChopperSetup& s) {
  require(s.bus_full_scale_v > 0.0 && s.pwm_hz > 0.0, "full scale of the bus and the PWM rate have to be above zero");
  require(0.0 < s.begin_v && s.begin_v < s.full_v && s.full_v < s.bus_full_scale_v && s.most_duty > 0.0 &&
              s.most_duty < 1.0,
          "the brake resistor's voltages have to rise to below full scale, and its largest share be below one");
  require(s.ohm > 0.0 && s.energy_j > 0.0 && s.continuous_w > 0.0,
          "resistance, energy and power of the brake resistor have to be above zero");
  const double full_scale_j = s.bus_full_scale_v * s.bus_full_scale_v / s.ohm / s.pwm_hz;
  const double slope = s.most_duty * s.bus_full_scale_v / (s.full_v - s.begin_v);
  const double periods = s.energy_j / full_scale_j, cooling = s.continuous_w / s.energy_j / s.pwm_hz;
  require(slope < 255.0, "the brake resistor's two voltages are too near to each other");
  require(periods < std::ldexp(1.0, 28), "the brake resistor's energy is too large");
  require(cooling < 0.5, "the brake resistor's energy is below its power of two periods");
  control::protection::ChopperSettings out;
  out.begin = rounded(s.begin_v / s.bus_full_scale_v * kFullScale);
  out.slope = static_cast<std::uint32_t>(rounded(std::ldexp(slope, 8)));
  out.most_duty = rounded(s.most_duty * kFullScale);
  out.most_heat = std::llround(std::ldexp(periods, 30));
  out.cooling = static_cast<std::uint32_t>(std::llround(std::ldexp(cooling, 32)));
  return out;
}

control::protection::WindingSettings winding_settings(const FocSetup& foc, double peak_a, double error) {
  require(peak_a > 0.0 && peak_a <= foc.current_full_scale_a && error > 0.0 && error < 1.0,
          "the largest current has to be within full scale, the error of the resistance between zero and one");
  const double lost_v = foc.dead_time_s * foc.pwm_hz * (foc.bus_v + 2.0 * foc.diode_drop_v);
  // A fourteenth of the largest: noise and zeros of sensors are far below a quarter of it.
  constexpr double kWatched = 1.0 / 14.0;
  const double peak = peak_a / foc.current_full_scale_a;
  control::protection::WindingSettings out;
  out.least_current = rounded(std::ldexp(kWatched * peak, 27));
  out.resistance_error = rounded(std::ldexp(error * peak, 27));
  out.lost_voltage = rounded(std::ldexp(lost_v / foc.bus_full_scale_v, 30));
  return out;
}

}  // namespace flexspline::deployment
