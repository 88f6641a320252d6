// Messages for invalid blocks. They are in no image of a drive.
#pragma once

#include "shared/model/block.hpp"

namespace flexspline::model {

constexpr const char* text_of(BlockFault fault) {
  switch (fault) {
    case BlockFault::none:
      return "no fault";
    case BlockFault::too_short:
      return "it ends before its header does";
    case BlockFault::too_long:
      return "it is longer than any block may be";
    case BlockFault::wrong_magic:
      return "it does not begin as a parameter block does";
    case BlockFault::unknown_version:
      return "its version is not known here";
    case BlockFault::wrong_length:
      return "its length is not the one that it states";
    case BlockFault::wrong_checksum:
      return "its checksum does not match its bytes";
    case BlockFault::wrong_name:
      return "a name contains invalid characters";
    case BlockFault::wrong_base:
      return "a base is not a positive number";
    case BlockFault::wrong_limit:
      return "a limit is not between zero and two bases";
    case BlockFault::wrong_header:
      return "a field of the header has an invalid value";
    case BlockFault::too_many_entries:
      return "it has more entries than a drive takes";
    case BlockFault::entry_cut_off:
      return "an entry goes beyond the end";
    case BlockFault::entry_of_wrong_length:
      return "an entry is longer or shorter than its coefficients";
    case BlockFault::unknown_entry:
      return "an entry is of another version: pack the model again, and commission a three-phase motor again";
    case BlockFault::missing_effect:
      return "an effect is not in this firmware";
    case BlockFault::too_often:
      return "an effect or a section occurs more often than the drive has places";
    case BlockFault::wrong_coefficient:
      return "a coefficient is outside the bounds of its format";
    case BlockFault::unlike_coefficients:
      return "coefficients of an entry contradict each other";
    case BlockFault::missing_section:
      return "it lacks a section that a drive needs, as a block packed without settings of the drive does";
    case BlockFault::other_tick_rate:
      return "it was made for another tick rate";
    case BlockFault::armed:
      return "parameters cannot change while the drive is armed; disarm it first";
    case BlockFault::unreachable_limit:
      return "a limit of [faults] is beyond what its signal can show, or a time there is too long; pack the block "
             "again, which says which one";
    case BlockFault::other_hardware:
      return "full scales, largest current or sensors in it are not those of this board; pack it again with "
             "--for-drive, which takes them from the drive";
  }
  return "unknown fault";
}

}  // namespace flexspline::model
