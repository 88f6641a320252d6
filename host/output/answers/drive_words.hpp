// What texts say of the drive at hand: forces on a linear axis, and the constants that an effect's law refers to.
#pragma once

#include <string>
#include <string_view>

#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::output {

// On a linear axis "torque", "N m", "rad", "output angle" become "force", "N", "m", "output position". Names of
// columns, keys and options stay.
std::string words_on(data::Axis axis, std::string_view text);
// Of the axis whose balances are in this unit: "N*m", "N".
data::Axis axis_of(std::string_view unit);

// "wref = 200 rad/s, rated_velocity_rad_s of the model's [drive]"; empty for an effect whose equation has neither wref
// nor temp0.
std::string reference_text(std::string_view effect, const model::Drive& drive);
// Where it is stated, and what holds without a statement.
std::string reference_rule(std::string_view effect);

}  // namespace flexspline::output
