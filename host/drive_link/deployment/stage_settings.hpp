// Numbers of a power stage's protection from SI units.
#pragma once

#include "host/drive_link/deployment/foc_settings.hpp"
#include "shared/control/protection/brake_chopper.hpp"
#include "shared/control/protection/thermistor.hpp"
#include "shared/control/protection/winding_watch.hpp"

namespace flexspline::deployment {

// A thermistor in a divider with a resistor.
struct ThermistorSetup {
  double ohm_at_25 = 10e3;
  double beta = 3435.0;
  double divider_ohm = 10e3;
  bool to_ground = true;  // the thermistor; not: the resistor
  double limit_c = 100.0;
  double restart_c = 90.0;
  double coldest_c = -40.0;  // beyond: an open wire
  double hottest_c = 160.0;  // beyond: a shorted one
};
// Throws std::invalid_argument that says which number does not fit, as the others do.
control::protection::ThermistorSettings thermistor_settings(const ThermistorSetup& setup);

struct ChopperSetup {
  double bus_full_scale_v = 0.0;
  double pwm_hz = 0.0;
  double begin_v = 0.0;  // from here on it works
  double full_v = 0.0;   // here with its largest share
  double most_duty = 0.9;
  double ohm = 0.0;
  double energy_j = 0.0;  // that it takes when it is cold
  double continuous_w = 0.0;
};
control::protection::ChopperSettings chopper_settings(const ChopperSetup& setup);

// `peak_a`: the largest current. `error`: of the resistance, with its temperature.
control::protection::WindingSettings winding_settings(const FocSetup& foc, double peak_a, double error = 0.4);

}  // namespace flexspline::deployment
