// Signs with which people write units.
#pragma once

#include <string>
#include <string_view>

namespace flexspline::text {

// The text with the non-ASCII characters of units in ASCII: degree sign as "deg", micro sign and Greek mu as "u", dots
// and cross between factors as "*", raised digits and minus as "^2", "^3", "1" and "-". All else stays.
std::string unit_in_ascii(std::string_view unit);

}  // namespace flexspline::text
