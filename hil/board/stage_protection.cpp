// The protection of the twin's power stage. Its numbers are made here a second time; a test compares them with those
// that the host makes.
#include <algorithm>
#include <cmath>

#include "hil/board/plant_rig.hpp"
#include "hil/board/three_phase.hpp"

namespace flexspline::board {
namespace {

// 10 kiloohm at 25 degrees below a resistor of 10 kiloohm.
constexpr double kBeta = 3435.0, kKelvin = 273.15, kRoomK = 298.15, kFullScale = 32768.0;
constexpr double kColdestC = -40.0, kHottestC = 160.0, kLimitC = 100.0, kRestartC = 90.0, kMostC = 255.0;

double divided(double celsius) {
  const double ratio = std::exp(kBeta / (celsius + kKelvin) - kBeta / kRoomK);
  return ratio / (1.0 + ratio);
}
std::int16_t celsius_units(double celsius) {
  return static_cast<std::int16_t>(std::lround(celsius * 128.0));
}
std::int32_t word(double x) {
  return static_cast<std::int32_t>(std::lround(x));
}

control::protection::ThermistorSettings thermistor() {
  control::protection::ThermistorSettings s;
  const std::size_t last = s.celsius.size() - 1;
  for (std::size_t k = 1; k < last; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(last);
    const double kelvin = 1.0 / (1.0 / kRoomK + std::log(share / (1.0 - share)) / kBeta);
    s.celsius[k] = celsius_units(std::clamp(kelvin - kKelvin, -kMostC, kMostC));
  }
  s.celsius[0] = celsius_units(kMostC);
  s.celsius[last] = celsius_units(-kMostC);
  s.least = word(divided(kHottestC) * kFullScale);
  s.most = word(divided(kColdestC) * kFullScale);
  s.limit = celsius_units(kLimitC);
  s.restart = celsius_units(kRestartC);
  return s;
}

// From 51 of 60 V on, at 54 V nine tenths of the period; 20 J, 5 W for ever, of the demo's drive.
control::protection::ChopperSettings chopper() {
  constexpr double kBeginShare = 51.0 / 60.0, kFullShare = 54.0 / 60.0, kMostDuty = 0.9;
  constexpr double kPeriods = 20.0 * 20.0 * 40e3 / (60.0 * 60.0), kCooling = 5.0 / 20.0 / 40e3;
  control::protection::ChopperSettings s;
  s.begin = word(kBeginShare * kFullScale);
  s.slope = static_cast<std::uint32_t>(word(256.0 * kMostDuty / (kFullShare - kBeginShare)));
  s.most_duty = word(kMostDuty * kFullScale);
  s.most_heat = std::llround(std::ldexp(kPeriods, 30));
  s.cooling = static_cast<std::uint32_t>(std::llround(std::ldexp(kCooling, 32)));
  return s;
}

}  // namespace

std::int32_t thermistor_reading(double celsius) {
  return word(divided(celsius) * kFullScale);
}

firmware::ProtectionSettings protection_of(const plant::Drive& drive) {
  firmware::ProtectionSettings s;
  const ThreePhaseParameters p = three_phase_of(drive);
  s.thermistor = thermistor();
  s.chopper = chopper();
  const double peak = scales_of(drive).amplifier_a / p.sensors.full_scale_a;
  const motor::InverterParameters& inverter = p.inverter;
  s.winding.least_current = word(std::ldexp(peak / 14.0, 27));
  s.winding.resistance_error = word(std::ldexp(0.4 * peak, 27));
  s.winding.lost_voltage =
      word(std::ldexp(inverter.dead_time_s * inverter.pwm_hz * (inverter.supply_v + 2.0 * inverter.diode_drop_v) /
                          p.sensors.bus_full_scale_v,
                      30));
  s.bootstrap_periods = ThreePhaseAmplifier::kPwmHz / 1000;
  return s;
}

}  // namespace flexspline::board
