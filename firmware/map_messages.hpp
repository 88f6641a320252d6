// The residual map for a host: what its bins mean, and the bins, some a message.
#pragma once

#include <cstdint>

#include "firmware/messages.hpp"
#include "shared/protocol/map_payloads.hpp"

namespace flexspline::firmware {

struct MapMessages {
  // `first` is beyond the map: wrong_value. `busy` where the tick hit a bin at each try to read it.
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
  // `no_parameters` where none give the bins a meaning.
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
