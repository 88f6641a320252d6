#include "host/drive_link/drive/residual_map_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace flexspline::drive {
namespace {

using nlohmann::json;

constexpr double kLimitShare = 0.01;

json finite(double value) {
  return std::isfinite(value) ? json(value) : json();
}

}  // namespace

double usual_map_limit_nm(const Scales& scales) {
  return kLimitShare * std::ldexp(scales.header.limits.torque.raw, -fixed::kValueBits) * scales.constants.torque_base;
}

json map_json(const ResidualMap& map, const MapTest& test, double limit_nm) {
  json rows = json::array(), findings = json::array();
  for (std::size_t v = 0; v < map.velocity_bins(); ++v) {
    json ticks = json::array(), mean = json::array(), std = json::array();
    for (std::size_t a = 0; a < map.angle_bins; ++a) {
      const ResidualBin& bin = map.at(v, a);
      ticks.push_back(bin.ticks);
      mean.push_back(bin.ticks == 0 ? json() : json(bin.mean_nm));
      std.push_back(bin.ticks == 0 ? json() : json(bin.std_nm));
    }
    const ResidualMap::Range range = map.velocity(v);
    rows.push_back({{"velocity_rad_s", {finite(range.low), finite(range.high)}},
                    {"ticks", ticks},
                    {"mean_nm", mean},
                    {"std_nm", std}});
  }
  for (const MapFinding& f : test.findings)
    findings.push_back({{"order", f.order == 0 ? json() : json(f.order)},
                        {"velocity_rad_s", {finite(f.velocity.low), finite(f.velocity.high)}},
                        {"size_nm", f.size_nm},
                        {"std_nm", f.std_nm},
                        {"p_value", f.p_value}});
  return {{"unit", map.is_linear ? "N" : "N*m"},   {"velocity_unit", map.is_linear ? "m/s" : "rad/s"},
          {"of_one_moment", map.of_one_moment},    {"seconds", map.seconds()},
          {"angle_bins", map.angle_bins},          {"rows", std::move(rows)},
          {"verdict", name_of(test.verdict)},      {"limit_nm", limit_nm},
          {"judged_velocities", test.tested_bins}, {"findings", std::move(findings)}};
}

}  // namespace flexspline::drive
