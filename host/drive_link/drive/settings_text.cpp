#include "host/drive_link/drive/settings_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "host/drive_link/deployment/bases.hpp"
#include "host/physics/catalogue/resolved_model.hpp"

namespace flexspline::drive {
namespace {

using deployment::NamedQuantity;
using Quantities = std::vector<NamedQuantity>;

enum class Take {
  positive,     // zero: the block does not have it
  any,          // of any sign
  unlike_model  // only where it does not follow from the block's own model
};
// Which quantity of a block's description is which key of which table; times a factor.
struct Place {
  std::string_view quantity;
  std::string_view table;
  std::string_view key;
  double factor = 1.0;
  Take take = Take::positive;
};
constexpr double kPerTurn = 0.5 / std::numbers::pi;
// Limits first: messages are in this order.
constexpr Place kPlaces[] = {
    {"lowest_position", "limits", "lowest_rad", 1.0, Take::any},
    {"highest_position", "limits", "highest_rad", 1.0, Take::any},
    {"current_limit", "limits", "current_a"},
    {"torque_limit", "limits", "torque_nm"},
    {"velocity_limit", "limits", "velocity_rad_s"},
    {"no_torque_drives_above", "limits", "overspeed_rad_s"},
    {"acceleration_limit", "limits", "acceleration_rad_s2"},
    {"fault_overspeed", "faults", "overspeed_rad_s"},
    {"fault_overcurrent", "faults", "overcurrent_a"},
    {"fault_overtemperature", "faults", "overtemperature_c"},
    {"fault_acceleration", "faults", "acceleration_rad_s2"},
    {"fault_stuck_torque", "faults", "stuck_torque_nm", 1.0, Take::unlike_model},
    {"fault_stuck", "faults", "stuck_s", 1.0, Take::unlike_model},
    {"fault_current_mismatch", "faults", "current_mismatch_a"},
    {"fault_mismatch", "faults", "mismatch_s"},
    {"fault_torque_same", "faults", "torque_same_s"},
    {"fault_standstill", "faults", "standstill_rad_s"},
    {"fault_host", "faults", "host_s"},
    {"fault_stop", "faults", "stop_s"},
    {"fault_following_error", "faults", "following_error_rad"},
    {"fault_following_velocity", "faults", "following_velocity_rad_s"},
    {"fault_following", "faults", "following_s"},
    {"fault_output_stuck", "faults", "output_stuck_rad"},
    {"motor_encoder_counts", "motor_encoder", "counts"},
    {"motor_filter_corner", "motor_encoder", "corner_hz"},
    {"output_encoder_counts", "output_encoder", "counts"},
    {"output_filter_corner", "output_encoder", "corner_hz"},
    {"position_gain", "position_loop", "bandwidth_hz", kPerTurn},
    {"velocity_gain", "velocity_loop", "gain_nm_s_rad"},
    {"integral_gain", "velocity_loop", "integral_nm_rad", 1.0, Take::any},  // zero: a loop without an integrator
    {"disturbance_inertia", "motor", "inertia_kg_m2", 1.0, Take::unlike_model},
    {"load_inertia", "load", "inertia_kg_m2", 1.0, Take::unlike_model},
    {"load_stiffness", "load", "stiffness_nm_rad", 1.0, Take::unlike_model},
    {"direction_band", "feedforward", "direction_band_rad_s"},
    {"feedforward_stiffness", "feedforward", "stiffness_nm_rad", 1.0, Take::unlike_model},
    {"torsion_rate_limit", "feedforward", "torsion_rate_limit_rad_s"},
    {"output_zero", "feedforward", "output_zero_turns", 1.0, Take::any},
    {"disturbance_time_constant", "disturbance", "time_constant_s"},
    {"current_sensor_full_scale", "current_sensor", "full_scale_a"},
    {"current_sensor_at_zero", "current_sensor", "at_zero_a", 1.0, Take::any},
    {"current_sensor_lowest_share", "current_sensor", "lowest_share", 1.0, Take::any},
    {"current_sensor_highest_share", "current_sensor", "highest_share", 1.0, Take::any},
    {"torque_sensor_full_scale", "torque_sensor", "full_scale_nm"},
    {"torque_sensor_at_zero", "torque_sensor", "at_zero_nm", 1.0, Take::any},
    {"torque_sensor_lowest_share", "torque_sensor", "lowest_share", 1.0, Take::any},
    {"torque_sensor_highest_share", "torque_sensor", "highest_share", 1.0, Take::any},
    {"ripple_order", "torque_sensor", "ripple_order"},
    {"ripple_memory", "torque_sensor", "ripple_memory_rad"},
    {"ripple_largest", "torque_sensor", "largest_ripple_nm"},
    {"temperature_sensor_full_scale", "temperature_sensor", "full_scale_c"},
    {"temperature_sensor_at_zero", "temperature_sensor", "at_zero_c", 1.0, Take::any},
    {"temperature_sensor_lowest_share", "temperature_sensor", "lowest_share", 1.0, Take::any},
    {"temperature_sensor_highest_share", "temperature_sensor", "highest_share", 1.0, Take::any},
    {"amplifier_full_scale", "amplifier", "full_scale_a"},
    {"residual_map_standstill", "residual_map", "standstill_rad_s"},
    {"residual_map_highest_velocity", "residual_map", "largest_rad_s"},
    {"residual_map_largest", "residual_map", "largest_nm"}};
constexpr std::string_view kTorsionObserver = "torsion_observer_";

const double* find(const Quantities& all, std::string_view name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& q) { return q.name == name; });
  return found == all.end() ? nullptr : &found->value;
}
// Up to the rounding of a block's integers.
bool is_same(double a, double b) {
  return std::abs(a - b) <= 1e-3 * std::max(std::abs(a), std::abs(b));
}

// `usual`: what follows from the block's own model where the text so far is stated; none: not asked yet.
std::string text_of(const Quantities& block, const Quantities* usual) {
  std::vector<std::pair<std::string_view, std::string>> tables;
  for (const Place& place : kPlaces) {
    const double* const value = find(block, place.quantity);
    if (value == nullptr || (place.take != Take::any && !(*value > 0.0))) continue;
    if (place.take == Take::unlike_model) {
      const double* const follows = usual == nullptr ? nullptr : find(*usual, place.quantity);
      if (follows == nullptr || is_same(*value, *follows)) continue;
    }
    auto table = std::find_if(tables.begin(), tables.end(), [&](const auto& t) { return t.first == place.table; });
    if (table == tables.end()) table = tables.insert(tables.end(), {place.table, {}});
    const bool is_count = place.key == "counts";
    table->second += is_count ? fmt::format("{} = {:.0f}\n", place.key, *value)
                              : fmt::format("{} = {:.16e}\n", place.key, *value * place.factor);
  }
  std::string text = "format = \"flexspline-drive/1\"\n";
  for (const auto& [name, lines] : tables) text += fmt::format("[{}]\n{}", name, lines);
  return text;
}

// What a block of the same model with these settings has; none where its own model is not known.
std::optional<Quantities> of_own_model(const deployment::Unpacked& block, const std::string& text) {
  if (!block.model) return {};
  const auto d = deployment::from_block(block.header.bases);
  try {
    const catalogue::ResolvedModel resolved = *block.model;
    const auto setup = deployment::parse_drive_setup(text, "the block's settings", resolved, d);
    return deployment::described(deployment::settings_of(setup, d, "the block's settings"), d);
  } catch (const deployment::PackError&) {
    return {};  // Then all that may follow from a model follows from the new one.
  }
}

}  // namespace

KeptSettings kept_settings(const deployment::Unpacked& block, double most_current_a) {
  if (block.settings.empty())
    throw deployment::PackError(
        "the drive's block has no settings of the drive; state them: flash --settings FILE.toml, as pack --drive takes "
        "them");
  KeptSettings kept;
  Quantities stated = block.settings;
  const auto usual = of_own_model(block, text_of(stated, nullptr));
  if (const auto same = of_own_model(block, text_of(stated, usual ? &*usual : nullptr)))
    for (const NamedQuantity& q : *same)
      if (const double* const is = find(stated, q.name);
          q.name.starts_with(kTorsionObserver) && is != nullptr && !is_same(*is, q.value)) {
        kept.warnings.emplace_back(
            "the active block states noise in [load], which cannot be read from it; the usual noise is taken, or state "
            "it: --settings FILE.toml");
        break;
      }
  if (const double* const excites = find(stated, "excitation"); excites != nullptr && *excites > 0.0)
    kept.warnings.emplace_back(
        "the active block has an [excitation], which cannot be read from it; the new block has none, or state it: "
        "--settings FILE.toml");
  for (NamedQuantity& q : stated)
    if (q.name == "fault_overcurrent" && q.value > most_current_a) {
      kept.overcurrent_lowered_from_a = q.value;
      q.value = most_current_a;
    }
  kept.text = text_of(stated, usual ? &*usual : nullptr);
  return kept;
}

std::vector<std::string> changed_settings(const deployment::Unpacked& before, const deployment::Unpacked& after) {
  std::vector<std::string> changed;
  for (const Place& place : kPlaces) {
    const double* const was = find(before.settings, place.quantity);
    const double* const is = find(after.settings, place.quantity);
    // A lowered overcurrent is said already.
    if (was == nullptr || place.take == Take::unlike_model || place.key == "overcurrent_a") continue;
    if ((place.take == Take::positive && !(*was > 0.0)) || (is != nullptr && is_same(*was, *is))) continue;
    if (is != nullptr && std::abs(*was - *is) < 1e-9) continue;  // a zero that was rounded
    // A model without a spring has no lead that could change.
    if (is == nullptr && place.quantity == "torsion_rate_limit") continue;
    changed.push_back(fmt::format("[{}] {} is {:.4g} in the active block and {} in the new one", place.table, place.key,
                                  *was * place.factor,
                                  is == nullptr ? "not there" : fmt::format("{:.4g}", *is * place.factor)));
  }
  return changed;
}

}  // namespace flexspline::drive
