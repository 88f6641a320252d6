// Loops, limits, sensors, feedforward and observers of a drive: what a TOML file states, and for all else what follows
// from the model and its ratings. README.md has the keys.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/resolved_model.hpp"
#include "shared/control/drive_parameters_setup.hpp"
#include "shared/control/hardware.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::deployment {

inline constexpr std::string_view kDriveFormat = "flexspline-drive/1";

// Reads the settings of a drive with this model, in bases of `d`, whose time base is the tick. `origin` names the text
// in errors. `encoder_counts` of the motor, where they are known from another source. What the board states
// (`hardware`) is the default. Throws PackError with file, line, table and key: what is no setting, is of another type
// or outside its bounds, is missing and follows from nothing, or contradicts another or the board.
control::DriveSetup<double> parse_drive_setup(const std::string& toml, const std::string& origin,
                                              const catalogue::ResolvedModel& model,
                                              const effects::DriveConstants<double>& d,
                                              std::optional<double> encoder_counts = {},
                                              const control::Hardware& hardware = {});

// The settings as a drive computes with them. Throws PackError where numbers do not fit.
control::DriveSettings<fixed::Fixed> settings_of(const control::DriveSetup<double>& setup,
                                                 const effects::DriveConstants<double>& d, const std::string& origin);

// The settings of a block, in SI.
struct NamedQuantity {
  std::string name;
  double value = 0.0;
  std::string unit;
};
std::vector<NamedQuantity> described(const control::DriveSettings<fixed::Fixed>& settings,
                                     const effects::DriveConstants<double>& d);

}  // namespace flexspline::deployment
