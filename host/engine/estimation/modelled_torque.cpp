#include "host/engine/estimation/modelled_torque.hpp"

#include <algorithm>
#include <span>

namespace flexspline::estimation {
namespace {

using effects::Phase;

// What a term adds to the motor balance at a unit acceleration.
double torque_of_acceleration(const PreparedData& prepared, const Term& term, const std::vector<double>& values) {
  effects::Inputs<catalogue::Real> in;
  in.acceleration = 1.0;
  double torque = 0.0;
  term.entry->real.torque(values.data(), prepared.constants, Balance::motor, std::span(&in, 1), &torque);
  return torque;
}

bool has_weight(const Term& t) {
  return t.entry->info->balance == Balance::load && (t.entry->info->reads & effects::kOutputAngle) != 0;
}

}  // namespace

bool take_torque_from_load(PreparedData& prepared, const Terms& terms) {
  if (prepared.output_signals.torque || std::none_of(terms.begin(), terms.end(), has_weight)) return false;
  for (Record& r : prepared.records) {
    if (r.locked || r.inputs.size() == 0) continue;
    if (!r.torque_without_load) r.torque_without_load = r.inputs.torque;
    r.inputs.torque = *r.torque_without_load;
    r.inputs.torque.resize(r.inputs.size(), 0.0);
  }
  for (const Term& t : terms) {
    if (t.entry->has_state || t.entry->info->phase != Phase::source || !t.entry->adds_torque()) continue;
    const std::vector<double> values = catalogue::natural(*t.entry, t.values);
    const bool inertia = t.entry->info->balance == Balance::motor && torque_of_acceleration(prepared, t, values) != 0.0;
    if (!has_weight(t) && !inertia) continue;
    const double ratio = inertia ? prepared.constants.gear_ratio : 1.0;
    for (Record& r : prepared.records) {
      if (r.locked || r.inputs.size() == 0) continue;
      std::vector<double> torque(r.inputs.size(), 0.0);
      t.entry->real.torque_of_plain(values.data(), prepared.constants, inertia ? Balance::motor : Balance::load,
                                    r.inputs.all(), torque.data());
      for (std::size_t k = 0; k < torque.size(); ++k) r.inputs.torque[k] += ratio * torque[k];
    }
  }
  return true;
}

bool reads_torque(const Terms& terms) {
  return std::any_of(terms.begin(), terms.end(), [](const Term& t) {
    return t.entry->info->balance == Balance::motor && (t.entry->info->reads & effects::kTorque) != 0;
  });
}

bool take_torque_where_read(PreparedData& prepared, const Terms& terms) {
  return reads_torque(terms) && take_torque_from_load(prepared, terms);
}

}  // namespace flexspline::estimation
