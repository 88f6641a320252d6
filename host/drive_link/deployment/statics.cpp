#include "host/drive_link/deployment/statics.hpp"

#include <algorithm>
#include <cmath>

#include "host/physics/catalogue/steady_torques.hpp"

namespace flexspline::deployment {
namespace {

using catalogue::Real;

constexpr double kCreepShare = 1e-6;  // of rated velocity

}  // namespace

Springs::Springs(const catalogue::ResolvedModel& model) {
  for (const catalogue::ResolvedEffect& e : model.effects)
    if (e.entry->info->balance == effects::Balance::transmission && !e.entry->has_state)
      effects_.push_back(e.entry->make(e.values.data(), model.constants));
}

double Springs::torque_at(double torsion) const {
  effects::Inputs<Real> in{};
  in.torsion = torsion;
  in.viscous_scale = in.coulomb_scale = 1.0;
  effects::Torques<Real> out{};
  for (const auto& effect : effects_) effect->evaluate(in, out);
  return out.transmission;
}

double torque_held_by_friction(const catalogue::ResolvedModel& model) {
  const auto& drive = model.constants;
  double most = 0.0;
  for (const double load : {0.0, model.model->drive.rated_torque_nm.value.value_or(0.0)}) {
    double held = 0.0;
    for (const catalogue::ResolvedEffect& e : model.effects) {
      if (!e.entry->adds_to(effects::Balance::motor)) continue;
      for (const double way : {1.0, -1.0}) {
        effects::Inputs<Real> in{};
        in.direction = in.output_direction = way;
        in.velocity = way * kCreepShare * drive.rated_velocity;
        in.speed = std::abs(in.velocity);
        in.output_velocity = in.velocity / drive.gear_ratio;
        in.torque = in.torque_magnitude = load;
        in.temperature = drive.reference_temperature;
        in.viscous_scale = in.coulomb_scale = 1.0;
        held += way * catalogue::steady_torques(*e.entry->make(e.values.data(), drive), e.entry->has_state, in).motor;
      }
    }
    most = std::max(most, held);
  }
  return most;
}

}  // namespace flexspline::deployment
