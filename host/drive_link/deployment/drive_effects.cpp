#include "host/drive_link/deployment/drive_effects.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/drive_link/deployment/fold.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::deployment {
namespace {

void require_small_enough(const catalogue::ResolvedEffect& e) {
  if (!e.entry->info->host_only || e.effect->type == catalogue::kExpressionEffect) return;
  throw PackError(
      fmt::format("{} does not fit: it is too large for a drive, and has a memory that no table holds; "
                  "replace it by one of {}",
                  e.effect->id, e.entry->info->confused_with));
}

FoldedTable table_of(const catalogue::ResolvedEffect& e, bool image_has_tables,
                     const effects::DriveConstants<double>& constants, const effects::DriveConstants<double>& bases) {
  auto table = image_has_tables ? folded(e, constants, bases) : std::nullopt;
  if (!table)
    throw PackError(
        fmt::format("{} does not fit: the firmware image lacks it, and {}; take it out of the model, or build an "
                    "image with it",
                    e.effect->id,
                    image_has_tables ? "it depends on more than one signal or on what was before, which no table holds"
                                     : "table_effect, which it could be folded into"));
  return *std::move(table);
}

}  // namespace

DriveEffects drive_effects(const catalogue::ResolvedModel& model, std::span<const std::string> image,
                           const effects::DriveConstants<double>& bases) {
  const auto has = [&](std::string_view type) {
    return image.empty() || std::find(image.begin(), image.end(), type) != image.end();
  };
  DriveEffects all;
  for (const catalogue::ResolvedEffect& e : model.effects) {
    require_small_enough(e);
    const std::string& type = e.effect->type;
    if (type == catalogue::kTableEffect && has(type)) {
      all.effects.push_back({table_number(), e.effect->id, catalogue::table_parameters(*e.effect->definition)});
    } else if (type != catalogue::kExpressionEffect && type != catalogue::kTableEffect && has(type)) {
      all.effects.push_back({e.entry->id, e.effect->id, e.values});
    } else {
      const FoldedTable table = table_of(e, has(catalogue::kTableEffect), model.constants, bases);
      all.effects.push_back({table_number(), e.effect->id, table.parameters});
      all.folding_error[static_cast<std::size_t>(table.parameters[1])] += table.error;
      all.folded.push_back({e.effect->id, table.error});
    }
  }
  // The order of those of one kind is the model's.
  std::stable_sort(all.effects.begin(), all.effects.end(),
                   [](const auto& a, const auto& b) { return a.number < b.number; });
  return all;
}

}  // namespace flexspline::deployment
