// Models of two buses with a magnetic encoder on each: SPI (RM0090, 28) with an AS5047, I2C (RM0090, 27) with an
// AS5600. What their manuals and data sheets forbid is a violation.
#pragma once

#include <cstdint>
#include <functional>

#include "tests/board/machine.hpp"

namespace flexspline::tests {

// Frames of 16 bits; each has the answer to the command before.
class AngleSensorOnSpi : public Registers {
 public:
  AngleSensorOnSpi(Machine& machine, std::function<bool()> selected) : machine_(machine), selected_(selected) {}
  std::uint32_t angle = 0;  // 14 bits
  enum class Fault { none, no_magnet, wrong_parity, error_flag, all_ones, all_zeros, bus_hangs } fault = Fault::none;
  bool had_error = false;  // the flag of an error of a frame: until register 0x0001 is read

  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x08) return (came_ ? 1U : 0U) | 2U;
    if (offset != 0x0C) return words[offset];
    came_ = false;
    return data_;
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    words[offset] = value;
    if (offset == 0x0C) exchange(value);
  }
  double clock_hz(double bus_hz) const { return bus_hz / (2U << (at(0x00) >> 3 & 7)); }

 private:
  static bool odd(std::uint32_t x) { return __builtin_parity(x) != 0; }
  void exchange(std::uint32_t command) {
    const std::uint32_t control = at(0x00);
    // On, master, its selection by software, 16 bits; clock low at rest, data at its second edge.
    if ((control & 0x0B47) != 0x0B45) return machine_.violation("a frame that is not as the AS5047 wants it");
    if (!selected_()) return machine_.violation("a frame while the AS5047 is not selected");
    if (odd(command)) machine_.violation("a command to the AS5047 with a wrong parity");
    if (fault == Fault::bus_hangs) return;
    data_ = answer_;
    came_ = true;
    answer_ = of(command & 0x3FFF);
    if ((command & 0x3FFF) == 0x0001) had_error = false;
  }
  std::uint32_t of(std::uint32_t address) const {
    if (fault == Fault::all_ones) return 0xFFFF;
    if (fault == Fault::all_zeros) return 0;
    std::uint32_t value = 0;
    if (address == 0x3FFF) value = angle & 0x3FFF;
    if (address == 0x3FFC) value = fault == Fault::no_magnet ? 0x09FF : 0x0180;
    if (fault == Fault::error_flag || had_error) value |= 1U << 14;
    if (odd(value) != (fault == Fault::wrong_parity)) value |= 1U << 15;
    return value;
  }
  Machine& machine_;
  std::function<bool()> selected_;
  std::uint32_t answer_ = 0, data_ = 0;
  bool came_ = false;
};

// The device's registers 0x0B (status), 0x0C and 0x0D (angle), with an address that counts up. Things happen one at a
// time, each at a look at the status.
class AngleSensorOnI2c : public Registers {
 public:
  explicit AngleSensorOnI2c(Machine& machine) : machine_(machine) {}
  std::uint32_t angle = 0;  // 12 bits
  bool has_magnet = true, answers = true;
  int samples = 0;

  std::uint32_t read(std::uint32_t offset) override {
    if (offset == 0x14) {
      const std::uint32_t seen = status_;
      if (!happens()) return seen;
      return status_;
    }
    if (offset == 0x18) {
      status_ &= ~2U;  // SR1 was read before
      return 0;
    }
    if (offset != 0x10) return words[offset];
    if ((status_ & (1U << 6)) == 0) machine_.violation("the data of the I2C bus are read before they came");
    const std::uint32_t byte = in_data_;
    // What waits in the shift register follows.
    status_ &= ~((1U << 6) | (1U << 2));
    if (shifted_) {
      in_data_ = in_shift_;
      shifted_ = false;
      status_ |= 1U << 6;
    }
    return byte;
  }
  void write(std::uint32_t offset, std::uint32_t value) override {
    if (offset == 0x00) {
      if ((at(0x00) & (3U << 8)) != 0 && (value & (1U << 15)) == 0)
        machine_.violation("the I2C control register is written while a start or a stop is pending");
      if ((value & (1U << 15)) != 0) phase_ = Phase::idle, status_ = 0, shifted_ = false;
      words[offset] = value;
      return;
    }
    words[offset] = value;
    if (offset != 0x10) return;
    if ((status_ & 1) != 0) {
      status_ &= ~1U;
      phase_ = (value & 1) != 0 ? Phase::sent_read_address : Phase::sent_address;
      if (value >> 1 != 0x36) machine_.violation("another device is addressed");
    } else if (phase_ == Phase::addressed) {
      pointer_ = value;
      phase_ = Phase::sent_pointer;
    } else {
      machine_.violation("data of the I2C bus are written out of order");
    }
  }
  double bus_hz(double apb1_hz) const {
    const double pulses = (at(0x1C) & (1U << 14)) != 0 ? 25.0 : 3.0;
    return apb1_hz / (pulses * (at(0x1C) & 0xFFF));
  }

 private:
  enum class Phase { idle, sent_address, addressed, sent_pointer, sent_read_address, receives };
  // At most one thing; false: nothing.
  bool happens() {
    const std::uint32_t control = at(0x00);
    if ((control & 1) == 0) return false;
    if ((control & (1U << 9)) != 0) {
      words[0x00] &= ~(1U << 9);
      phase_ = Phase::idle;
      return true;
    }
    if ((control & (1U << 8)) != 0) {
      words[0x00] &= ~(1U << 8);
      status_ = (status_ & ~4U) | 1U;
      return true;
    }
    switch (phase_) {
      case Phase::sent_address:
      case Phase::sent_read_address:
        if (!answers) {
          status_ |= 1U << 10;
          phase_ = Phase::idle;
          return true;
        }
        status_ |= 2;
        phase_ = phase_ == Phase::sent_address ? Phase::addressed : Phase::receives;
        return true;
      case Phase::sent_pointer:
        status_ |= 4;
        return true;
      case Phase::receives:
        return receive();
      default:
        return false;
    }
  }
  bool receive() {
    if ((status_ & 2) != 0 || shifted_) return false;
    const std::uint32_t byte = next();
    if ((status_ & (1U << 6)) == 0) {
      in_data_ = byte;
      status_ |= 1U << 6;
    } else {
      in_shift_ = byte;
      shifted_ = true;
      status_ |= 4;
    }
    // A byte that is not acknowledged is the last.
    if ((at(0x00) & (1U << 10)) == 0) phase_ = Phase::idle;
    return true;
  }
  std::uint32_t next() {
    const std::uint32_t address = pointer_++;
    if (address == 0x0B) return has_magnet ? 0x20 : 0x10;
    if (address == 0x0C) return angle >> 8 & 15;
    if (address == 0x0D) {
      ++samples;
      return angle & 0xFF;
    }
    return 0;
  }
  Machine& machine_;
  Phase phase_ = Phase::idle;
  std::uint32_t status_ = 0, pointer_ = 0, in_data_ = 0, in_shift_ = 0;
  bool shifted_ = false;
};

}  // namespace flexspline::tests
