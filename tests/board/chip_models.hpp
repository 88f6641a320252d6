// Models of the peripherals of an STM32F405, from RM0090: registers, what they do, and what they require.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "tests/board/machine.hpp"

namespace flexspline::tests {

// RM0090, 7: oscillators, PLL and gates. Ready flags come after some looks at them, or never.
class ClockModel : public Registers {
 public:
  explicit ClockModel(Machine& machine) : machine_(machine) {
    words[0x00] = 0x83;
    words[0x04] = 0x24003010;
  }
  bool crystal_is_dead = false, pll_is_dead = false;
  std::uint32_t crystal_hz = 8'000'000, wait_states = 0, reset_flags = 1U << 26;

  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x74) return reset_flags;
    if (offset != 0x00) return words[offset];
    ++looks_;
    std::uint32_t control = words[0] | 2;
    if ((control & (1U << 16)) != 0 && !crystal_is_dead && looks_ - crystal_since_ > 50) control |= 1U << 17;
    if ((control & (1U << 24)) != 0 && !pll_is_dead && input_runs() && looks_ - pll_since_ > 50) control |= 1U << 25;
    return control;
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    const std::uint32_t before = words[offset];
    if (offset == 0x00) {
      if ((value & ~before & (1U << 16)) != 0) crystal_since_ = looks_;
      if ((value & ~before & (1U << 24)) != 0) pll_since_ = looks_;
      if ((before & 1) != 0 && (value & 1) == 0 && (words[0x08] & 3) == 0)
        machine_.violation("HSI off while it is used");
    }
    if (offset == 0x04 && (words[0] & (1U << 24)) != 0) machine_.violation("the PLL is set up while it runs");
    if (offset == 0x74 && (value & (1U << 24)) != 0) reset_flags = 0;
    words[offset] = value;
    if (offset == 0x08) switch_to(value);
  }
  // The core's, and those of the two buses.
  double core_hz() const { return (at(0x08) & 0xC) == 8 ? pll_hz() : 16e6; }
  double apb1_hz() const { return core_hz() / divider(at(0x08) >> 10 & 7); }
  double apb2_hz() const { return core_hz() / divider(at(0x08) >> 13 & 7); }
  // Of a timer on it (7.2): twice the bus, where that is divided.
  double usb_hz() const { return vco_hz() / (at(0x04) >> 24 & 15); }
  bool from_crystal() const { return (at(0x04) >> 22 & 1) != 0; }
  bool gate(std::uint32_t address) const {
    const std::uint32_t at_page = address & ~0x3FFU;
    if (address >= 0x50060800) return (at(0x34) >> 6 & 1) != 0;
    if (address >= 0x50000000) return (at(0x34) >> 7 & 1) != 0;
    if (at_page == 0x40023800 || at_page == 0x40023C00 || at_page == 0x40003000 || address < 0x40000000) return true;
    if (at_page >= 0x40020000) return (at(0x30) >> ((at_page - 0x40020000) >> 10) & 1) != 0;
    if (at_page == 0x40010000) return (at(0x44) & 1) != 0;
    if (at_page == 0x40012000) return (at(0x44) >> 8 & 1) != 0;
    if (at_page == 0x40013000) return (at(0x44) >> 12 & 1) != 0;
    return (at(0x40) >> ((at_page - 0x40000000) >> 10) & 1) != 0;  // timers, USARTs, PWR and DAC lie in order
  }

 private:
  static double divider(std::uint32_t bits) { return bits < 4 ? 1 : 1 << (bits - 3); }
  double vco_hz() const {
    const std::uint32_t p = at(0x04);
    return (from_crystal() ? crystal_hz : 16e6) / (p & 63) * (p >> 6 & 511);
  }
  double pll_hz() const { return vco_hz() / (2 * (at(0x04) >> 16 & 3) + 2); }
  bool input_runs() const { return from_crystal() ? (at(0) & (1U << 16)) != 0 && !crystal_is_dead : true; }
  void switch_to(std::uint32_t value) {
    words[0x08] = (value & ~0xCU) | ((value & 3) << 2);
    if ((value & 3) == 0) return;
    const std::uint32_t p = at(0x04);
    const double input = (from_crystal() ? crystal_hz : 16e6) / (p & 63);
    if ((read(0) & (1U << 25)) == 0) machine_.violation("the core is switched to a PLL that is not locked");
    if (input < 0.95e6 || input > 2.1e6) machine_.violation("the PLL's input is out of range");
    if (vco_hz() < 100e6 || vco_hz() > 432e6) machine_.violation("the PLL's VCO is out of range");
    if (core_hz() > 168e6 || apb1_hz() > 42e6 || apb2_hz() > 84e6) machine_.violation("a clock is too fast");
    if (wait_states < core_hz() / 30e6 - 1) machine_.violation("too few wait states of the flash memory");
  }
  Machine& machine_;
  std::uint32_t looks_ = 0, crystal_since_ = 0, pll_since_ = 0;
};

// A sector of the flash memory, where it begins behind the first that a model serves.
struct FlashSector {
  std::uint32_t number, offset, bytes;
  bool may_be_erased = true;
};

// RM0090, 3: the registers, and sectors that the image writes, one behind the other.
class FlashModel : public Peripheral {
 public:
  FlashModel(Machine& machine, ClockModel& clock, const std::vector<FlashSector>& sectors)
      : machine_(machine), clock_(clock), sectors_(sectors), cells(*this) {
    bytes.assign(sectors.back().offset + sectors.back().bytes, 0xFF);
  }
  std::vector<std::uint8_t> bytes;
  std::uint32_t error = 0;  // what the next operation ends with (SR)
  int erases = 0, programs = 0;
  std::function<void()> erased;  // at the end of each
  // OPTCR, as delivered: no brown-out reset. Read-out protection of level 2 lets nothing be changed.
  std::uint32_t options = 0x0FFFAAED;
  bool options_are_final = false;
  int option_writes = 0;

  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x00) return access_;
    if (offset == 0x0C) {
      if (busy_ > 0 && --busy_ == 0) end();
      return status_ | (busy_ > 0 ? 1U << 16 : 0U);
    }
    return offset == 0x10 ? control_ : offset == 0x14 ? options : 0;
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    if (busy_ > 0) return machine_.violation("a register of a busy flash memory is written");
    switch (offset) {
      case 0x00:
        access_ = value;
        clock_.wait_states = value & 7;
        if ((value & (1U << 12)) != 0 && (value & (1U << 10)) != 0)
          machine_.violation("the data cache is reset while it is on");
        if ((value & (1U << 11)) != 0 && (value & (1U << 9)) != 0)
          machine_.violation("the instruction cache is reset while it is on");
        stale_ &= ~(value >> 11 & 3U);
        return;
      case 0x04:
        if (value == (keys_ == 0 ? 0x45670123U : 0xCDEF89ABU) && keys_ < 2) {
          if (++keys_ == 2) control_ &= ~(1U << 31);
        } else {
          machine_.violation("a wrong key");
        }
        return;
      case 0x08:
        if (value != (option_keys_ == 0 ? 0x08192A3BU : 0x4C5D6E7FU)) machine_.violation("a wrong key of the options");
        if (++option_keys_ == 2 && !options_are_final) options &= ~1U;
        return;
      case 0x14:
        write_options(value);
        return;
      case 0x0C:
        status_ &= ~value;
        return;
      case 0x10:
        if ((control_ & (1U << 31)) != 0)
          return machine_.violation("the control register is written while it is locked");
        control_ = value & ~(1U << 16);
        if ((value & (1U << 31)) != 0) keys_ = 0;
        if ((value & (1U << 16)) != 0) start_erase();
        return;
      default:
        machine_.violation("a register of the flash memory that is not used");
    }
  }
  bool locked() const { return (control_ & (1U << 31)) != 0; }

 private:
  // The memory itself.
  class Cells : public Peripheral {
   public:
    explicit Cells(FlashModel& flash) : flash_(flash) {}
    std::uint32_t read(std::uint32_t offset) override {
      if (flash_.stale_ != 0) flash_.machine_.violation("reads what a stale cache of instructions or data may hold");
      return flash_.word(offset);
    }
    void write(std::uint32_t offset, std::uint32_t value) override { flash_.program(offset, value); }

   private:
    FlashModel& flash_;
  };

  std::uint32_t word(std::uint32_t offset) const {
    std::uint32_t value = 0;
    for (std::uint32_t i = 0; i < 4; ++i) value |= std::uint32_t{bytes[offset + i]} << (8 * i);
    return value;
  }
  // 3.6.2: while OPTLOCK is set nothing changes; OPTSTRT programs what was written.
  void write_options(std::uint32_t value) {
    if ((options & 1) != 0) {
      if (!options_are_final) machine_.violation("the option bytes are written while they are locked");
      return;
    }
    option_keys_ = 0;
    if ((value & 2) != 0) {
      ++option_writes;
      busy_ = 20;
      programs_options_ = true;
    }
    options = value & ~2U;
  }
  void start_erase() {
    if ((control_ & 2) == 0 || (control_ & 1) != 0) return machine_.violation("STRT without SER alone");
    const std::uint32_t number = control_ >> 3 & 15;
    const auto found = std::find_if(sectors_.begin(), sectors_.end(),
                                    [&](const FlashSector& f) { return f.number == number && f.may_be_erased; });
    if (found == sectors_.end()) return machine_.violation("a sector that is not the image's to erase");
    sector_ = *found;
    begin();
    erasing_ = true;
  }
  void program(std::uint32_t offset, std::uint32_t value) {
    if (busy_ > 0) return machine_.violation("a write into a busy flash memory");
    if ((control_ & 1) == 0 || (control_ & (1U << 31)) != 0) return machine_.violation("a write into flash without PG");
    if ((control_ >> 8 & 3) != 2) return machine_.violation("a word is written, but PSIZE is not of a word");
    at_ = offset;
    value_ = value;
    begin();
    erasing_ = false;
  }
  void begin() {
    if ((status_ & 0xF2) != 0) machine_.violation("an operation begins with the errors of the one before");
    busy_ = 20;
  }
  void end() {
    if (programs_options_) {
      programs_options_ = false;
      return;
    }
    stale_ = access_ >> 9 & 3U;
    status_ |= error != 0 ? error : 1;
    if (error != 0) {
      error = 0;
      return;
    }
    if (erasing_) {
      ++erases;
      if (erased) erased();
      std::fill_n(bytes.begin() + sector_.offset, sector_.bytes, std::uint8_t{0xFF});
    } else {
      ++programs;
      for (std::uint32_t i = 0; i < 4; ++i) bytes[at_ + i] &= static_cast<std::uint8_t>(value_ >> (8 * i));
    }
  }

  Machine& machine_;
  ClockModel& clock_;
  std::vector<FlashSector> sectors_;
  FlashSector sector_{};
  std::uint32_t access_ = 0, status_ = 0, control_ = 1U << 31, at_ = 0, value_ = 0;
  int keys_ = 0, busy_ = 0, option_keys_ = 0;
  bool programs_options_ = false;
  std::uint32_t stale_ = 0;  // bit 0 the cache of instructions, bit 1 that of data
  bool erasing_ = false;

 public:
  Cells cells;
};

// RM0090, 18.3.12: a counter that follows two tracks. `moved` counts of the shaft, four to a line.
class EncoderModel : public Registers {
 public:
  explicit EncoderModel(std::uint32_t most = 0xFFFFFFFF) : most_(most) {}
  void move_to(std::uint32_t counts) {
    const std::uint32_t moved = counts - before_;
    before_ = counts;
    const bool encoder = (at(0x08) & 7) == 3 && (at(0x18) & 3) == 1 && (at(0x18) >> 8 & 3) == 1 && (at(0x00) & 1) != 0;
    if (!encoder) return;
    words[0x24] = (words[0x24] + ((at(0x20) & 2) != 0 ? 0 - moved : moved)) & most_ & at(0x2C);
  }
  // 18.3.5: a rising edge at channel 3, when the shaft was so many counts before where it is now.
  void pulse(std::uint32_t counts_ago) {
    if ((at(0x1C) & 3) != 1 || (at(0x20) >> 8 & 11) != 1) return;
    words[0x3C] = (words[0x24] - counts_ago) & most_;
    words[0x10] |= 1U << 3;
  }
  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x3C) words[0x10] &= ~(1U << 3);
    return words[offset];
  }

 private:
  std::uint32_t most_, before_ = 0;
};

// RM0090, 8: BSRR works on ODR.
class PortModel : public Registers {
 public:
  void write(std::uint32_t offset, std::uint32_t value) override {
    if (offset == 0x18) {
      words[0x14] = (words[0x14] & ~(value >> 16)) | (value & 0xFFFF);
    } else {
      words[offset] = value;
    }
  }
  std::uint32_t mode(std::uint32_t pin) const { return at(0x00) >> (2 * pin) & 3; }
  std::uint32_t function(std::uint32_t pin) const { return at(pin < 8 ? 0x20 : 0x24) >> (4 * (pin % 8)) & 15; }
  bool high(std::uint32_t pin) const { return (at(0x14) >> pin & 1) != 0; }
};

// RM0090, 24: a number every few looks, or never.
class RandomModel : public Registers {
 public:
  bool is_dead = false;
  std::uint32_t read(std::uint32_t offset) override {
    if ((at(0x00) & (1U << 2)) == 0 || is_dead) return words[offset];
    if (offset == 0x04) return ++looks_ % 8 == 0 ? 1U : 0U;
    return offset == 0x08 ? number_ = 1664525 * number_ + 1013904223 : words[offset];
  }

 private:
  std::uint32_t looks_ = 0, number_ = 1;
};

// RM0090, 21: counts down by its own oscillator.
class WatchdogModel : public Peripheral {
 public:
  explicit WatchdogModel(Machine& machine) : machine_(machine) {}
  double oscillator_hz = 32'000;
  bool bit = false;
  std::function<void()> started;
  int fed = 0;

  std::uint32_t read(std::uint32_t) override { return 0; }
  void write(std::uint32_t offset, std::uint32_t value) override {
    if (offset == 0x00) {
      if (value == 0xCCCC && !running_ && started) started();
      if (value == 0xCCCC) running_ = true;
      if (value == 0x5555) unlocked_ = true;
      if (value == 0xAAAA) {
        ++fed;
        unlocked_ = false;
      }
      if (value == 0xAAAA || value == 0xCCCC) left_s_ = limit_s();
      return;
    }
    if (!unlocked_) machine_.violation("the watchdog's limit is changed without its key");
    (offset == 0x04 ? prescaler_ : reload_) = value;
  }
  double limit_s() const { return (reload_ + 1.0) * (4 << prescaler_) / oscillator_hz; }
  void pass(double seconds) {
    if (running_ && (left_s_ -= seconds) < 0) bit = true;
  }

 private:
  Machine& machine_;
  bool running_ = false, unlocked_ = false;
  std::uint32_t prescaler_ = 0, reload_ = 0xFFF;
  double left_s_ = 0;
};

// RM0090, 30: bytes both ways, one a call of pass().
class LineModel : public Registers {
 public:
  std::deque<std::uint8_t> to_chip;
  std::vector<std::uint8_t> from_chip;

  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x00) return (came_ ? 1U << 5 : 0U) | 1U << 7;
    if (offset != 0x04) return words[offset];
    came_ = false;
    return byte_;
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    words[offset] = value;
    if (offset == 0x04) from_chip.push_back(static_cast<std::uint8_t>(value));
  }
  void pass() {
    if ((at(0x0C) & 0x2004) != 0x2004 || to_chip.empty()) return;
    byte_ = to_chip.front();
    to_chip.pop_front();
    came_ = true;
  }
  double baud(double bus_hz) const { return bus_hz / at(0x08); }

 private:
  std::uint8_t byte_ = 0;
  bool came_ = false;
};

}  // namespace flexspline::tests
