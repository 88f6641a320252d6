// What the application needs from a board. The application is a template over it: a real board, QEMU's and the software
// board of the desktop run the same sources, and no call is virtual.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>

#include "shared/control/hardware.hpp"

namespace flexspline::firmware {

// One set of samples, taken together at the start of a tick. Each `..._samples` counts the samples of its source: a
// number that does not change says that the values with it are old.
struct Readings {
  std::uint32_t motor_counter = 0;   // of the encoder, wraps; positive with positive current
  std::uint32_t output_counter = 0;  // the same at the output, where there is an encoder
  std::uint16_t motor_samples = 0;
  std::uint16_t output_samples = 0;
  std::uint16_t analog_samples = 0;
  // Shares of full scale, 2^-15.
  std::int16_t current = 0;
  std::int16_t torque = 0;
  std::int16_t temperature = 0;
  // For a motor encoder with an index pulse: the number of pulses, and the counter at the last one.
  std::uint16_t index_passes = 0;
  std::uint32_t index_counter = 0;
};

// For the current controller, until the next tick. Not enabled: both switches of every leg open.
struct Actuation {
  std::int16_t current = 0;  // share of the amplifier's full scale, 2^-15
  bool enabled = false;
};

enum class ResetCause : std::uint8_t {
  power,
  watchdog,
  crash,  // the firmware reset itself after an error
};

template <class B>
concept Board = requires(B board, const Actuation& actuation) {
  { B::kTickHz } -> std::convertible_to<std::uint32_t>;
  { B::kTelemetryWords } -> std::convertible_to<std::uint32_t>;  // a power of two
  // Called at each tick, in this order: samples at the start of the tick, current, and whether the tick took longer
  // than its period.
  { board.read() } -> std::convertible_to<const Readings&>;
  board.actuate(actuation);
  { board.tick_overrun() } -> std::same_as<bool>;
  // Called from background work. The watchdog resets the drive when it is not fed for kWatchdogTicks (faults.hpp). A
  // reset switches the amplifier off.
  board.feed_watchdog();
  { board.reset_cause() } -> std::same_as<ResetCause>;
};

// Whether the amplifier switched itself off while it was commanded on. A board whose amplifier does not report this has
// no such function.
template <Board B>
bool amplifier_tripped_of(B& board) {
  if constexpr (requires { board.amplifier_tripped(); }) {
    return board.amplifier_tripped();
  } else {
    return false;
  }
}

// Why it did, as protocol::StageFault; zero where the board does not say.
template <Board B>
std::int32_t amplifier_fault_of(B& board) {
  if constexpr (requires { board.amplifier_fault(); }) {
    return static_cast<std::int32_t>(board.amplifier_fault());
  } else {
    return 0;
  }
}

// The longest time between two samples of the output's encoder: a tick, unless the board has a slower one.
template <Board B>
constexpr std::uint32_t output_sample_ticks_of() {
  if constexpr (requires { B::kOutputSampleTicks; }) {
    return B::kOutputSampleTicks;
  } else {
    return 1;
  }
}

// What a board states about its hardware (shared/control/hardware.hpp). A board that states nothing has no such
// function.
template <Board B>
constexpr control::Hardware hardware_of(const B& board) {
  if constexpr (requires { board.hardware(); }) {
    return board.hardware();
  } else {
    return {};
  }
}

// Random numbers of the hardware, for background work. A board that has no source of them has no such function, and
// they are zeros: then challenges never repeat, but somebody may know the next one.
using RandomWords = std::array<std::uint32_t, 4>;
template <Board B>
RandomWords random_words_of(B& board) {
  if constexpr (requires { board.random_words(); }) {
    return board.random_words();
  } else {
    return {};
  }
}

// A board's tick rate: kTickHz, except for a board whose rate is set when it starts.
template <Board B>
constexpr std::uint32_t tick_hz_of(const B& board) {
  if constexpr (requires { board.tick_hz; }) {
    return board.tick_hz;
  } else {
    return B::kTickHz;
  }
}

}  // namespace flexspline::firmware
