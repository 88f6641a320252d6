#include "host/engine/estimation/modelled_current.hpp"

#include <algorithm>

#include "host/engine/estimation/regressor_evaluator.hpp"

namespace flexspline::estimation {
namespace {

bool remembers_current(const Term& term) {
  return term.entry->has_state && (term.entry->info->reads & effects::kCurrent) != 0;
}

// What is measured of the torque that the motor passes on, on the motor's side, N m.
double passed_on(const PreparedData& prepared, const Record& r, std::size_t sample) {
  const bool has_sensor = prepared.output_signals.torque && !r.torque.empty();
  const double torque = has_sensor ? r.inputs.torque_at(sample) : r.load_torque.empty() ? 0.0 : r.load_torque[sample];
  return torque / prepared.constants.gear_ratio;
}

}  // namespace

bool reads_modelled_current(const Term& term) {
  return !term.entry->definition && (term.entry->has_state || is_nonlinear_in_current(term));
}

bool is_delay_of_current(const catalogue::Entry& entry) {
  return entry.has_state && entry.info->reads == effects::kCurrent;
}

bool has_delay_of_current(const Terms& terms) {
  return std::ranges::any_of(terms, [](const Term& t) { return is_delay_of_current(*t.entry); });
}

bool is_nonlinear_in_current(const Term& term) {
  return !term.entry->definition && term.entry->info->reads == effects::kCurrent &&
         term.entry->count(effects::Kind::linear) > 0;
}

void take_modelled_current(PreparedData& prepared, const Terms& terms) {
  if (!prepared.effort_is_current || std::any_of(terms.begin(), terms.end(), remembers_current)) return;
  const RegressorEvaluator motor(prepared, Balance::motor);
  for (const RowRange& range : motor.records()) {
    Record& r = prepared.records[range.record];
    std::vector<double> current = motor.torque_along(terms, range.record);
    for (std::size_t k = 0; k < current.size(); ++k)
      current[k] = (current[k] + passed_on(prepared, r, k)) / prepared.constants.torque_constant;
    r.inputs.modelled_current = std::move(current);
  }
}

}  // namespace flexspline::estimation
