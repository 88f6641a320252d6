// Numbers of one motor for the current loop. A unit test shows that host/drive_link/deployment/foc_settings makes them:
// of 0.304 ohm, 0.3 mH and 6 mVs on 48 V at 40 kHz, full scales of 40 A and 60 V, 0.5 us dead time; 20 A at most, 8 A
// continuous.
#pragma once

#include "shared/control/foc/current_limits.hpp"
#include "shared/control/foc/field_oriented.hpp"

namespace flexspline::counts {

inline constexpr control::foc::AxisSettings kExampleAxis = {912656145,   326219994, 27201460,  1087399978, 132531903,
                                                            -2133883100, -54059817, 906900318, 843314857};
inline constexpr control::foc::Settings kExampleSettings = {
    {{4096, 4096, 4096}, {}, false},
    {kExampleAxis, kExampleAxis, 13176795, 624333630, 4194304, 8},
    {129564847, 30780599, 5418, 145635556, 8400},
    4704328,
};
inline constexpr control::foc::LimitSettings kExampleLimits = {8'947'849,  40'265'318, 2'040'109'466, 268'435'456,
                                                               42'949'673, 34'359'738, 1'720'320,     214'748};

}  // namespace flexspline::counts
