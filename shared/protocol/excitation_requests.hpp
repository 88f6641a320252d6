// The requests that send an excitation to a drive, from the coefficients that control::Excitation::derive made on the
// host for the bases of the drive's active block.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/control/excitation.hpp"
#include "shared/fixed/system.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::protocol {

// Calls send(kind, payload) for each request in order, as long as it returns true. Returns whether it always did.
template <class Send>
constexpr bool send_excitation(const control::Excitation::Coefficients<fixed::Fixed>& c, bool is_torque, Send&& send) {
  Excitation e;
  e.shape = c.shape;
  e.is_torque = is_torque;
  e.line_count = c.line_count;
  e.ticks = c.ticks;
  e.fade_ticks = c.fade_ticks;
  e.step = c.step;
  e.step_change = c.step_change;
  e.positive = c.positive.raw;
  e.negative = c.negative.raw;
  e.offset = c.offset.raw;
  e.limit = c.limiter.limit.raw;
  e.rate = c.limiter.rate.raw;
  if (!send(Kind::excitation, e)) return false;
  if (c.guarded) {
    const ExcitationGuard g{c.guard.torque_limit.raw, c.guard.overspeed.raw, c.guard.largest_velocity.raw,
                            c.guard.slope.mantissa, c.guard.slope.exponent};
    if (!send(Kind::excitation_guard, g)) return false;
  }
  for (std::size_t first = 0; first < c.line_count; first += kLinesAMessage) {
    ExcitationLines all;
    all.first = static_cast<std::uint8_t>(first);
    for (std::size_t i = first; i < c.line_count && all.count < kLinesAMessage; ++i) {
      const auto& line = c.lines[i];
      all.lines[all.count++] = {line.harmonic, line.amplitude.exponent, line.amplitude.mantissa, line.phase};
    }
    if (!send(Kind::excitation_lines, all)) return false;
  }
  return send(Kind::excitation_use, Empty{});
}

}  // namespace flexspline::protocol
