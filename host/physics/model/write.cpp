#include <fmt/format.h>

#include <utility>

#include "host/physics/model/same.hpp"
#include "host/physics/model/text.hpp"

namespace flexspline::model {
namespace {

// What a reader of the file may ask of a key of [drive].
std::string_view comment(std::string_view key, data::Axis axis) {
  static constexpr std::pair<std::string_view, std::string_view> kComments[] = {
      {"rated_velocity_rad_s", "motor side"},
      {"rated_torque_nm", "output side; divided by gear_ratio at the motor"},
      {"temperature_reference_c", "at which the temperature effects are zero"},
      {"pitch_m", "travel of one motor turn"},
      {"pole_pairs", "of the motor"},
      {"motor_slots", "of the motor's stator"},
  };
  if (axis == data::Axis::linear && key == "torque_constant_nm_a") return "N per A on this axis";
  if (axis == data::Axis::linear && key == "rated_velocity_rad_s") return "m/s on this axis";
  if (axis == data::Axis::linear && key == "rated_torque_nm") return "N on this axis";
  for (const auto& [name, text] : kComments)
    if (name == key) return text;
  return {};
}

}  // namespace

std::string write(const Model& model) {
  const Model checked = without_unknowns(model);
  std::string text = "format = \"flexspline-model/1\"\n";
  if (!checked.name.empty()) text += fmt::format("name = {}\n", toml_string(checked.name));
  text += "\n[drive]  # known, not identified\n";
  text += fmt::format("axis = \"{}\"\n", axis_name(checked.drive.axis));
  for (const DriveKey& key : kDriveKeys) {
    const Quantity& quantity = checked.drive.*key.quantity;
    if (!quantity.value && quantity.source.empty()) continue;
    const std::string_view says = comment(key.key, checked.drive.axis);
    text += fmt::format("{} = {}{}{}\n", key.key, quantity_text(quantity), says.empty() ? "" : "  # ", says);
  }
  bool open = false;
  for (const Effect& effect : checked.effects)
    for (const Parameter& parameter : effect.parameters) open |= !parameter.value;
  if (!checked.effects.empty())
    text += fmt::format("\n# Effects on the torque balances{}.\n",
                        open ? "; parameters without a value are to be identified" : "");
  for (const Effect& effect : checked.effects) text += "\n" + effect_block(effect);
  for (const History& history : checked.history) text += "\n" + history_block(history);
  require_reads_as(text, checked);
  return text;
}

}  // namespace flexspline::model
