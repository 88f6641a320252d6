// The curve of an effect: its torque over the variable in which it shows, from the catalogue itself.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::output {

inline constexpr double kRatedVelocityOfCurves = 200.0;  // rad/s, of a drive of the report's class

// One line through (x[k], y[k]) in the order of the motion; a loop ends where it began. NaN in y is a gap: what is on
// the two sides of it are two directions.
struct EffectCurve {
  std::vector<double> x, y;
  std::string x_label;  // "motor velocity (rad/s)"
  std::string y_label;  // "torque on the motor (N*m)"
  std::string caption;  // what is drawn where it is not the effect alone; else empty
};

// At usual values, on a rotary drive of the report's class (N = 100). The motion is chosen from what the effect reads:
// the most special signal that makes a difference. A shift is drawn by what it does to a linear stiffness, a modulation
// by what it does to the effect that it modulates.
EffectCurve effect_curve(const catalogue::Entry& entry);

// The curve in characters, `width` by `height` of them without the axes: Braille patterns, or ASCII.
std::string curve_text(const EffectCurve& curve, bool braille, std::size_t width = 60, std::size_t height = 14);

// Whether the locale is UTF-8 and the terminal not a dumb one.
bool takes_braille();

// {"x": [], "y": [], "x_label", "y_label", "caption"}
nlohmann::json curve_json(const EffectCurve& curve);

}  // namespace flexspline::output
