// Models of what drives a power stage: the converters and the advanced timer of an STM32F405, from RM0090.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>

#include "tests/board/chip_models.hpp"

namespace flexspline::tests {

// RM0090, 13: the injected sequences of three converters, which an edge of TIM1's trigger starts: of the first alone,
// or of two or three at once (13.9). Registers of converter n from 0x100 (n - 1) on.
class ConverterModel : public Registers {
 public:
  ConverterModel(Machine& machine, ClockModel& clock) : machine_(machine), clock_(clock) {}
  std::array<std::uint32_t, 19> inputs{};  // 12 bits each
  // What they are while a later conversion of a sequence samples; nothing: as before.
  std::function<void()> later;

  std::uint32_t read(std::uint32_t offset) override {
    check_clock(offset);
    return words[offset];
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    check_clock(offset);
    if ((offset & 0xFF) != 0x00 || offset >= 0x300) ++set_ups;
    words[offset] = (offset & 0xFF) == 0x00 && offset < 0x300 ? words[offset] & value : value;
  }
  void trigger() {
    const std::uint32_t c2 = at(0x08);
    if ((c2 & 1) == 0 || (c2 >> 16 & 15) != 1 || (c2 >> 20 & 3) != 1 || (at(0x04) & (1U << 8)) == 0) return;
    const std::uint32_t together = at(0x304) & 31, all = together == 0x15 ? 3 : together == 0x05 ? 2 : 1;
    for (std::uint32_t step = 0; step < 4; ++step) {
      if (step == 1 && later) later();
      for (std::uint32_t n = 0; n < all; ++n) convert(n * 0x100, step, n * 0x100 + 0x100 < all * 0x100);
    }
    for (std::uint32_t n = 0; n < all; ++n) words[n * 0x100] |= 1U << 2;
  }
  bool interrupts() const { return (at(0x00) & (1U << 2)) != 0 && (at(0x04) & (1U << 7)) != 0; }
  // Of the first one's sequence, at this clock; the bus's (13.5, 13.3.7).
  double conversion_us(double apb2_hz) const {
    double cycles = 0;
    for (std::uint32_t i = 0; i < conversions(0); ++i) cycles += 12 + kCycles[sample_time(0, input(0, i))];
    return cycles / clock_hz(apb2_hz) * 1e6;
  }
  double sample_us(double apb2_hz) const { return kCycles[sample_time(0, input(0, 0))] / clock_hz(apb2_hz) * 1e6; }
  double clock_hz(double apb2_hz) const { return apb2_hz / (2 * ((at(0x304) >> 16 & 3) + 1)); }
  int set_ups = 0;  // writes of anything but a status

 private:
  static constexpr double kCycles[8] = {3, 15, 28, 56, 84, 112, 144, 480};

  std::uint32_t conversions(std::uint32_t base) const { return (at(base + 0x38) >> 20 & 3) + 1; }
  std::uint32_t input(std::uint32_t base, std::uint32_t step) const {
    return at(base + 0x38) >> (5 * (4 - conversions(base) + step)) & 31;
  }
  std::uint32_t sample_time(std::uint32_t base, std::uint32_t input) const {
    return at(base + (input < 10 ? 0x10 : 0x0C)) >> (3 * (input % 10)) & 7;
  }
  void convert(std::uint32_t base, std::uint32_t step, bool others_follow) {
    if (step >= conversions(base)) return;
    if ((at(base + 0x08) & 1) == 0) return machine_.violation("a converter that is off is to convert with the first");
    if (base != 0 && (at(base + 0x08) >> 20 & 3) != 0)
      machine_.violation("a converter that follows the first has a trigger of its own");
    if (conversions(base) != conversions(0)) machine_.violation("converters with sequences of different lengths");
    if (others_follow && input(base, step) == input(base + 0x100, step))
      machine_.violation("two converters sample one input at once");
    words[base + 0x3C + 4 * step] = inputs.at(input(base, step));
  }
  void check_clock(std::uint32_t offset) {
    const std::uint32_t n = offset >> 8;
    if (n > 0 && n < 3 && (clock_.at(0x44) >> (8 + n) & 1) == 0)
      machine_.violation("an access to a converter whose clock is off");
  }
  Machine& machine_;
  ClockModel& clock_;
};

// RM0090, 17: what time base and outputs are set to. A break input that is low takes MOE away.
class AdvancedTimerModel : public Registers {
 public:
  explicit AdvancedTimerModel(Machine& machine) : machine_(machine) {}
  std::uint32_t read(std::uint32_t offset) override {
    return offset == 0x00 && counts_down ? words[offset] | 1U << 4 : words[offset];
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    if (offset == 0x44 && (at(0x44) >> 8 & 3) >= 1 && ((value ^ at(0x44)) & 0x33FF) != 0)
      machine_.violation("dead time or break is changed after it was locked");
    if (offset == 0x44 && break_input) value &= ~(1U << 15);
    const bool is_set_up = offset != 0x10 && offset != 0x44 && (offset < 0x34 || offset > 0x3C);
    if (is_set_up && (at(0x00) & 1) != 0) ++set_ups_while_it_runs;
    words[offset] = offset == 0x10 ? words[0x10] & (value | (break_input ? kBroken : 0U)) : value;
  }
  // Its fourth compare value, reached while it counts up. True: it asks for an interrupt.
  bool reach_compare4() {
    if ((at(0x00) & 1) == 0 || (at(0x00) >> 5 & 3) != 2 || at(0x40) == 0 || at(0x40) >= at(0x2C)) return false;
    words[0x10] |= 1U << 4;
    return (at(0x0C) & (1U << 4)) != 0;
  }
  // From the trigger of the converter on.
  double compare4_us(double timer_hz) const { return at(0x40) / timer_hz * 1e6; }
  bool break_input = false;
  bool counts_down = false;       // at this moment (CR1, DIR)
  int set_ups_while_it_runs = 0;  // of anything but compare values 1 to 3, a status and the switch of all outputs
  void trip() {
    break_input = true;
    if ((at(0x44) & (1U << 12)) == 0 || (at(0x44) & (1U << 13)) != 0) return;
    words[0x44] &= ~(1U << 15);
    words[0x10] |= kBroken;
  }
  bool outputs_on() const { return (at(0x44) & (1U << 15)) != 0; }
  bool triggers() const { return (at(0x00) & 1) != 0 && (at(0x04) >> 4 & 7) == 2; }
  // Triggers where channel 4 rises, in PWM mode 2 (17.3.9): once a period, while it counts up through compare value 4.
  bool triggers_by_compare4() const {
    return (at(0x00) & 1) != 0 && (at(0x00) >> 5 & 3) != 0 && (at(0x04) >> 4 & 7) == 7 && (at(0x1C) >> 12 & 7) == 7 &&
           at(0x40) > 0 && at(0x40) <= at(0x2C);
  }
  // From the bottom to that edge, and to the top: the middle of the low sides' time.
  double trigger_us(double timer_hz) const { return at(0x40) / timer_hz * 1e6; }
  double top_us(double timer_hz) const { return at(0x2C) / timer_hz * 1e6; }
  double period_us(double timer_hz) const { return 2.0 * at(0x2C) / timer_hz * 1e6; }
  // Updates, which trigger the converter, a second.
  double updates_hz(double timer_hz) const {
    const bool centred = (at(0x00) >> 5 & 3) != 0;
    const double half = timer_hz / (at(0x2C) + (centred ? 0.0 : 1.0));
    return half / (at(0x30) + 1);
  }
  // Share of the supply between the legs.
  double duty() const { return (double(at(0x34)) - double(at(0x3C))) / at(0x2C); }
  // Of the high side of a channel from 1 to 3, in PWM mode 1 with preload, both outputs on.
  double duty_of(std::uint32_t channel) const {
    const std::uint32_t mode = channel == 3 ? at(0x1C) & 0xFF : at(0x18) >> (8 * (channel - 1)) & 0xFF;
    if (mode != 0x68 || (at(0x20) >> (4 * (channel - 1)) & 5) != 5) {
      machine_.violation("a channel is not set up for two switches");
      return 0.0;
    }
    return std::min(1.0, double(at(0x30 + 4 * channel)) / at(0x2C));
  }
  // Level of an output while all are off (table 75: OSSI), in its polarity: true is a switch that is on.
  bool is_on_while_off(std::uint32_t channel, bool complement) const {
    if ((at(0x44) & (1U << 10)) == 0) return false;
    const std::uint32_t shift = 2 * (channel - 1) + (complement ? 1 : 0);
    const bool high = (at(0x04) >> (8 + shift) & 1) != 0;
    const bool inverted = (at(0x20) >> (4 * (channel - 1) + (complement ? 3 : 1)) & 1) != 0;
    return high != inverted;
  }

 private:
  static constexpr std::uint32_t kBroken = 1U << 7;
  Machine& machine_;
};

}  // namespace flexspline::tests
