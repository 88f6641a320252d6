// What travels between host and drive, as a header for C: numbers and layouts taken from the types that the drive
// itself is built from.
#pragma once

#include <string>

namespace flexspline::interchange {

// C99, no dependency but <stdint.h>: kinds, codes, channels, faults, limits of the protocol; each payload as a packed
// struct and as offsets; header, entries and sections of the parameter block with the places of their fields.
// `made_by` is in its first comment.
std::string protocol_header(const std::string& made_by);

}  // namespace flexspline::interchange
