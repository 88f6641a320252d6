// A run of a plan as the excitation of a drive.
#pragma once

#include "host/engine/planning/plan.hpp"
#include "shared/control/excitation_setup.hpp"

namespace flexspline::planning {

// In the unit of the run's amplitude, for ticks of this length; without a guard of the velocity. Throws PlanError for a
// run that no excitation can make.
control::ExcitationSetup<double> excitation_of(const Run& run, double tick_s);

}  // namespace flexspline::planning
