#include "host/engine/comparison/free_run.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "host/common/signals/butterworth.hpp"

namespace flexspline::comparison {

std::vector<FreeRunSignal> free_run_signals(const estimation::PreparedData& prepared, std::size_t record_at,
                                            simulation::FreeRun run) {
  using data::Column;
  const estimation::Record& record = prepared.records[record_at];
  const data::Experiment& e = *record.experiment;
  std::vector<FreeRunSignal> signals;
  const auto add = [&signals](const char* name, Column column, std::vector<double> measured,
                              std::vector<double>& simulated) {
    if (!simulated.empty()) signals.push_back({name, column, std::move(measured), std::move(simulated)});
  };
  if (!run.motor_velocity.empty() && record.has_motor_motion) {
    std::vector<double> measured(e.size());
    for (std::size_t k = 0; k < e.size(); ++k) measured[k] = record.inputs.velocity_at(k);
    const double sample_hz = 1.0 / e.sample_s;
    const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                          std::min(prepared.pipeline.motion_cutoff_hz, 0.45 * sample_hz), sample_hz);
    for (const data::Segment& s : record.segments)
      filter.apply_in_place(std::span<double>(run.motor_velocity.data() + s.first, s.last - s.first));
    add("motor_velocity", Column::motor_velocity, std::move(measured), run.motor_velocity);
  }
  if (e.has(Column::motor_position))
    add("motor_position", Column::motor_position, e[Column::motor_position], run.motor_position);
  if (e.has(Column::output_position) && e.load != data::Load::locked)
    add("output_position", Column::output_position, e[Column::output_position], run.output_position);
  if (e.has(Column::torque)) add("torque", Column::torque, e[Column::torque], run.torque);
  return signals;
}

}  // namespace flexspline::comparison
