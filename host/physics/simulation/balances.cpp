#include "host/physics/simulation/balances.hpp"

#include <algorithm>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::simulation {

Balances::Balances(const model::Model& model, const catalogue::DriveConstants<double>& constants) {
  std::vector<catalogue::Instance*> last_shifts;
  std::vector<catalogue::Instance*> modulations;
  // A modulated effect is not linear.
  const bool fold = std::none_of(model.effects.begin(), model.effects.end(), [](const model::Effect& e) {
    return catalogue::entry_of(e).info->phase != catalogue::Phase::source;
  });
  for (const model::Effect& effect : model.effects) {
    const catalogue::Entry& entry = catalogue::entry_of(effect);
    const std::vector<double> values = catalogue::values_of(effect, entry);
    catalogue::Instance* instance = instances_.emplace_back(entry.make(values.data(), constants)).get();
    if (entry.has_state) states_.push_back(instance);
    if (entry.info->phase == catalogue::Phase::shift)
      (entry.info->acts_last ? last_shifts : changing_).push_back(instance);
    if (entry.info->phase == catalogue::Phase::modulate) modulations.push_back(instance);
    if (!entry.adds_torque()) continue;
    // A user-defined effect may be linear where it is tried and nonlinear outside of that range.
    if (fold && !entry.has_state && !entry.definition && take_piecewise_linear(*instance, entry.info->balance))
      continue;
    switch (entry.info->balance) {
      case catalogue::Balance::motor:
        motor_.push_back({instance, entry.has_state});
        break;
      case catalogue::Balance::transmission:
        transmission_.push_back({instance, entry.has_state});
        break;
      case catalogue::Balance::load:
        load_.push_back({instance, entry.has_state});
        break;
    }
  }
  Inputs twisted{};
  twisted.torsion = 1e-3;
  Inputs loaded = twisted;
  loaded.torque = loaded.torque_magnitude = 1.0;
  Torques without, with;
  add_transmission(twisted, Inputs{}, without);
  add_transmission(loaded, Inputs{}, with);
  transmission_reads_torque_ = with.transmission != without.transmission;
  // A shift comes before all that see the signal.
  changing_.insert(changing_.end(), last_shifts.begin(), last_shifts.end());
  changing_.insert(changing_.end(), modulations.begin(), modulations.end());
}

bool Balances::take_piecewise_linear(const catalogue::Instance& instance, Balance balance) {
  if (balance == Balance::transmission) {
    const auto stiffness = spring_of(instance);
    stiffness_ += stiffness.value_or(0.0);
    return stiffness.has_value();
  }
  const auto linear = piecewise_linear_of(instance, balance);
  if (linear) (balance == Balance::motor ? linear_motor_ : linear_load_) += *linear;
  return linear.has_value();
}

void Balances::change(Inputs& inputs) const {
  // An instance does only one of the two; the other call is empty.
  for (const catalogue::Instance* instance : changing_) {
    instance->shift(inputs);
    instance->modulate(inputs);
  }
}

void Balances::advance(const Inputs& now, const Inputs& before) {
  for (catalogue::Instance* instance : states_) instance->advance(now, before);
}

double Balances::motor_inertia() const {
  const Inputs rest{};
  Inputs accelerated{};
  accelerated.acceleration = 1.0;
  Torques with;
  Torques without;
  add_motor(accelerated, rest, with);
  add_motor(rest, rest, without);
  return with.motor - without.motor;
}

double Balances::output_inertia() const {
  const Inputs rest{};
  Inputs accelerated{};
  accelerated.output_acceleration = 1.0;
  Torques with;
  Torques without;
  add_load(accelerated, rest, with);
  add_load(rest, rest, without);
  return with.load - without.load;
}

}  // namespace flexspline::simulation
