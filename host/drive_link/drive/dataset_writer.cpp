#include "host/drive_link/drive/dataset_writer.hpp"

#include <fmt/format.h>

#include <iterator>

#include "host/common/text/build_identity.hpp"
#include "host/drive_link/drive/block_sections.hpp"
#include "host/physics/model/text.hpp"

namespace flexspline::drive {
namespace {

// A TOML float needs a point or an exponent.
std::string real(double value) {
  std::string text = fmt::format("{:.8g}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

}  // namespace

Measures measures_of(const Bytes& block) {
  Measures measures;
  measures.output = encoder_counts_in(block, model::Section::output_encoder) > 0;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != static_cast<std::uint16_t>(model::Section::general)) return;
    model::FieldReader reader(bytes);
    control::GeneralSettings general;
    general.fields(reader);
    measures.torque = general.has_torque_sensor;
  });
  return measures;
}

std::string csv_of(const Recording& r, const Scales& scales, const Origin& origin, const Measures& measures) {
  fmt::memory_buffer text;
  const auto line = [&]<class... Args>(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
    text.push_back('\n');
  };
  line("# experiment: {}", r.run.name);
  line("# load: {}", r.run.locked ? "locked" : "free");
  line("# role: fit");
  line("# gear_ratio: {:.8g}", scales.constants.gear_ratio);
  line("# torque_constant_nm_a: {:.8g}", scales.constants.torque_constant);
  if (scales.header.encoder_counts > 0) line("# encoder_counts: {}", scales.header.encoder_counts);
  line("# motor_position_zero: {}", measures.knows_turn ? "absolute" : "none");
  if (measures.output) line("# output_position_zero: {}", measures.knows_output ? "absolute" : "none");
  line("# current_hold: none");
  line("# drive_serial: {}", origin.serial);
  line("# drive_board: {}", origin.board);
  line("# drive_firmware: {}", origin.firmware);
  line("# block_sha256: {}", origin.block_sha256);
  line("# recorded_by: {}", text::tool_name());
  line("# frames_lost: {}", r.lost);
  line("# frames_dropped_by_drive: {}", r.dropped);
  for (const Gap& gap : r.gaps) line("# gap_at_{:.4f}_s: {} frames", gap.from_s, gap.frames);
  const char* command = r.run.mode == planning::Mode::velocity   ? "velocity_command_rad_s"
                        : r.run.mode == planning::Mode::position ? "position_command_rad"
                                                                 : "current_command_a";
  const bool has_load = r.run.load_torque_nm != 0.0;
  line("time_s,current_a,motor_position_rad,{}{}temperature_c,{}{}", measures.output ? "output_position_rad," : "",
       measures.torque ? "torque_nm," : "", command, has_load ? ",load_torque_nm" : "");
  const auto end = std::back_inserter(text);
  for (std::size_t k = 0; k < r.time_s.size(); ++k) {
    fmt::format_to(end, "{:.9g},{:.7g},{:.10g}", r.time_s[k], r.current_a[k], r.motor_position_rad[k]);
    if (measures.output) fmt::format_to(end, ",{:.10g}", r.output_position_rad[k]);
    if (measures.torque) fmt::format_to(end, ",{:.7g}", r.torque_nm[k]);
    fmt::format_to(end, ",{:.6g},{:.7g}", r.temperature_c[k], r.command[k]);
    if (has_load) fmt::format_to(end, ",{:.7g}", r.run.load_torque_nm);
    text.push_back('\n');
  }
  return fmt::to_string(text);
}

std::string dataset_toml_of(const std::vector<Recording>& recordings, const Scales& scales, const Origin& origin) {
  std::string text = fmt::format(
      "# Recorded by flexspline record on drive {} (board {}, firmware {}),\n# with the parameter block {}.\n# {}\n"
      "format = \"flexspline-dataset/1\"\n\n[drive]\naxis = \"{}\"\ngear_ratio = {}\ntorque_constant_nm_a = {}\n",
      origin.serial, origin.board, origin.firmware, origin.block_sha256, text::tool_name(),
      scales.header.axis == 1 ? "linear" : "rotary", real(scales.constants.gear_ratio),
      real(scales.constants.torque_constant));
  for (const Recording& r : recordings)
    if (r.complete)
      text += fmt::format("\n[[experiment]]\nfile = {}\nname = {}\nload = \"{}\"\nrole = \"fit\"\n",
                          model::toml_string(r.run.name + ".csv"), model::toml_string(r.run.name),
                          r.run.locked ? "locked" : "free");
  return text;
}

}  // namespace flexspline::drive
