// A DRV8301 on an SPI bus (its data sheet, SLOS719; RM0090, 28): control registers that its enable keeps, a latched
// fault, and what its frames demand.
#pragma once

#include <cstdint>
#include <functional>

#include "tests/board/machine.hpp"

namespace flexspline::tests {

class GateDriverModel : public Registers {
 public:
  GateDriverModel(Machine& machine, std::function<bool()> selected, std::function<bool()> enabled)
      : machine_(machine), selected_(selected), enabled_(enabled) {}
  bool is_absent = false, forgets = false;
  bool overcurrent = false;  // it flows now
  std::uint32_t control(std::uint32_t number) const { return held_[number]; }
  // Its fault output is high, and its switches follow their inputs.
  bool is_good() {
    if (!enabled_()) return false;
    if (overcurrent) latched_ = true;
    return !latched_;
  }
  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x08) return (came_ ? 1U : 0U) | 2U;
    if (offset != 0x0C) return words[offset];
    came_ = false;
    return data_;
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    words[offset] = value;
    if (offset == 0x0C) exchange(value & 0xFFFF);
  }
  double clock_hz(double bus_hz) const { return bus_hz / (2U << (at(0x00) >> 3 & 7)); }

 private:
  void exchange(std::uint32_t frame) {
    // On, master, its selection by software, 16 bits; clock low at rest, data at its second edge.
    if ((at(0x00) & 0x0B47) != 0x0B45) return machine_.violation("a frame that is not as the DRV8301 wants it");
    if (!selected_()) return machine_.violation("a frame while the DRV8301 is not selected");
    came_ = true;
    data_ = is_absent ? 0xFFFF : answer_;
    if (!enabled_()) {
      held_[0] = held_[1] = 0;
      return machine_.violation("a frame to a DRV8301 that is not enabled");
    }
    const std::uint32_t address = frame >> 11 & 15;
    if ((frame & 0x8000) != 0) {
      const std::uint32_t value = address == 2 || address == 3 ? held_[address - 2] : latched_ ? 0x400U : 0U;
      answer_ = (address << 11) | value;
      return;
    }
    if (address != 2 && address != 3) return machine_.violation("a status of the DRV8301 is written");
    answer_ = 0;
    if (address == 2 && (frame & 4) != 0) latched_ = overcurrent;
    // The bit of the reset goes back by itself.
    if (!forgets) held_[address - 2] = frame & (address == 2 ? 0x7FBU : 0x7FFU);
  }
  Machine& machine_;
  std::function<bool()> selected_, enabled_;
  std::uint32_t held_[2]{};
  std::uint32_t answer_ = 0, data_ = 0;
  bool came_ = false, latched_ = false;
};

}  // namespace flexspline::tests
