// Which motions to record next: those that separate two effects, or those that show what data have left open.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/record.hpp"
#include "host/engine/planning/motions.hpp"
#include "host/engine/planning/plan.hpp"
#include "host/engine/planning/rehearsal.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::planning {

struct PlanRequest {
  const model::Model* model = nullptr;
  const data::Dataset* dataset = nullptr;  // what has been recorded; may be null
  estimation::PipelineOptions pipeline;
  MotionSettings setting;
  Sensors sensors;
  double sample_s = 1e-3;
  std::size_t most_motions = 4;
  std::function<void(std::string_view)> progress;  // may be empty
};

// Limits, gear and what recordings will hold, from the model's [drive] and from the data where there are any. Unknown
// limits are zero: a velocity, a current or a linear axis's travel that the user has to state. Where all records have a
// locked output, it is not taken to move.
MotionSettings setting_of(const model::Model& model, const data::Dataset* dataset);
// Efforts are currents, but where the data have a torque alone and no torque constant is known.
Sensors sensors_of(const model::Model& model, const data::Dataset* dataset);

// Twice the log likelihood ratio, over the autocorrelation time, by which the true one of two effects is expected to be
// better than the other: the squares of the part of its torque that is orthogonal to the model with the other, over the
// noise.
struct Separation {
  double of_first = 0.0;
  double of_second = 0.0;
  double worst() const { return of_first < of_second ? of_first : of_second; }
};
// Below this two effects cannot be distinguished; the diagnosis has the same margin.
inline constexpr double kDistinguished = 10.0;

// Relative standard deviation at which a parameter is known well enough.
inline constexpr double kPrecisePercent = 1.0;

// A parameter of the model, with the relative standard deviation that is expected of it.
struct Precision {
  std::string id, parameter, unit;
  double value = 0.0;
  std::optional<double> percent_before;  // none: not determined at all, or no data
  std::optional<double> percent_after;
  bool precise() const { return percent_after && *percent_after < kPrecisePercent; }
};

struct Design {
  Plan plan;
  data::Axis axis = data::Axis::rotary;  // of the model: rad and rad/s, or m and m/s
  bool effort_is_current = true;         // else a torque, or a force: N m, N
  std::optional<Separation> before, after;
  std::vector<Precision> parameters;  // of a plan that excites undetermined parameters
  std::vector<std::string> warnings;
  // Of each run of the plan, as rehearsed; effort, position and velocity in the axis's units.
  struct Peak {
    double current_a = 0.0, velocity_rad_s = 0.0, travel_rad = 0.0;
  };
  std::vector<Peak> peaks;
};

// T-optimal design for two models (Atkinson and Fedorov 1975), greedily: each motion in turn most increases the smaller
// of both noncentralities. The model need have values only where there are no data to identify it on. Throws
// model::ModelError for effects that cannot be added, simulation::ModelIncomplete, data::DataError, PlanError where no
// motion stays within the limits. Two temperatures are proposed only where the model or one of the two depends on it.
Design discriminate(const PlanRequest& request, std::string_view first, std::string_view second);
// Sequential D-optimal design (Fedorov 1972): each motion in turn is the one that most increases the determinant of the
// information on all parameters, each relative to its value.
Design d_optimal(const PlanRequest& request);

}  // namespace flexspline::planning
