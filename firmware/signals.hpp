// All signals of a tick in one struct, from which telemetry copies the channels that a host subscribed to.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "firmware/control.hpp"
#include "firmware/telemetry.hpp"

namespace flexspline::firmware {

struct Signals {
  std::uint32_t state = 0;  // as Channel::state
  std::uint32_t motor_counter = 0;
  Estimate estimate{};
  Output output{};

  // The offset of a channel's word in the signals, in bytes.
  struct Places {
    static constexpr std::uint8_t of(Channel channel) { return kOf[static_cast<std::size_t>(channel)]; }

   private:
    static const std::array<std::uint8_t, kChannels> kOf;
  };
};

// The upper word of an angle, its whole turns, follows the lower one.
static_assert(std::endian::native == std::endian::little);
inline constexpr std::array<std::uint8_t, kChannels> Signals::Places::kOf = {
    offsetof(Signals, state),
    offsetof(Signals, motor_counter),
    offsetof(Signals, estimate) + offsetof(Estimate, angle) + 4,
    offsetof(Signals, estimate) + offsetof(Estimate, angle),
    offsetof(Signals, estimate) + offsetof(Estimate, output_angle) + 4,
    offsetof(Signals, estimate) + offsetof(Estimate, output_angle),
    offsetof(Signals, estimate) + offsetof(Estimate, velocity),
    offsetof(Signals, estimate) + offsetof(Estimate, acceleration),
    offsetof(Signals, estimate) + offsetof(Estimate, output_velocity),
    offsetof(Signals, estimate) + offsetof(Estimate, torque),
    offsetof(Signals, estimate) + offsetof(Estimate, current),
    offsetof(Signals, estimate) + offsetof(Estimate, temperature),
    offsetof(Signals, estimate) + offsetof(Estimate, disturbance),
    offsetof(Signals, estimate) + offsetof(Estimate, torsion),
    offsetof(Signals, output) + offsetof(Output, position) + 4,
    offsetof(Signals, output) + offsetof(Output, position),
    offsetof(Signals, output) + offsetof(Output, velocity),
    offsetof(Signals, output) + offsetof(Output, acceleration),
    offsetof(Signals, output) + offsetof(Output, feedforward),
    offsetof(Signals, output) + offsetof(Output, torque),
    offsetof(Signals, output) + offsetof(Output, current),
};

}  // namespace flexspline::firmware
