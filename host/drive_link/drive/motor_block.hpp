// The motor that a drive keeps in its parameter block (control::MotorSettings).
#pragma once

#include "host/drive_link/drive/session.hpp"
#include "shared/control/motor_settings.hpp"

namespace flexspline::drive {

// Without pole pairs where the block has none. The block has to be valid, or empty.
control::MotorSettings motor_of(const Bytes& block);

// The same block with this motor in place of its own.
Bytes with_motor(const Bytes& block, const control::MotorSettings& motor);

// A new block for a drive gets the motor of the active one, in place of its own, where its motor's encoder has as many
// counts: a motor belongs to the drive, not to the model, nor to a backup of another drive. `active` may be empty.
Bytes keeping_motor(const Bytes& block, const Bytes& active);

}  // namespace flexspline::drive
