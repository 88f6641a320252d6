// What a board in co-simulation exchanges with the simulated drive at every tick. Both ends are little-endian and have
// the same alignment of 64-bit words, so the structs are sent as they are.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "firmware/board.hpp"
#include "firmware/messages.hpp"
#include "firmware/parameter_block.hpp"
#include "firmware/telemetry.hpp"

namespace flexspline::firmware {

// Once, before the first tick; the parameter block follows it.
struct CoSimulationStart {
  std::uint32_t block_bytes = 0;  // zero: the drive has none
  TelemetrySetup telemetry{};
};

struct CoSimulationInput {
  Command command{};
  Readings readings{};
  bool has_command = false;
  bool overrun = false;     // this tick counts as an overrun
  bool reads_frame = true;  // the host takes a frame of telemetry
  bool ends = false;        // no tick follows: the drive is switched off
  std::uint8_t padding[4]{};
};

struct CoSimulationOutput {
  Status status{};
  Actuation actuation{};
  Answer answer{};
  bool has_answer = false;
  bool has_finding = false;
  BlockFinding finding = BlockFinding::none;
  std::uint8_t frame_words = 0;
  std::uint32_t dropped = 0;
  std::uint32_t instructions = 0;  // of the control tick, where the board can count them
  std::uint32_t stack_bytes = 0;   // used so far; in the last one, when it is switched off
  std::array<std::uint32_t, TelemetrySetup::kMost + 2> frame{};
};

static_assert(sizeof(CoSimulationStart) == 20 && sizeof(CoSimulationInput) == 72 && sizeof(CoSimulationOutput) == 108);
static_assert(std::is_trivially_copyable_v<CoSimulationStart> && std::is_trivially_copyable_v<CoSimulationInput> &&
              std::is_trivially_copyable_v<CoSimulationOutput>);

// One tick of an application whose board has the readings; on such a board the timer's interrupt calls it.
// `counted()` is a number that rises with every instruction, where the board has one.
template <class Application, class Counted>
CoSimulationOutput co_simulate(Application& application, const CoSimulationInput& input, Counted&& counted) {
  if (input.has_command) application.submit(input.command);
  CoSimulationOutput output;
  const std::uint32_t before = counted();
  application.tick();
  output.instructions = counted() - before;
  output.status = application.status();
  if (const auto answer = application.answer()) {
    output.answer = *answer;
    output.has_answer = true;
  }
  if (const auto finding = application.block_finding()) {
    output.finding = *finding;
    output.has_finding = true;
  }
  if (input.reads_frame)
    output.frame_words = static_cast<std::uint8_t>(application.telemetry().read(output.frame).size());
  output.dropped = application.telemetry().dropped();
  return output;
}

}  // namespace flexspline::firmware
