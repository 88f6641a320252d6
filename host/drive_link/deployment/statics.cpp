#include "host/drive_link/deployment/statics.hpp"

#include <algorithm>
#include <cmath>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/steady_torques.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::deployment {
namespace {

using catalogue::Real;

constexpr double kCreepShare = 1e-6;  // of rated velocity

}  // namespace

Springs::Springs(const model::Model& model) {
  const auto drive = catalogue::constants_of(model.drive);
  for (const model::Effect& effect : model.effects) {
    const catalogue::Entry& entry = catalogue::entry_of(effect);
    if (entry.info->balance != effects::Balance::transmission || entry.has_state) continue;
    effects_.push_back(entry.make(catalogue::values_of(effect, entry).data(), drive));
  }
}

double Springs::torque_at(double torsion) const {
  effects::Inputs<Real> in{};
  in.torsion = torsion;
  in.viscous_scale = in.coulomb_scale = 1.0;
  effects::Torques<Real> out{};
  for (const auto& effect : effects_) effect->evaluate(in, out);
  return out.transmission;
}

double torque_held_by_friction(const model::Model& model) {
  const auto drive = catalogue::constants_of(model.drive);
  double most = 0.0;
  for (const double load : {0.0, model.drive.rated_torque_nm.value.value_or(0.0)}) {
    double held = 0.0;
    for (const model::Effect& effect : model.effects) {
      const catalogue::Entry& entry = catalogue::entry_of(effect);
      if (!entry.adds_to(effects::Balance::motor)) continue;
      const std::vector<double> values = catalogue::values_of(effect, entry);
      for (const double way : {1.0, -1.0}) {
        effects::Inputs<Real> in{};
        in.direction = in.output_direction = way;
        in.velocity = way * kCreepShare * drive.rated_velocity;
        in.speed = std::abs(in.velocity);
        in.output_velocity = in.velocity / drive.gear_ratio;
        in.torque = in.torque_magnitude = load;
        in.temperature = drive.reference_temperature;
        in.viscous_scale = in.coulomb_scale = 1.0;
        held += way * catalogue::steady_torques(*entry.make(values.data(), drive), entry.has_state, in).motor;
      }
    }
    most = std::max(most, held);
  }
  return most;
}

}  // namespace flexspline::deployment
