// A model packed for the drive at hand: its tick rate, the effects of its image, its settings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/drive/session.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::drive {

// Settings as `pack --drive` takes them, and where they come from.
struct SettingsFile {
  std::string text;
  std::string origin;
};

struct ModelBlock {
  Bytes bytes;
  std::vector<std::string> warnings;
};

// The drive's own data, for the packer: tick rate, effects of its image, its board.
deployment::PackOptions pack_options_for(Session& session);

// `active`: the drive's active block, empty where it has none; its settings are taken where `settings` are none.
// `measured`: also where the block's error has no bound that can be proven. Throws deployment::PackError where the
// model cannot be packed for this drive, or is of another gear. The zero and the motor of the drive stay.
ModelBlock model_block(Session& session, const Bytes& active, const model::Model& model,
                       const std::optional<SettingsFile>& settings = {}, bool measured = false);

}  // namespace flexspline::drive
