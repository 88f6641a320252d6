// The report's excitations as plans, by its names of experiments: amplitude in percent, wave form, tenths of a hertz.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "host/engine/planning/plan.hpp"

namespace flexspline::planning {

struct ReportPlan {
  std::string_view name;   // "report-friction"
  std::string_view title;  // what it is, one line
};
const std::vector<ReportPlan>& report_plans();

// What 100 % means on a drive; the report does not give it.
struct FullScale {
  double velocity_rad_s = 0.0;  // of the motor
  double current_a = 0.0;
};
// Its limits are the full scale. Nothing where there is no such plan.
std::optional<Plan> report_plan(std::string_view name, const FullScale& full);

}  // namespace flexspline::planning
