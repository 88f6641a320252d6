// Three half bridges on TIM1's channels 1 to 3 with their complements (RM0090, 17): it counts up and down, the high
// switches are on around the bottom, the low ones around the top. Compare values that are written between top and
// bottom act from the bottom on.
//
// The instant of the samples is the timer's: OC4REF rises while it counts up to compare value 4, which is set once, and
// that edge is TIM1's trigger, which starts the converters (three_phase_analog.hpp). No instruction is between them.
#pragma once

#include <array>
#include <cstdint>

#include "boards/stm32f4/amplifier.hpp"
#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/registers.hpp"
#include "shared/control/foc/transforms.hpp"

namespace flexspline::stm32f4 {

struct ThreePhaseBridgeSetup {
  std::uint32_t dead_time_cycles = 0;         // of the core's clock, at most 127
  std::array<std::uint8_t, 3> legs{1, 2, 3};  // TIM1's channel of the stage's phases a, b, c
  bool low_sides_inverted = false;            // the driver's inputs of the low sides: low is on
  bool has_break_input = false;               // TIM1_BKIN, low opens all switches
  std::uint32_t sample_lead_cycles = 0;       // the trigger comes so long before the middle of the low sides' time
};

// `Driver`: the gate driver besides these signals. It has start(), is_faulty(), clear() and cut().
template <const ThreePhaseBridgeSetup& setup, class Driver>
class ThreePhaseBridge {
  static_assert(setup.dead_time_cycles > 0 && setup.dead_time_cycles < 128);

 public:
  // Off, with all low sides on as the first duty. `half_period`: from top to bottom, cycles.
  void start(std::uint32_t half_period) {
    driver_.start();
    switch_clock_on(kTim1);
    hardware(tim1::kReload) = half_period;
    hardware(tim1::kRepeat) = 0;
    // PWM mode 1 with preload on channels 1 to 3; channel 4 is high from its compare value up to the top and back.
    hardware(tim1::kMode1) = 0x6868;
    hardware(tim1::kMode2) = 0x7068;
    set({});
    hardware(tim1::kCompare4) = half_period - setup.sample_lead_cycles;
    // The trigger is OC4REF; off means all switches open: driven to the level that is off.
    hardware(tim1::kControl2) = (7U << 4) | (setup.low_sides_inverted ? 0x2A00U : 0U);
    hardware(tim1::kOutputs) = setup.low_sides_inverted ? 0xDDDU : 0x555U;
    // As in HBridge.
    hardware(tim1::kBreak) =
        setup.dead_time_cycles | (1U << 8) | (1U << 10) | (1U << 11) | (setup.has_break_input ? kBreakOn : 0U);
    tim1::run();
  }
  void set(const control::foc::Phases& counts) {
    hardware(compare_of(0)) = static_cast<std::uint32_t>(counts.a);
    hardware(compare_of(1)) = static_cast<std::uint32_t>(counts.b);
    hardware(compare_of(2)) = static_cast<std::uint32_t>(counts.c);
  }
  void on() {
    if (on_) return;  // after a break it stays off until it was switched off
    on_ = true;
    set_bits(tim1::kBreak, kOutputsOn);
  }
  void off() {
    clear_bits(tim1::kBreak, kOutputsOn);
    set({});
    on_ = false;
  }
  static void cut() {
    clear_bits(tim1::kBreak, kOutputsOn);
    Driver::cut();
  }
  // The break input was low, or the driver reports a fault.
  bool is_faulty() const {
    if (Driver::is_faulty() || !driver_.is_ready()) return true;
    return setup.has_break_input && (hardware(tim1::kStatus) & kBroken) != 0;
  }
  // While it is off. The flag of a break input that is still low comes back.
  void clear() {
    hardware(tim1::kStatus) = ~kBroken;
    driver_.clear();
  }
  // The bottom has passed: what is written now acts from the top on, in the middle of a sample's period.
  static bool is_late() { return (hardware(kTim1) & kCountsDown) == 0; }

 private:
  static constexpr std::uint32_t kBreakOn = 1U << 12, kOutputsOn = 1U << 15, kBroken = 1U << 7, kCountsDown = 1U << 4;

  static constexpr std::uint32_t compare_of(std::size_t phase) {
    return tim1::kCompare1 + 4U * (setup.legs[phase] - 1U);
  }

  Driver driver_{};
  bool on_ = false;
};

// A driver without anything but its inputs.
class PlainDriver {
 public:
  static void start() {}
  static constexpr bool is_ready() { return true; }
  static constexpr bool is_faulty() { return false; }
  static void clear() {}
  static void cut() {}
};

}  // namespace flexspline::stm32f4
