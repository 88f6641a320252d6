#include "host/drive_link/deployment/foc_settings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "host/drive_link/deployment/require.hpp"

namespace flexspline::deployment {
namespace {

using control::foc::AxisSettings;

std::int32_t quantised(double x, int bits, const std::string& what) {
  const double scaled = std::round(std::ldexp(x, bits));
  require(std::isfinite(scaled) && std::abs(scaled) <= 2147483647.0, what + " does not fit its format");
  return static_cast<std::int32_t>(scaled);
}

// Coefficients of an axis; gains in ohms.
struct Axis {
  double proportional, integral, resistance, slope, middle, keep, weight, pending, reactance;
};
Axis axis_of(const FocSetup& s, double inductance) {
  const double period = 1.0 / s.pwm_hz, lost = -std::expm1(-s.resistance_ohm * period / inductance);  // 1 - a
  Axis x{};
  x.resistance = s.resistance_ohm;
  x.slope = s.resistance_ohm / lost;
  x.keep = std::sqrt(1.0 - lost);
  x.middle = 1.0 / (1.0 + x.keep);
  x.proportional = s.corrections.proportional * x.keep * x.slope;
  x.integral = s.corrections.integral * x.slope;
  const double more = s.corrections.extrapolated;
  x.weight = x.keep + more;
  x.pending = more * x.keep + (1.0 - more) * x.middle * x.proportional / x.slope;
  x.reactance = 2.0 * std::numbers::pi * inductance / (8.0 * period);
  return x;
}
AxisSettings settings_of(const Axis& a, double base_ohm) {
  AxisSettings c;
  c.proportional = quantised(a.proportional / base_ohm, 30, "the proportional gain");
  c.integral = quantised(a.integral / base_ohm, 30, "the integral gain");
  c.resistance = quantised(a.resistance / base_ohm, 30, "the resistance");
  c.volts_per_change = quantised(a.slope / base_ohm, 30, "the inductance over a period");
  c.change_per_volt = quantised(base_ohm / a.slope, 27, "a period over the inductance: d and q differ too much, it");
  c.half_period_gain_less_one = quantised(a.middle - 1.0, 32, "the weight of the middle of a period");
  c.sample_weight_less_one = quantised(
      a.weight - 1.0, 32, "the resistance over the inductance, for this PWM rate, the decay of half a period");
  c.pending_gain = quantised(a.pending, 31, "the part of a correction that is still to act");
  c.reactance = quantised(a.reactance / base_ohm, 30, "the reactance");
  return c;
}
double largest(const Axis& a) {
  return std::max({a.proportional, a.integral, a.resistance, a.slope, a.reactance});
}

}  // namespace

// With twenty periods in one of the bandwidth a rise lasts seven, and the gains have to be high. Found by a search over
// linear motors: of those with which R and L that are wrong by 20 % change the rise by at most 5 %, poles stay within
// 0.83 then and the loop is stable with L wrong by 40 %, the ones with the least noise in the voltage. It is four times
// that of the gains that do with twice as many periods.
Corrections usual_corrections(double pwm_hz, double bandwidth_hz) {
  constexpr double kPeriods = 30.0;
  if (pwm_hz < kPeriods * bandwidth_hz) return {.proportional = 1.46, .integral = 0.9, .extrapolated = 0.4};
  return {.proportional = 0.85, .integral = 0.3, .extrapolated = 0.0};
}

control::foc::Settings foc_settings(const FocSetup& given) {
  FocSetup s = given;
  if (s.corrections.proportional == 0.0) s.corrections = usual_corrections(s.pwm_hz, s.bandwidth_hz);
  require(s.resistance_ohm > 0.0 && s.inductance_d_h > 0.0 && s.inductance_q_h > 0.0 && s.flux_vs >= 0.0,
          "resistance and inductances have to be above zero");
  require(s.current_full_scale_a > 0.0 && s.bus_full_scale_v > 0.0 && s.pwm_hz > 0.0 && s.timer_counts > 0,
          "full scales, the PWM rate and the timer's counts have to be above zero");
  require(s.bandwidth_hz > 0.0 && s.bandwidth_hz <= 0.1 * s.pwm_hz, "the bandwidth is above a tenth of the PWM rate");
  const Corrections& k = s.corrections;
  require(k.proportional > 0.0 && k.proportional < 2.0 && k.integral > 0.0 && k.integral <= 1.0 &&
              k.extrapolated >= 0.0 && k.extrapolated < 0.5,
          "the corrections are not between zero and 2, 1 and 0.5");
  const Axis d = axis_of(s, s.inductance_d_h), q = axis_of(s, s.inductance_q_h);
  // The voltage base: all coefficients below two.
  const double bus_ohm = s.bus_full_scale_v / s.current_full_scale_a;
  int power = 0;
  while (std::max(largest(d), largest(q)) >= 1.99 * std::ldexp(bus_ohm, power)) ++power;
  require(power <= 12, "the inductance is too large for the current's full scale");
  const double base_ohm = std::ldexp(bus_ohm, power), base_v = std::ldexp(s.bus_full_scale_v, power);

  control::foc::Settings c;
  c.sensors.gain = {4096, 4096, 4096};
  c.current.d = settings_of(d, base_ohm);
  c.current.q = settings_of(q, base_ohm);
  const double flux = 2.0 * std::numbers::pi * s.flux_vs * s.pwm_hz / 8.0 / base_v;
  require(flux < 31.0, "the flux is too large for the bus voltage's full scale");
  c.current.flux = quantised(flux, 25, "the flux");
  c.current.response_per_period =
      quantised(-std::expm1(-2.0 * std::numbers::pi * s.bandwidth_hz / s.pwm_hz), 32, "the bandwidth");
  c.current.integral_limit = quantised(std::ldexp(1.0, -power), 25, "the limit of the integral");
  c.current.voltage_exponent = power + 5;

  auto& m = c.modulation;
  constexpr int kBits = control::foc::kDutyBits;
  const double lost = s.dead_time_s * s.pwm_hz * (s.bus_v > 0.0 ? 1.0 + 2.0 * s.diode_drop_v / s.bus_v : 1.0);
  // The low side is on a dead time later than commanded, before the middle of its time; compensation takes some as
  // well.
  const double pulse = s.shortest_pulse_s * s.pwm_hz + lost;
  const double window = (s.sampling_window_s + 2.0 * s.dead_time_s) * s.pwm_hz + lost;
  require(pulse < 0.2 && window < 0.3, "dead time, shortest pulse or sampling window are too long for the PWM rate");
  m.pulse = quantised(pulse, kBits, "the shortest pulse");
  m.window = quantised(std::max(window, pulse), kBits, "the sampling window");
  m.dead_time = quantised(lost, kBits - control::foc::kZoneBits, "the dead time");
  if (lost > 0.0) {
    require(s.dead_time_zone_a > 0.0, "the compensation of the dead time needs the width of its linear zone");
    // A zone below that would be below two steps of a converter of ten bits.
    const double zone = std::max(s.dead_time_zone_a, s.current_full_scale_a / 500.0);
    m.dead_time_gain = quantised(s.current_full_scale_a / zone, control::foc::kZoneBits + 7,
                                 "the current's full scale over the linear zone of the dead time");
  }
  m.period = s.timer_counts * 4;
  c.circle = quantised((1.0 - pulse) / std::sqrt(3.0) * std::ldexp(1.0, -power), 26, "the limit of the voltage");
  return c;
}

control::foc::LimitSettings foc_limits(const FocSetup& s, const FocLimitSetup& l) {
  const double base = s.current_full_scale_a, peak = l.peak_a / base, continuous = l.continuous_a / base;
  require(continuous > 0.0 && continuous <= peak && peak <= 1.0,
          "currents have to rise from zero to continuous, peak and full scale");
  require(l.fade_from > 0.0 && l.fade_from < 1.0 && l.thermal_s * l.rate_hz > 1.0, "the thermal limit makes no sense");
  control::foc::LimitSettings c;
  const auto square = [](double x) { return static_cast<std::uint32_t>(std::round(std::ldexp(x * x, 30))); };
  c.peak_square = square(peak);
  c.continuous_square = square(continuous);
  c.start_square = static_cast<std::uint32_t>(c.continuous_square * l.fade_from);
  const double fade = (peak * peak - continuous * continuous) / (continuous * continuous * (1.0 - l.fade_from));
  require(fade < 65535.0, "the peak is too far above the continuous current");
  c.fade = static_cast<std::uint32_t>(std::round(std::ldexp(fade, 16)));
  c.heating = static_cast<std::uint32_t>(std::round(std::ldexp(1.0 / (l.thermal_s * l.rate_hz), 32)));
  c.voltage_share = quantised(l.voltage_share, 31, "the share of the voltage");
  c.weakening = quantised(l.weakening_a / base, 27, "the current of field weakening");
  if (l.weakening_a > 0.0) {
    require(l.highest_speed > 0.0, "field weakening needs the highest speed");
    // The voltage changes by w L for each ampere in d; integrated at the rate of the motion loops.
    const double ohm = l.highest_speed * s.inductance_d_h;
    const double gain = 2.0 * std::numbers::pi * l.weakening_hz / l.rate_hz / ohm * s.bus_full_scale_v / base;
    c.weakening_gain = quantised(gain, 29, "the gain of field weakening");
  }
  return c;
}

}  // namespace flexspline::deployment
