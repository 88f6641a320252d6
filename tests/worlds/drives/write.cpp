#include "tests/worlds/drives/write.hpp"

#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "tests/worlds/drives/random.hpp"

namespace flexspline::worlds::drives {
namespace {

namespace fs = std::filesystem;

std::string text_of(double value, int digits = 6) {
  if (!std::isfinite(value)) return "null";
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits).ptr;
  return std::string(buffer, end);
}

void write_file(const fs::path& path, const std::string& content) {
  std::ofstream out(path, std::ios::binary);
  out << content;
  out.close();
  if (!out) throw std::runtime_error(path.string() + " could not be written");
}

std::string csv_of(const Measured& record) {
  const std::pair<const char*, const std::vector<double>*> all[] = {
      {"time_s", &record.time_s},
      {"current_a", &record.current_a},
      {"motor_position_rad", &record.motor_position_rad},
      {"motor_velocity_rad_s", &record.motor_velocity_rad_s},
      {"output_position_rad", &record.output_position_rad},
      {"torque_nm", &record.torque_nm},
      {"load_torque_nm", &record.load_torque_nm},
      {"temperature_c", &record.temperature_c}};
  std::string out;
  for (const auto& [name, column] : all) {
    if (column->empty()) continue;
    if (!out.empty()) out += ',';
    out += name;
  }
  out += '\n';
  for (std::size_t k = 0; k < record.time_s.size(); ++k) {
    for (const auto& [name, column] : all) {
      if (column->empty()) continue;
      if (column != &record.time_s) out += ',';
      // Angles of many turns need more digits than the encoder's steps.
      const bool is_angle = column == &record.motor_position_rad || column == &record.output_position_rad;
      out += text_of((*column)[k], is_angle ? 13 : 8);
    }
    out += '\n';
  }
  return out;
}

std::string dataset_of(const Case& drive, const std::vector<const Measured*>& records) {
  std::string out = "format = \"flexspline-dataset/1\"\n\n[drive]\naxis = \"rotary\"\n";
  out += "gear_ratio = " + text_of(drive.mechanics.gear_ratio) + '\n';
  out += "torque_constant_nm_a = " + text_of(drive.mechanics.torque_constant_nm_a) + '\n';
  out += "encoder_counts = " + text_of(drive.sensors.motor_counts, 9) + '\n';
  if (drive.sensors.output_counts > 0.0)
    out += "output_encoder_counts = " + text_of(drive.sensors.output_counts, 9) + '\n';
  const std::string zero = drive.sensors.knows_zero ? "\"absolute\"\n" : "\"none\"\n";
  out += "motor_position_zero = " + zero;
  if (drive.sensors.output_counts > 0.0) out += "output_position_zero = " + zero;
  out += "current_hold = \"none\"\n";
  for (const Measured* record : records) {
    out += "\n[[experiment]]\nfile = \"" + record->name + ".csv\"\nname = \"" + record->name + "\"\nload = \"free\"\n";
    out += std::string("role = \"") + (record->is_holdout ? "holdout" : "fit") + "\"\n";
  }
  return out;
}

std::string effect_of(const char* type, const char* parameter, double value, const char* unit) {
  return std::string("\n[[effect]]\ntype = \"") + type + "\"\n[effect.parameters]\n" + parameter +
         " = { value = " + text_of(value, 3) + ", unit = \"" + unit + "\" }\n";
}

/// The model a user writes from data sheets: values are a tenth or so off.
std::string model_of(const Case& drive) {
  const Mechanics& m = drive.mechanics;
  Random random(drive.seed, "data sheet");
  const auto stated = [&](double value) { return value * (1.0 + 0.1 * random.normal()); };
  std::string out = "format = \"flexspline-model/1\"\nname = \"" + drive.kind + "\"\n\n[drive]\naxis = \"rotary\"\n";
  out += "gear_ratio = " + text_of(m.gear_ratio) + "\ntorque_constant_nm_a = " + text_of(m.torque_constant_nm_a) + '\n';
  out += "rated_current_a = " + text_of(drive.rated_current_a, 3) +
         "\nrated_velocity_rad_s = " + text_of(drive.rated_velocity_rad_s) + '\n';
  out += "rated_torque_nm = " + text_of(m.torque_constant_nm_a * drive.rated_current_a * m.gear_ratio, 3) + '\n';
  out += "temperature_reference_c = " + text_of(drive.reference_c) + '\n';
  if (drive.pole_pairs > 0) out += "pole_pairs = " + std::to_string(drive.pole_pairs) + '\n';
  const double load = drive.sensors.has_torque ? 0.0 : m.output_inertia_kgm2 / (m.gear_ratio * m.gear_ratio);
  out += effect_of("inertia", "inertia", stated(m.motor_inertia_kgm2 + load), "kg*m^2");
  out += effect_of("viscous_friction", "coefficient", stated(m.friction.viscous_nms_rad), "N*m*s/rad");
  out += effect_of("coulomb_friction", "torque", stated(m.friction.coulomb_nm), "N*m");
  if (drive.models_gravity) out += "\n[[effect]]\ntype = \"gravity\"\n";
  if (drive.sensors.has_torque) out += "\n[[effect]]\ntype = \"structural_damping\"\n";
  if (drive.sensors.has_torque)
    out += effect_of("linear_stiffness", "stiffness", stated(m.stiffness_nm_rad), "N*m/rad");
  return out;
}

std::string names_of(const std::vector<Name>& names) {
  std::string out = "[";
  for (const Name& name : names) {
    if (out.size() > 1) out += ", ";
    out += "{\"effect\": \"" + name.effect + '"' + (name.order ? ", \"order\": " + text_of(*name.order) : "") + '}';
  }
  return out + ']';
}

std::string hidden_of(const Case& drive, const Truth& truth) {
  if (drive.hidden.effect.empty()) return "[]";
  std::string accepted;
  for (const std::string& name : truth.accepted) accepted += (accepted.empty() ? "\"" : ", \"") + name + '"';
  std::string parameters;
  for (const auto& [name, value] : drive.hidden.parameters) {
    parameters += (parameters.empty() ? "\"" : ", \"") + name + "\": " + text_of(value);
  }
  return "[{\"effect\": \"" + drive.hidden.effect +
         "\", \"order\": " + (drive.hidden.order > 0.0 ? text_of(drive.hidden.order) : "null") + ", \"accepted\": [" +
         accepted + "], \"excess\": " + text_of(truth.excess) + ", \"parameters\": {" + parameters + "}}]";
}

std::string truth_text_of(const Case& drive, const Truth& truth) {
  std::string imperfections;
  for (const Imperfection& one : truth.imperfections) {
    imperfections += imperfections.empty() ? "\n" : ",\n";
    imperfections += "    {\"name\": \"" + one.name + "\", \"excess\": " + text_of(one.excess, 4) +
                     ", \"names\": " + names_of(one.names) + '}';
  }
  return "{\n  \"kind\": \"" + drive.kind + "\",\n  \"seed\": " + std::to_string(drive.seed) +
         ",\n  \"drawn_again\": " + std::to_string(drive.drawn_again) + ",\n  \"hidden\": " + hidden_of(drive, truth) +
         ",\n  \"also_true\": " + names_of(truth.also_true) + ",\n  \"base_error_nm\": " + text_of(truth.error_nm) +
         ",\n  \"cutoff_hz\": " + text_of(truth.cutoff_hz) + ",\n  \"imperfections\": [" + imperfections + "\n  ]\n}\n";
}

}  // namespace

void write_case(const fs::path& folder, const Case& drive, const std::vector<Measured>& records, const Truth& truth) {
  const fs::path root = folder / (drive.kind + '-' + std::to_string(drive.seed));
  for (const bool is_holdout : {false, true}) {
    const fs::path part = root / (is_holdout ? "holdout" : "fit");
    fs::create_directories(part);
    std::vector<const Measured*> chosen;
    for (const Measured& record : records) {
      if (record.is_holdout != is_holdout) continue;
      chosen.push_back(&record);
      write_file(part / (record.name + ".csv"), csv_of(record));
    }
    write_file(part / "dataset.toml", dataset_of(drive, chosen));
  }
  write_file(root / "model.toml", model_of(drive));
  write_file(root / "truth.json", truth_text_of(drive, truth));
}

}  // namespace flexspline::worlds::drives
