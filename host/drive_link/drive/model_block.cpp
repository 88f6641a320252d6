#include "host/drive_link/drive/model_block.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/drive/motor_block.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/drive_link/drive/settings_text.hpp"
#include "host/drive_link/drive/stored_zero.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/drive_model.hpp"

namespace flexspline::drive {
namespace {

// Names of the effects in an image, for the packer to refuse others with their names.
std::vector<std::string> effects_of(const protocol::Effects& effects) {
  std::vector<std::string> names;
  using Every = model::DriveModel<fixed::Fixed, model::EveryEffect>;
  Every{}.for_each([&]<class Effect>(const auto&) {
    if (effects.has(static_cast<std::uint8_t>(Every::number_of<Effect>()))) names.emplace_back(Effect::kInfo.name);
  });
  return names;
}

// A model of another gear would turn the drive by other angles than are commanded.
void require_same_gear(const Bytes& active, const Bytes& block) {
  const auto old = scales_of(active), now = scales_of(block);
  if (!old || !now) return;
  const double before = old->constants.gear_ratio, after = now->constants.gear_ratio;
  if (std::abs(after - before) > 1e-3 * before)
    throw deployment::PackError(
        fmt::format("the model is of a gear of {:g}, the drive's active block of {:g}; take the drive's own "
                    "model, or pack a block and flash it with --block",
                    after, before));
}

}  // namespace

deployment::PackOptions pack_options_for(Session& session) {
  deployment::PackOptions pack;
  pack.tick_hz = session.identity().tick_hz;
  pack.image = effects_of(session.effects());
  pack.hardware = session.hardware();
  return pack;
}

ModelBlock model_block(Session& session, const Bytes& active, const model::Model& model,
                       const std::optional<SettingsFile>& settings, bool measured) {
  ModelBlock made;
  deployment::PackOptions pack = pack_options_for(session);
  pack.measured = measured;
  std::optional<deployment::Unpacked> before;  // whose settings are kept
  if (settings) {
    pack.settings = settings->text;
    pack.settings_origin = settings->origin;
  } else if (!active.empty()) {
    // Signals are limited to two bases where they enter a drive.
    const double most_a = 1.99 * deployment::bases_of(model, 1.0 / pack.tick_hz).current_base;
    before = deployment::unpack(active);
    KeptSettings kept = kept_settings(*before, most_a);
    pack.settings = std::move(kept.text);
    made.warnings = std::move(kept.warnings);
    // Rounding of the block's integers is not reported.
    if (const auto from_a = kept.overcurrent_lowered_from_a; from_a && *from_a > 1.001 * most_a)
      made.warnings.push_back(
          fmt::format("overcurrent is lowered from {:.4g} A to {:.4g} A: with this model's rated current the "
                      "drive measures no more; a higher rated_current_a in [drive] keeps it",
                      *from_a, most_a));
    pack.settings_origin = "the active block's settings";
  } else {
    throw deployment::PackError("the drive has no block to take its settings from; state them: --settings FILE.toml");
  }
  const Bytes packed = deployment::pack(model, pack).bytes;
  require_same_gear(active, packed);
  if (before)
    for (std::string& change : changed_settings(*before, deployment::unpack(packed)))
      made.warnings.push_back(std::move(change));
  made.bytes = keeping_motor(keeping_stored_zero(packed, active), active);
  return made;
}

}  // namespace flexspline::drive
