// A model as the plant of a twin: what a drive would be of which the model is true.
#pragma once

#include <string>

#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::closed_loop {

// What a drive's sensors and amplifier are, as far as a twin needs it.
struct TwinHardware {
  int motor_counts = 16384;
  int output_counts = 262144;
  double current_limit_a = 0.0;
};
// From the settings in a block. Throws deployment::PackError where it has none.
TwinHardware twin_hardware_of(const deployment::Unpacked& block);

// Text of a plant file ("flexspline-plant/1", hil/plant/README.md). A twin may not know each effect of the catalogue,
// and no user-defined ones: then it refuses the text. Throws std::runtime_error where a value is missing.
std::string plant_text(const model::Model& model, const TwinHardware& hardware);

// Settings of a drive that has the gains of `block` and sensors as a twin's are, for pack --drive.
std::string settings_like(const deployment::Unpacked& block, const TwinHardware& hardware);

}  // namespace flexspline::closed_loop
