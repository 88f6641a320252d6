#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/output/interchange/export.hpp"
#include "host/output/interchange/sweeps.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::interchange {
namespace {

constexpr int kPoints = 101;

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string parameters(const model::Model& model) {
  std::string text = "id,effect,parameter,value,unit,std\n";
  for (const model::Effect& effect : model.effects) {
    for (const model::Parameter& p : effect.parameters)
      text += fmt::format("{},{},{},{:.17g},{},{}\n", csv_field(effect.id), effect.type, p.name, *p.value, p.unit,
                          p.std ? fmt::format("{:.6g}", *p.std) : "");
    if (!effect.definition) continue;
    const model::Table& table = effect.definition->table;
    for (std::size_t k = 0; k < table.value.size(); ++k)
      text += fmt::format("{},{},value_{},{:.17g},{},{}\n", csv_field(effect.id), effect.type, k, table.value[k],
                          model.drive.axis == data::Axis::linear ? "N" : "N*m",
                          k < table.std.size() ? fmt::format("{:.6g}", table.std[k]) : "");
  }
  return text;
}

// How far a signal goes on this drive; nothing where its ratings do not state it.
std::optional<double> range_of(effects::Variable variable, const model::Model& model,
                               const catalogue::DriveConstants<double>& constants, const Sweeps& sweeps) {
  using effects::Variable;
  const auto& drive = model.drive;
  const auto scaled = [](const model::Quantity& q, double by) {
    return q.value ? std::optional<double>(*q.value * by) : std::nullopt;
  };
  switch (variable) {
    case Variable::velocity:
    case Variable::speed:
      return scaled(drive.rated_velocity_rad_s, 1.0);
    case Variable::output_velocity:
      return scaled(drive.rated_velocity_rad_s, 1.0 / constants.gear_ratio);
    case Variable::torsion_rate:
      return scaled(drive.rated_velocity_rad_s, 0.01 / constants.gear_ratio);
    // From rest to the rated velocity in a twentieth of a second.
    case Variable::acceleration:
      return scaled(drive.rated_velocity_rad_s, 20.0);
    case Variable::output_acceleration:
      return scaled(drive.rated_velocity_rad_s, 20.0 / constants.gear_ratio);
    case Variable::torque:
    case Variable::torque_magnitude:
      return scaled(drive.rated_torque_nm, 1.0);
    case Variable::current:
      return scaled(drive.rated_current_a, 1.0);
    case Variable::torsion: {
      if (!drive.rated_torque_nm.value || !sweeps.has_transmission()) return std::nullopt;
      const double torsion = sweeps.torsion_at(*drive.rated_torque_nm.value);
      return torsion > 0.0 ? std::optional<double>(torsion) : std::nullopt;
    }
    case Variable::temperature:
    case Variable::motor_angle:
    case Variable::output_angle:
      break;
  }
  return std::nullopt;
}

// Two ids may differ in characters alone that a file's name does not hold.
std::string free_file_name(const std::string& id, const std::vector<std::pair<std::string, std::string>>& files) {
  const std::string name = "effect-" + c_name(id);
  std::string file = name + ".csv";
  const auto taken = [&] {
    return std::any_of(files.begin(), files.end(), [&](const auto& other) { return other.first == file; });
  };
  for (int number = 2; taken(); ++number) file = fmt::format("{}-{}.csv", name, number);
  return file;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> csv_tables(const model::Model& model) {
  const auto constants = catalogue::constants_of(model.drive);
  const bool linear = model.drive.axis == data::Axis::linear;
  const Sweeps sweeps(model, constants);
  std::vector<std::pair<std::string, std::string>> files{{"parameters.csv", parameters(model)}};

  if (model.drive.rated_velocity_rad_s.value) {
    const double fastest = *model.drive.rated_velocity_rad_s.value;
    std::string text = "motor_velocity_rad_s,motor_torque_nm,load_torque_nm\n";
    // The points by a square law: closer where friction bends. None at zero, where direction decides.
    for (int k = -kPoints / 2; k <= kPoints / 2; ++k) {
      if (k == 0) continue;
      const double share = static_cast<double>(k) / (kPoints / 2);
      const double w = fastest * share * std::abs(share);
      const SteadyTorque torque = sweeps.at_speed(w);
      text += fmt::format("{:.9g},{:.9g},{:.9g}\n", w, torque.motor, torque.load);
    }
    files.emplace_back("friction.csv", text);
  }
  if (model.drive.rated_torque_nm.value && sweeps.has_transmission()) {
    std::string text = "torsion_rad,torque_nm\n";
    for (const Twist& twist : sweeps.loop(*model.drive.rated_torque_nm.value))
      text += fmt::format("{:.9g},{:.9g}\n", twist.torsion, twist.torque);
    files.emplace_back("stiffness.csv", text);
  }
  for (const model::Effect& effect : model.effects) {
    const catalogue::Entry& entry = catalogue::entry_of(effect);
    const std::vector<double> values = catalogue::values_of(effect, entry);
    const auto single = catalogue::single_variable(entry, values, constants);
    if (!single) continue;
    std::vector<double> x;
    const effects::VariableInfo* info = nullptr;
    for (const effects::VariableInfo& v : effects::kVariables)
      if (v.variable == single->variable) info = &v;
    if (info->periodic) {
      x = catalogue::points_of_turn(kPoints - 1);
    } else {
      const auto range = range_of(single->variable, model, constants, sweeps);
      if (!range) continue;
      x = catalogue::even_points(-*range, *range, kPoints);
    }
    const std::vector<double> forward = catalogue::torque_over(entry, values, constants, single->variable, x, 1.0);
    const std::vector<double> backward = catalogue::torque_over(entry, values, constants, single->variable, x, -1.0);
    std::string text = fmt::format("{},torque_positive_direction,torque_negative_direction\n", info->name);
    text = fmt::format("# {} over {} ({}); torque in {} on the {} balance\n", effect.type, info->name,
                       catalogue::unit_on(info->unit, model.drive.axis), linear ? "N" : "N*m",
                       entry.info->balance == catalogue::Balance::motor          ? "motor"
                       : entry.info->balance == catalogue::Balance::transmission ? "transmission"
                                                                                 : "load") +
           text;
    for (std::size_t k = 0; k < x.size(); ++k)
      text += fmt::format("{:.9g},{:.9g},{:.9g}\n", x[k], forward[k], backward[k]);
    files.emplace_back(free_file_name(effect.id, files), text);
  }
  return files;
}

}  // namespace flexspline::interchange
