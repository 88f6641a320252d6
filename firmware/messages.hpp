// Commands, answers and the drive's state, as exchanged between a host and the application. Plain structs; the protocol
// encodes them.
#pragma once

#include <cstdint>

#include "firmware/faults.hpp"
#include "shared/control/residual_map.hpp"
#include "shared/fixed/system.hpp"
#include "shared/protocol/states.hpp"

namespace flexspline::firmware {

using N = fixed::Fixed;

using protocol::is_armed;
using protocol::is_live;
using protocol::Mode;
using protocol::Refusal;
constexpr bool may_be_commanded(Mode mode) {
  return mode >= Mode::current && mode <= Mode::excitation;
}

struct Command {
  using Kind = protocol::CommandKind;
  Kind kind = Kind::heartbeat;
  Mode mode = Mode::boot;
  bool compensate = false;   // feedforward of the model in modes velocity and position; from `arm` on
  bool stream = false;       // mode position: not a target, but the set point of now with its velocity and acceleration
  std::uint16_t number = 0;  // returned with the answer
  N::Angle position{};       // of the motor
  N::Value velocity{};       // set point, or the largest speed on the way to a target (zero: the limit)
  N::Value acceleration{};   // of a stream
  N::Value current{};
};

struct Answer {
  std::uint16_t number = 0;
  Refusal refusal = Refusal::none;
  Mode mode = Mode::boot;  // after the command
};

// The state of the drive at the end of a tick.
struct Status {
  std::uint32_t tick = 0;
  Mode mode = Mode::boot;
  bool has_parameters = false;
  bool maps_residual = false;
  // Whether the motor's angle within its turn is known, and the output's (and with it the motor's number of turns).
  bool knows_turn = false;
  bool knows_output = false;
  std::uint16_t overruns = 0;  // ticks that were too long, in any mode; it wraps
  FaultRecord fault{};         // the present fault, or the last one
};

// A bin of the residual map. Its number (Application::map_bin) is 32 times the velocity bin plus the bin of the motor's
// angle. Sums count in units of the map (shared/control/residual_map.hpp): 511 are the largest residual.
struct MapBin {
  std::uint16_t number = 0;
  std::uint16_t count = 0;  // of ticks; halved together with both sums when it is full
  std::int32_t sum = 0;
  std::uint32_t squares = 0;
};
inline bool read_bin(const control::ResidualMap& map, std::uint16_t number, MapBin& bin) {
  using Map = control::ResidualMap;
  if (number >= Map::kVelocityBins * Map::kAngleBins) return false;
  Map::Bin found;
  if (!map.read(number / Map::kAngleBins, number % Map::kAngleBins, found)) return false;
  bin = {number, static_cast<std::uint16_t>(found.count), found.sum, found.squares};
  return true;
}

}  // namespace flexspline::firmware
