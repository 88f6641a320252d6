// Payloads of the messages of the residual map (shared/control/residual_map.hpp). Since minor version 1.
#pragma once

#include <array>
#include <cstdint>

#include "shared/control/residual_map.hpp"
#include "shared/protocol/message.hpp"

namespace flexspline::protocol {

inline constexpr std::uint8_t kMinorOfMap = 1;

// Answer to `map_info`: the meaning of the bins. Velocity bins below the middle one are negative velocities.
struct MapInfo {
  bool counts = false;          // the map is running: it counts ticks in which a model's torque is fed forward
  std::uint8_t angle_bins = 0;  // of a turn of the motor
  std::uint32_t version = 0;    // changes with every tick that is counted, and every reset
  std::int64_t scale = 0;       // units of a sum per base of torque, 2^-27
  std::array<std::int32_t, control::ResidualMap::kEdges> edges{};  // of a direction, raw values of velocity, rising
  std::uint8_t edge_count = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(counts), c(angle_bins), c(version), c(scale), c.some(edges, edge_count);
  }
  bool operator==(const MapInfo&) const = default;
};
// Request of `map_bins`: the number of the first, which is velocity bin times `angle_bins` and the angle's bin.
struct MapFirst {
  std::uint16_t first = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(first);
  }
  bool operator==(const MapFirst&) const = default;
};
struct MapBin {
  std::uint16_t count = 0;  // of ticks; halved together with both sums when it is full
  std::int32_t sum = 0;
  std::uint32_t squares = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(count), c(sum), c(squares);
  }
  bool operator==(const MapBin&) const = default;
};
inline constexpr std::size_t kMapBinsAMessage = 5;
struct MapBins {
  std::uint16_t first = 0;
  std::array<MapBin, kMapBinsAMessage> bins{};
  std::uint8_t count = 0;  // fewer at the end
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(first), c.some(bins, count);
  }
  bool operator==(const MapBins&) const = default;
};
// Request of `map_command`, answered as a command is. `reset` empties it, while the drive is not armed; `start` and
// `stop` are taken at any time.
enum class MapAction : std::uint8_t { start, stop, reset };
inline constexpr std::uint32_t kMapActions = 3;
struct MapCommand {
  MapAction action = MapAction::stop;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.within(action, kMapActions);
  }
  bool operator==(const MapCommand&) const = default;
};

}  // namespace flexspline::protocol
