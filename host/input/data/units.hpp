// Units in which logs are written, and their way to the SI unit of our columns.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "host/input/data/dataset.hpp"

namespace flexspline::data {

enum class Quantity : std::uint8_t {
  time,
  current,
  angle,
  angular_velocity,
  torque,
  length,
  velocity,
  force,
  temperature,
  counts,       // of an encoder: an angle or a length, once the counts per turn or metre are known
  counts_rate,  // counts per second
};

// SI value = factor * value + offset. For counts the factor is 1 and the encoder gives the rest.
struct Unit {
  Quantity quantity = Quantity::time;
  double factor = 1.0;
  double offset = 0.0;
};

// Accepts spellings with or without *, blanks and the degree sign: "N*m", "Nm", "N m"; "deg/s", "°/s". A number may
// stand before the unit: "0.125 N*m" for a torque in percent of 12.5 N m.
std::optional<Unit> unit_from_text(std::string_view text);

// "rpm, rad/s, deg/s, ...": the units that a quantity may be given in (with counts where an encoder may give it).
std::string known_units(Quantity quantity);

// The unit that a step between samples is likely in, where it cannot be seconds: a drive is sampled at 10 Hz to 20 kHz.
std::optional<std::string_view> unit_of_time_step(double step);

Quantity quantity_of(Column column, Axis axis);
std::string_view si_unit(Quantity quantity);

// Angle and length, torque and force, the two velocities: what a lever arm or a screw's pitch converts.
bool are_sisters(Quantity a, Quantity b);

}  // namespace flexspline::data
