// Names of the faults, their reasons (the words of shared/protocol/texts.hpp, which the host uses as well), and within
// how many ticks they are detected. Not part of any image.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/faults.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::firmware {

struct FaultInfo {
  Fault fault = Fault::none;
  std::uint32_t ticks = 0;            // from the first tick with the cause; zero: there is no fixed number
  std::string_view time_parameter{};  // that states the time; empty: fixed ticks, or no time but a level or an angle
  std::string_view name{};
  std::string_view reason{};
};

namespace detail {
constexpr FaultInfo fault_info(Fault fault) {
  const protocol::FaultText text = protocol::fault_text(static_cast<std::uint8_t>(fault));
  const auto ticks = [fault]() -> std::uint32_t {
    switch (fault) {
      case Fault::motor_encoder_stale:
      case Fault::output_encoder_stale:
      case Fault::analog_stale:
        return kStaleTicks;
      case Fault::current_out_of_range:
      case Fault::torque_out_of_range:
      case Fault::temperature_out_of_range:
        return kRangeTicks;
      case Fault::motor_encoder_jump:
      case Fault::overspeed:
      case Fault::tick_overrun:
      case Fault::amplifier_fault:
        return 1;
      case Fault::overcurrent:
        return kOvercurrentTicks;
      case Fault::overtemperature:
        return kHotTicks;
      case Fault::watchdog:
        return kWatchdogTicks;
      default:
        return 0;
    }
  };
  const auto time_parameter = [fault]() -> std::string_view {
    switch (fault) {
      case Fault::motor_encoder_stuck:
        return "stuck_s";
      case Fault::torque_stuck:
        return "torque_same_s";
      case Fault::current_mismatch:
        return "mismatch_s";
      case Fault::host_lost:
      case Fault::set_point_lost:
        return "host_s";
      case Fault::stop_failed:
        return "stop_s";
      case Fault::following_error:
        return "following_s";
      default:
        return {};
    }
  };
  return {fault, ticks(), time_parameter(), text.name, text.reason};
}
}  // namespace detail

inline constexpr std::array<FaultInfo, kFaults> kFaultTable = [] {
  std::array<FaultInfo, kFaults> table{};
  for (std::size_t i = 0; i < kFaults; ++i) table[i] = detail::fault_info(static_cast<Fault>(i));
  return table;
}();
constexpr const FaultInfo& info_of(Fault fault) {
  return kFaultTable[static_cast<std::size_t>(fault)];
}
static_assert(info_of(Fault::stop_failed).name == "stop_failed" && info_of(Fault::overspeed).name == "overspeed" &&
              info_of(Fault::output_encoder_stuck).name == "output_encoder_stuck");

}  // namespace flexspline::firmware
