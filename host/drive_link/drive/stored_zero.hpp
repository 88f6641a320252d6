// The zeros of the shafts that a drive keeps in its parameter block (control::StoredZero).
#pragma once

#include "host/drive_link/drive/session.hpp"
#include "shared/control/drive_parameters.hpp"

namespace flexspline::drive {

// Nothing where the block has none. The block has to be valid, or empty.
control::StoredZero stored_zero_of(const Bytes& block);

// The same block with this zero in place of its own; without counts, with none.
Bytes with_stored_zero(const Bytes& block, const control::StoredZero& zero);

// A new block for a drive keeps the zero of the active one where it has none itself and its encoders have as many
// counts. `active` may be empty.
Bytes keeping_stored_zero(const Bytes& block, const Bytes& active);

// Stores what the drive's encoders show at the zeros that `home` has just set at this position, and sets them again
// where the encoders alone do not give them, because storing restarts the search for the angles. Throws DriveError
// where no encoder has a reading that would hold after the next power-on.
void store_zero(Session& session, std::int64_t position);

}  // namespace flexspline::drive
