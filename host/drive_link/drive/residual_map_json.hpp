// A drive's residual map and its findings, as JSON: "flexspline-residual-map/1" of `monitor --residual-map`, less what
// only the command knows.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/drive_link/drive/residual_map.hpp"

namespace flexspline::drive {

// A share of the motor's torque limit that no compensation is better than: what is smaller is no finding, N m.
double usual_map_limit_nm(const Scales& scales);

// {"unit", "velocity_unit", "of_one_moment", "seconds", "angle_bins", "rows": [{"velocity_rad_s": [low, high], "ticks",
// "mean_nm", "std_nm"}], "verdict", "limit_nm", "judged_velocities", "findings": [{"order", "velocity_rad_s",
// "size_nm", "std_nm", "p_value"}]}; ends at infinity and means of empty bins are null.
nlohmann::json map_json(const ResidualMap& map, const MapTest& test, double limit_nm);

}  // namespace flexspline::drive
