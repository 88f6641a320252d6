// What a board that runs in lock step with a simulated drive exchanges with it at every tick. Both ends are
// little-endian and align 64-bit words alike, so the structs travel as they are.
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
struct LockStepStart {
  std::uint32_t block_bytes = 0;  // nought: the drive has none
  TelemetrySetup telemetry{};
};

struct LockStepDown {
  Command command{};
  Readings readings{};
  bool has_command = false;
  bool overrun = false;     // this tick counts as too long
  bool reads_frame = true;  // the host takes a frame of telemetry
  bool ends = false;        // there is no tick: the drive is switched off
  std::uint8_t padding[4]{};
};

struct LockStepUp {
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

static_assert(sizeof(LockStepStart) == 20 && sizeof(LockStepDown) == 72 && sizeof(LockStepUp) == 108);
static_assert(std::is_trivially_copyable_v<LockStepStart> && std::is_trivially_copyable_v<LockStepDown> &&
              std::is_trivially_copyable_v<LockStepUp>);

// One tick of an application whose board was given the readings; what a timer's interrupt does on such a board.
// `counted()` is a number that rises with every instruction, where the board has one.
template <class Application, class Counted>
LockStepUp lock_step(Application& application, const LockStepDown& down, Counted&& counted) {
  if (down.has_command) application.submit(down.command);
  LockStepUp up;
  const std::uint32_t before = counted();
  application.tick();
  up.instructions = counted() - before;
  up.status = application.status();
  if (const auto answer = application.answer()) {
    up.answer = *answer;
    up.has_answer = true;
  }
  if (const auto finding = application.block_finding()) {
    up.finding = *finding;
    up.has_finding = true;
  }
  if (down.reads_frame) up.frame_words = static_cast<std::uint8_t>(application.telemetry().read(up.frame).size());
  up.dropped = application.telemetry().dropped();
  return up;
}

}  // namespace flexspline::firmware
