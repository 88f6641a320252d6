#include "host/engine/planning/report_plans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <span>
#include <string>

namespace flexspline::planning {
namespace {

// Section 4.2.2: four wave forms at half power and 0.5 Hz, asymmetric sines, sines of other frequencies and amplitudes.
constexpr const char* kCompliance[] = {"50-1",    "50-3",    "50-4",    "50-7",    "50-8",    "100-8",
                                       "20-1-02", "40-1-04", "60-1-06", "80-1-08", "100-1-10"};
// Rows of table 7.
constexpr const char* kFriction[] = {"50-1-02", "50-1-04", "50-1-06",  "50-1-08",  "50-1-10",  "50-1-12",  "70-1-02",
                                     "70-1-04", "70-1-06", "70-1-08",  "85-1-02",  "85-1-03",  "85-1-04",  "85-1-06",
                                     "85-1-08", "85-4-04", "100-1-02", "100-1-03", "100-1-04", "100-1-06", "50-3-02",
                                     "50-3-04", "50-3-06", "50-3-08",  "50-7-02",  "50-7-03"};
// Rows of table 8.
constexpr const char* kSlow[] = {"18-3-02", "18-3-04", "18-3-06", "18-3-08", "18-3-10", "20-3-04", "20-3-06", "20-3-08",
                                 "20-3-10", "22-3-02", "22-3-04", "22-3-06", "25-3-02", "25-3-04", "25-3-06"};
constexpr double kFrequency_hz = 0.5;  // where a name has none
constexpr double kPeriods = 3.0;
constexpr double kLargerHalf = 1.2;  // of the asymmetric sine

Waveform waveform_of(int code) {
  switch (code) {
    case 3:
      return Waveform::triangle;
    case 4:
      return Waveform::square;
    case 7:
      return Waveform::composite;
    case 8:
      return Waveform::asymmetric_sine;
    default:
      return Waveform::sine;
  }
}
Run run_of(const char* name, Mode mode, double full, double shortest_s, bool locked) {
  int percent = 0, code = 0, tenths = 0;
  const int read = std::sscanf(name, "%d-%d-%d", &percent, &code, &tenths);
  Run run;
  run.name = name;
  run.mode = mode;
  run.waveform = waveform_of(code);
  run.amplitude = 0.01 * percent * full;
  if (run.waveform == Waveform::asymmetric_sine) run.amplitude /= kLargerHalf;
  run.frequency_hz = read == 3 ? 0.1 * tenths : kFrequency_hz;
  run.duration_s = std::max(shortest_s, kPeriods / run.frequency_hz);
  run.locked = locked;
  return run;
}

}  // namespace

const std::vector<ReportPlan>& report_plans() {
  static const std::vector<ReportPlan> kPlans{
      {"report-compliance", "eleven currents with the output locked (section 4.2.2)"},
      {"report-friction", "the 26 velocities of table 7, output free"},
      {"report-friction-slow", "the fifteen currents of table 8 that just break the friction, output free"}};
  return kPlans;
}

std::optional<Plan> report_plan(std::string_view name, const FullScale& full) {
  Plan plan;
  plan.limits.velocity_rad_s = full.velocity_rad_s;
  plan.limits.current_a = full.current_a;
  const auto add = [&](std::span<const char* const> names, Mode mode, double scale, double shortest_s, bool locked) {
    for (const char* run : names) plan.runs.push_back(run_of(run, mode, scale, shortest_s, locked));
  };
  if (name == "report-compliance") {
    add(kCompliance, Mode::current, full.current_a, 12.0, true);
  } else if (name == "report-friction") {
    add(kFriction, Mode::velocity, full.velocity_rad_s, 10.0, false);
    plan.limits.current_a = 0.0;  // what the velocity takes; the drive has its own
  } else if (name == "report-friction-slow") {
    add(kSlow, Mode::current, full.current_a, 15.0, false);
  } else {
    return {};
  }
  for (const ReportPlan& known : report_plans())
    if (known.name == name) plan.notes.emplace_back(known.title);
  return plan;
}

}  // namespace flexspline::planning
