// The residual map for a host: the meaning of its bins, and the bins, several per message.
#pragma once

#include <cstdint>

#include "firmware/messages.hpp"
#include "shared/protocol/map_payloads.hpp"

namespace flexspline::firmware {

struct MapMessages {
  // `wrong_value`: `first` is beyond the map. `busy`: the tick wrote the bin at each attempt to read it.
  template <class Application>
  static protocol::Code bins(const Application& application, std::uint16_t first, protocol::MapBins& out) {
    constexpr std::size_t kBins = control::ResidualMap::kVelocityBins * control::ResidualMap::kAngleBins;
    if (first >= kBins) return protocol::Code::wrong_value;
    out.first = first;
    for (std::size_t i = 0; i < protocol::kMapBinsAMessage && first + i < kBins; ++i) {
      MapBin bin;
      if (!application.map_bin(static_cast<std::uint16_t>(first + i), bin)) return protocol::Code::busy;
      out.bins[i] = {bin.count, bin.sum, bin.squares};
      out.count = static_cast<std::uint8_t>(i + 1);
    }
    return protocol::Code::done;
  }
  // `no_parameters`: the bins have no meaning without them.
  template <class Application>
  static protocol::Code info(const Application& application, protocol::MapInfo& out) {
    const control::ResidualMap::Coefficients* c = application.map_coefficients();
    if (c == nullptr) return protocol::Code::no_parameters;
    out.counts = application.status().maps_residual;
    out.angle_bins = control::ResidualMap::kAngleBins;
    out.version = application.map_version();
    out.scale = c->scale;
    out.edges = c->edges;
    out.edge_count = control::ResidualMap::kEdges;
    return protocol::Code::done;
  }
  static constexpr Command::Kind command_of(protocol::MapAction action) {
    switch (action) {
      case protocol::MapAction::start:
        return Command::Kind::start_map;
      case protocol::MapAction::stop:
        return Command::Kind::stop_map;
      case protocol::MapAction::reset:
        return Command::Kind::clear_map;
    }
    return Command::Kind::heartbeat;
  }
};

}  // namespace flexspline::firmware
