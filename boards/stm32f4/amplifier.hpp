// The two amplifiers. Both run TIM1, which times the control tick: its trigger starts the converter at the start of
// each period, and its fourth compare value the tick, once the conversions have ended. After a reset, a break or a
// fault the amplifier is not enabled.
//
//   ServoAmplifier  a current controller outside; gets a voltage from the DAC and an enable (RM0090, 14)
//   HBridge         two legs on TIM1's channels 1 and 3, with dead time and a break input (RM0090, 17)
#pragma once

#include <cstdint>

#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/registers.hpp"
#include "firmware/board.hpp"
#include "shared/control/current_loop.hpp"

namespace flexspline::stm32f4 {

namespace tim1 {
inline constexpr std::uint32_t kInterrupt = 27;  // compare
inline constexpr std::uint32_t kControl2 = kTim1 + 0x04, kInterrupts = kTim1 + 0x0C, kStatus = kTim1 + 0x10,
                               kCompare4 = kTim1 + 0x40, kEvent = kTim1 + 0x14, kMode1 = kTim1 + 0x18,
                               kMode2 = kTim1 + 0x1C, kOutputs = kTim1 + 0x20, kReload = kTim1 + 0x2C,
                               kRepeat = kTim1 + 0x30, kCompare1 = kTim1 + 0x34, kCompare3 = kTim1 + 0x3C,
                               kBreak = kTim1 + 0x44;

// Counts up and down, `half_period` cycles each, and triggers the converter at the bottom, once a period.
inline void set_up(std::uint32_t half_period) {
  switch_clock_on(kTim1);
  hardware(kReload) = half_period;
  hardware(kRepeat) = 1;  // an update at every second end: at the bottom only
  hardware(kControl2) = 2U << 4;
  // 7.25 us after the bottom: three conversions take 5.7.
  hardware(kCompare4) = half_period * 29 / 100;
}
inline constexpr std::uint32_t kTickDue = 1U << 4;
inline bool tick_is_due() {
  return (hardware(kStatus) & kTickDue) != 0;
}
inline void take_tick() {
  hardware(kStatus) = ~kTickDue;
}
inline void run() {
  hardware(kEvent) = 1;
  // Compare values take effect at the update; centre-aligned mode 2: they are flagged while it counts up.
  hardware(kTim1) = (1U << 7) | (2U << 5) | 1U;
  hardware(kStatus) = 0;
  hardware(kInterrupts) = kTickDue;
  cortex_m4::enable_interrupt(kInterrupt);
}
}  // namespace tim1

template <const Pin& enable>
class ServoAmplifier {
 public:
  static constexpr bool kClosesLoop = true;  // the current loop is in the amplifier

  void start(std::uint32_t half_period) {
    switch_clock_on(kDac);
    hardware(kDac + kRight1) = kMiddle;
    hardware(kDac) = 1;  // channel 1, buffered: half scale is zero current
    tim1::set_up(half_period);
    tim1::run();
  }
  void actuate(const firmware::Actuation& a, std::int16_t) {
    if (!a.enabled) return off();
    hardware(kDac + kRight1) = (static_cast<std::uint32_t>(a.current + 32768) >> 4) & 0xFFF;
    if (!on_) write(enable, true);
    on_ = true;
  }
  void off() {
    write(enable, false);
    hardware(kDac + kRight1) = kMiddle;
    on_ = false;
  }
  // Writes registers only, as any fault handler may call it.
  static void cut() { write(enable, false); }
  static constexpr bool tripped() { return false; }  // it does not report that

 private:
  static constexpr std::uint32_t kRight1 = 0x08, kMiddle = 2048;
  bool on_ = false;
};

struct BridgeSetup {
  std::uint32_t dead_time_cycles;   // of the core's clock, at most 127
  std::uint32_t most_duty_percent;  // the low switches have to conduct for a while in each period
  control::CurrentLoopSetup loop;
  std::int32_t sensor_over_amplifier_q12;  // full scale of the current's reading over that of the amplifier
};

template <const Pin& enable, const BridgeSetup& setup>
class HBridge {
  static_assert(setup.dead_time_cycles > 0 && setup.dead_time_cycles < 128);

 public:
  void start(std::uint32_t half_period) {
    half_ = half_period;
    tim1::set_up(half_period);
    // PWM mode 1 with preload on channels 1 and 3.
    hardware(tim1::kMode1) = 0x68;
    hardware(tim1::kMode2) = 0x68;
    set_duty(0);
    // Both outputs of each channel, active high.
    hardware(tim1::kOutputs) = 0x505;
    // Dead time; off means driven low, running or not (OSSI, OSSR); a low break input opens all switches and they stay
    // open. Lock level 1: dead time and polarity cannot be changed until the next reset.
    hardware(tim1::kBreak) = setup.dead_time_cycles | (1U << 8) | (1U << 10) | (1U << 11) | kBreakOn;
    tim1::run();
  }
  // `measured`: share of the current sensor's full scale.
  void actuate(const firmware::Actuation& a, std::int16_t measured) {
    if (!a.enabled) return off();
    const std::int32_t flows = (measured * setup.sensor_over_amplifier_q12) >> 12;
    set_duty(loop_.update(setup.loop, a.current, flows));
    if (on_) return;  // after a break it stays off until it was disabled
    on_ = true;
    write(enable, true);
    set_bits(tim1::kBreak, kOutputsOn);
  }
  void off() {
    cut();
    set_duty(0);
    loop_.reset();
    on_ = false;
  }
  static void cut() {
    clear_bits(tim1::kBreak, kOutputsOn);
    write(enable, false);
  }
  // The break input opened the switches (RM0090, 17.3.12): the outputs' bit is off although this code did not clear it.
  bool tripped() const { return on_ && (hardware(tim1::kBreak) & kOutputsOn) == 0; }

 private:
  static constexpr std::uint32_t kBreakOn = 1U << 12, kOutputsOn = 1U << 15;

  // Share of the supply, 2^-15: half of it on each leg, the other way round.
  void set_duty(std::int32_t share) {
    const std::int32_t most = static_cast<std::int32_t>(setup.most_duty_percent) * 32768 / 100;
    const std::int32_t limited = share > most ? most : share < -most ? -most : share;
    const std::int32_t middle = static_cast<std::int32_t>(half_) / 2;
    const std::int32_t apart = (limited * middle) >> 15;
    hardware(tim1::kCompare1) = static_cast<std::uint32_t>(middle + apart);
    hardware(tim1::kCompare3) = static_cast<std::uint32_t>(middle - apart);
  }

  control::CurrentLoop loop_{};
  std::uint32_t half_ = 0;
  bool on_ = false;
};

}  // namespace flexspline::stm32f4
