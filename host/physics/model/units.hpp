// Spellings of units.
#pragma once

#include <string_view>

namespace flexspline::model {

// Whether two texts mean the same unit: "Nm", "N m", "N*m" and "m N" do, "N*m*s/rad" and "N*m/(rad/s)" do, "mN*m" and
// "N*m" do not. An empty text, "-" and "1" all mean no unit. A text that cannot be read as a unit is only the same as
// itself.
bool same_unit(std::string_view a, std::string_view b);

// Whether the text means no unit.
bool is_dimensionless(std::string_view unit);

}  // namespace flexspline::model
