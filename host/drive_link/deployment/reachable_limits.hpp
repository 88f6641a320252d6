// The rule of shared/control/reachable.hpp for people: which limit of the settings its signal cannot reach.
#pragma once

#include <string>

#include "shared/control/drive_parameters_setup.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::deployment {

// Throws PackError with the key of the first one, what it is and what it may be at most, in SI.
void require_reachable(const control::DriveSettings<fixed::Fixed>& settings, const effects::DriveConstants<double>& d,
                       const std::string& origin);

}  // namespace flexspline::deployment
