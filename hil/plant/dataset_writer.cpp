#include <fmt/format.h>

#include <iterator>

#include "hil/plant/recorder.hpp"
#include "hil/plant/text_lines.hpp"
#include "hil/plant/whole_file.hpp"

namespace flexspline::plant {
namespace {

Text csv(const Record& record, const Drive& drive) {
  Text text;
  const bool tachometer = !record.motor_velocity_rad_s.empty();
  line(text, "# experiment: {}", record.name);
  line(text, "# load: {}", record.locked ? "locked" : "free");
  line(text, "# role: {}", record.holdout ? "holdout" : "fit");
  line(text, "# gear_ratio: {}", drive.gear_ratio);
  line(text, "# torque_constant_nm_a: {}", drive.torque_constant_nm_a);
  line(text, "# encoder_counts: {}", drive.sensors.motor_counts);
  line(text, "# output_encoder_counts: {}", drive.sensors.output_counts);
  line(text, "# motor_position_zero: absolute");
  line(text, "# output_position_zero: absolute");
  line(text, "# current_hold: zoh");
  line(text, "# noise_std_current_a: {}", record.current_noise_std);
  line(text, "# noise_std_motor_position_rad: {}", record.motor_position_noise_std);
  line(text, "# noise_std_torque_nm: {}", record.torque_noise_std);
  line(text, "# noise_std_output_position_rad: {}", record.output_position_noise_std);
  line(text, "# noise_std_temperature_c: {}", record.temperature_noise_std);
  if (tachometer) line(text, "# noise_std_motor_velocity_rad_s: {}", record.tachometer_noise_std);
  line(text, "time_s,current_a,motor_position_rad,output_position_rad,torque_nm,temperature_c,{}{}{}",
       record.velocity_mode ? "velocity_command_rad_s" : "current_command_a", tachometer ? ",motor_velocity_rad_s" : "",
       record.load_torque_nm.empty() ? "" : ",load_torque_nm");
  for (std::size_t k = 0; k < record.time_s.size(); ++k) {
    fmt::format_to(std::back_inserter(text), "{:.9g},{:.7g},{:.10g},{:.10g},{:.7g},{:.6g},{:.7g}", record.time_s[k],
                   record.current_a[k], record.motor_position_rad[k], record.output_position_rad[k],
                   record.torque_nm[k], record.temperature_c[k], record.command[k]);
    if (tachometer) fmt::format_to(std::back_inserter(text), ",{:.7g}", record.motor_velocity_rad_s[k]);
    if (!record.load_torque_nm.empty()) fmt::format_to(std::back_inserter(text), ",{:.7g}", record.load_torque_nm[k]);
    text.push_back('\n');
  }
  return text;
}

Text dataset(const std::vector<Record>& records, const Drive& drive) {
  Text text;
  line(text, "format = \"flexspline-dataset/1\"\n");
  line(text, "[drive]\naxis = \"rotary\"");
  line(text, "gear_ratio = {}", real(drive.gear_ratio));
  line(text, "torque_constant_nm_a = {}", real(drive.torque_constant_nm_a));
  for (const Record& record : records) {
    line(text, "\n[[experiment]]\nfile = \"{}.csv\"\nname = \"{}\"", record.name, record.name);
    line(text, "load = \"{}\"\nrole = \"{}\"", record.locked ? "locked" : "free", record.holdout ? "holdout" : "fit");
  }
  return text;
}

void write_drive_section(Text& text, const Drive& drive) {
  line(text, "\n[drive]\naxis = \"rotary\"");
  line(text, "gear_ratio = {}", real(drive.gear_ratio));
  line(text, "torque_constant_nm_a = {{ value = {}, source = \"data sheet\" }}", real(drive.torque_constant_nm_a));
  line(text, "rated_current_a = {}", real(drive.rated_current_a));
  line(text, "rated_velocity_rad_s = {}", real(drive.rated_velocity_rad_s));
  line(text, "rated_torque_nm = {}", real(drive.rated_torque_nm));
  line(text, "temperature_reference_c = {}", real(drive.temperature_reference_c));
}

void write_order(Text& text, const Effect& effect) {
  line(text, "order = {{ value = {:g}, fixed = true }}", effect.value("order"));
}

Text base_model(const Drive& drive) {
  Text text;
  line(text, "# Every effect of the drive that is known, to be identified.");
  line(text, "format = \"flexspline-model/1\"\nname = \"{}\"", drive.name);
  write_drive_section(text, drive);
  const Effect* dahl = drive.find("dahl_friction");
  const bool bristle_known = dahl != nullptr && !dahl->hidden;
  for (const Effect& effect : drive.effects) {
    if (!effect.present || effect.hidden || !effect.catalogue) continue;
    if (bristle_known && effect.type == "coulomb_friction") continue;
    line(text, "\n[[effect]]\ntype = \"{}\"", effect.type);
    if (effect.has("order")) {
      line(text, "id = \"{}_{:g}\"\n[effect.parameters]", effect.type, effect.value("order"));
      write_order(text, effect);
    }
  }
  return text;
}

// A bristle replaces Coulomb friction.
void write_effects(Text& text, const Drive& drive, bool with_hidden) {
  const Effect* dahl = drive.find("dahl_friction");
  const bool bristle = dahl != nullptr && (with_hidden || !dahl->hidden);
  for (const Effect& effect : drive.effects) {
    if (!effect.present || (bristle && effect.type == "coulomb_friction") || (effect.hidden && !with_hidden)) continue;
    line(text, "\n[[effect]]\ntype = \"{}\"", effect.type);
    if (effect.has("order")) line(text, "id = \"{}_{:g}\"", effect.type, effect.value("order"));
    if (!effect.catalogue) line(text, "catalogue = false");
    line(text, "[effect.parameters]");
    for (const Parameter& parameter : effect.parameters) {
      if (parameter.key == "order") {
        write_order(text, effect);
      } else {
        line(text, "{} = {{ value = {}, unit = \"{}\" }}", parameter.key, real(parameter.value), parameter.unit);
      }
    }
  }
}

Text truth(const std::vector<Record>& records, const Drive& drive) {
  Text text;
  line(text, "# The plant's true parameters. Not for use in an identification.");
  line(text, "format = \"flexspline-model/1\"\nname = \"{}-truth\"", drive.name);
  line(text, "hidden = \"{}\"\nseed = {}\nscale = {}", drive.hidden(), records.empty() ? 0 : records.front().seed,
       real(drive.hidden_scale));
  write_drive_section(text, drive);
  write_effects(text, drive, true);
  for (const Record& record : records) {
    line(text, "\n[[run]]                          # friction of this run against the values above\nname = \"{}\"",
         record.name);
    line(text, "viscous_factor = {}\ncoulomb_factor = {}", real(record.viscous_factor), real(record.coulomb_factor));
  }
  return text;
}

}  // namespace

std::string model_text(const Drive& drive, bool with_hidden) {
  Text text;
  line(text, "# The true values.");
  line(text, "format = \"flexspline-model/1\"\nname = \"{}\"", drive.name);
  write_drive_section(text, drive);
  write_effects(text, drive, with_hidden);
  return {text.data(), text.size()};
}

void write_dataset(const std::vector<Record>& records, const Drive& drive, const std::filesystem::path& folder) {
  make_folder(folder);
  const auto write = [&](const std::string& name, const Text& text) {
    write_whole(folder / name, {text.data(), text.size()});
  };
  for (const Record& record : records) write(record.name + ".csv", csv(record, drive));
  write("base-model.toml", base_model(drive));
  write("truth.toml", truth(records, drive));
  write("dataset.toml", dataset(records, drive));
}

}  // namespace flexspline::plant
