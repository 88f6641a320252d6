#include "host/drive_link/drive/settings_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

namespace flexspline::drive {
namespace {

// Which quantity of a block's description is which key of which table; times a factor.
struct Place {
  std::string_view quantity;
  std::string_view table;
  std::string_view key;
  double factor = 1.0;
};
constexpr double kPerTurn = 0.5 / std::numbers::pi;
constexpr Place kPlaces[] = {{"motor_encoder_counts", "motor_encoder", "counts"},
                             {"output_encoder_counts", "output_encoder", "counts"},
                             {"position_gain", "position_loop", "bandwidth_hz", kPerTurn},
                             {"velocity_gain", "velocity_loop", "gain_nm_s_rad"},
                             {"integral_gain", "velocity_loop", "integral_nm_rad"},
                             {"current_limit", "limits", "current_a"},
                             {"torque_limit", "limits", "torque_nm"},
                             {"velocity_limit", "limits", "velocity_rad_s"},
                             {"no_torque_drives_above", "limits", "overspeed_rad_s"},
                             {"acceleration_limit", "limits", "acceleration_rad_s2"},
                             {"current_sensor_full_scale", "current_sensor", "full_scale_a"},
                             {"torque_sensor_full_scale", "torque_sensor", "full_scale_nm"},
                             {"temperature_sensor_full_scale", "temperature_sensor", "full_scale_c"},
                             {"amplifier_full_scale", "amplifier", "full_scale_a"},
                             {"direction_band", "feedforward", "direction_band_rad_s"},
                             {"fault_overspeed", "faults", "overspeed_rad_s"},
                             {"fault_overcurrent", "faults", "overcurrent_a"},
                             {"fault_overtemperature", "faults", "overtemperature_c"},
                             {"fault_acceleration", "faults", "acceleration_rad_s2"},
                             {"fault_host", "faults", "host_s"},
                             {"fault_stop", "faults", "stop_s"},
                             {"fault_following_error", "faults", "following_error_rad"},
                             {"fault_following_velocity", "faults", "following_velocity_rad_s"},
                             {"fault_following", "faults", "following_s"},
                             {"fault_output_stuck", "faults", "output_stuck_rad"},
                             {"residual_map_largest", "residual_map", "largest_nm"}};

}  // namespace

std::string settings_text(const deployment::Unpacked& block, double most_current_a,
                          std::optional<double>& lowered_from_a) {
  if (block.settings.empty())
    throw deployment::PackError(
        "the drive's block has no settings of the drive; state them: flash --settings FILE.toml, as pack --drive takes "
        "them");
  std::vector<std::pair<std::string_view, std::string>> tables;
  for (const Place& place : kPlaces) {
    const auto found = std::find_if(block.settings.begin(), block.settings.end(),
                                    [&](const auto& q) { return q.name == place.quantity; });
    if (found == block.settings.end() || !(found->value > 0.0)) continue;
    auto table = std::find_if(tables.begin(), tables.end(), [&](const auto& t) { return t.first == place.table; });
    if (table == tables.end()) table = tables.insert(tables.end(), {place.table, {}});
    double value = found->value * place.factor;
    if (place.key == "overcurrent_a" && value > most_current_a) {
      lowered_from_a = value;
      value = most_current_a;
    }
    const bool is_count = place.key == "counts";
    table->second +=
        fmt::format("{} = {}\n", place.key, is_count ? fmt::format("{:.0f}", value) : fmt::format("{:.9e}", value));
  }
  std::string text = "format = \"flexspline-drive/1\"\n";
  for (const auto& [name, lines] : tables) text += fmt::format("[{}]\n{}", name, lines);
  return text;
}

}  // namespace flexspline::drive
