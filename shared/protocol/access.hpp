// What a request may change. While the parameters are locked by a pairing key, a drive refuses all that write.
#pragma once

#include <cstdint>

#include "shared/protocol/message.hpp"

namespace flexspline::protocol {

enum class Access : std::uint8_t {
  reads,
  operates,  // motion within the limits of the parameters, angles and telemetry: lost when the power goes
  writes,    // parameters, what is stored, and what the drive has learnt
};

// Without a default: a new kind does not compile before it is here. A number that is no kind is served nowhere.
constexpr Access access_of(Kind kind) {
  switch (kind) {
    case Kind::identify:
    case Kind::status:
    case Kind::effects:
    case Kind::hardware:
    case Kind::reference:
    case Kind::block_read:
    case Kind::map_info:
    case Kind::map_bins:
    case Kind::pairing:
    case Kind::commissioning_stage:
    case Kind::commissioning_state:
    case Kind::commissioning_result:
    case Kind::telemetry_frames:
      return Access::reads;
    // A challenge and its answer change who may write, by the key alone.
    case Kind::pairing_challenge:
    case Kind::pairing_part:
    case Kind::pairing_answer:
    case Kind::pairing_lock:
    case Kind::home:
    case Kind::command:
    case Kind::excitation:
    case Kind::excitation_guard:
    case Kind::excitation_lines:
    case Kind::excitation_use:
    case Kind::telemetry:
    case Kind::commissioning_stop:
      return Access::operates;
    case Kind::block_begin:
    case Kind::block_chunk:
    case Kind::block_commit:
    case Kind::block_restore:
    case Kind::block_erase_all:
    case Kind::map_command:
    case Kind::pairing_remove:
    // It moves the motor by limits of its request, and what it finds is for the parameters.
    case Kind::commissioning_begin:
      return Access::writes;
  }
  return Access::reads;
}

}  // namespace flexspline::protocol
