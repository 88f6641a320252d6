// The effects of a model as a drive runs them.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "host/physics/catalogue/resolved_model.hpp"

namespace flexspline::deployment {

struct DriveEffects {
  std::vector<EffectValues> effects;  // by rising number, as drives read them
  // Of the effects that the image lacks, and that became tables: their names, and by how much a table is off between
  // its points, N m or N.
  struct Folded {
    std::string id;
    double error = 0.0;
  };
  std::vector<Folded> folded;
  std::array<double, 3> folding_error{};  // on each balance, of all tables together
};

// `image`: names of the effects that the firmware has; empty: all. `bases` of the drive, for the range of tables. The
// effects have their values. Throws PackError where one of them runs on no drive.
DriveEffects drive_effects(const catalogue::ResolvedModel& model, std::span<const std::string> image,
                           const effects::DriveConstants<double>& bases);

}  // namespace flexspline::deployment
