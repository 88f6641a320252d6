// An image on an emulated Cortex-M4 (Unicorn) whose peripherals are models written from the reference manual, apart
// from the drivers. A model checks what the manual demands of software; what breaks it is a violation, described in
// words.
#pragma once

#include <unicorn/unicorn.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace flexspline::tests {

class Peripheral {
 public:
  virtual ~Peripheral() = default;
  virtual std::uint32_t read(std::uint32_t offset) = 0;
  virtual void write(std::uint32_t offset, std::uint32_t value) = 0;
};

// Registers that hold what was written.
class Registers : public Peripheral {
 public:
  std::uint32_t read(std::uint32_t offset) override { return words[offset]; }
  void write(std::uint32_t offset, std::uint32_t value) override { words[offset] = value; }
  std::uint32_t at(std::uint32_t offset) const {
    const auto found = words.find(offset);
    return found == words.end() ? 0 : found->second;
  }
  std::map<std::uint32_t, std::uint32_t> words;
};

enum class Stop {
  waits,
  reset,
  fault
};  // for an interrupt; asked for a reset; an access or instruction that cannot be

class Machine {
 public:
  // Throws std::runtime_error where the image cannot be read or the emulator does not start.
  explicit Machine(const std::filesystem::path& elf);
  ~Machine();
  Machine(const Machine&) = delete;

  // A peripheral of 1 KB, unless said otherwise.
  void attach(std::uint32_t address, Peripheral& peripheral, std::uint32_t bytes = 0x400);
  // Memory that a model serves, such as flash memory that is written; at pages of 4 KB.
  void attach_memory(std::uint32_t address, std::uint32_t bytes, Peripheral& memory);
  // Flash memory that nobody writes.
  void map_erased(std::uint32_t address, std::uint32_t bytes);
  // Asked before each access to a peripheral: whether its clock is on.
  std::function<bool(std::uint32_t address)> is_clocked;

  // From reset, or on from where it stopped, until it waits for an interrupt.
  Stop run();
  // As an exception of this number of the vector table: 16 and up are interrupts. The handler runs to its end.
  Stop interrupt(std::uint32_t number);
  // The same, but after so many instructions of the handler `other` happens, which may be another interrupt, and it
  // goes on. Instructions have to be counted.
  Stop interrupted_interrupt(std::uint32_t number, std::uint64_t after, const std::function<Stop()>& other);
  bool ticks_itself() const;                                    // SysTick runs, with its interrupt
  bool tick_is_requested() const;                               // PendSV is pending
  std::uint32_t tick_priority() const;                          // its priority; zero is the highest
  std::uint64_t instructions() const { return instructions_; }  // executed while they are counted
  void count_instructions();                                    // from now on, slowly
  std::uint32_t vectors() const { return vectors_; }
  bool interrupt_is_enabled(std::uint32_t number) const;

  std::uint32_t word(std::uint32_t address) const;
  void set_word(std::uint32_t address, std::uint32_t value);
  std::uint32_t reg(int number) const;
  void set_reg(int number, std::uint32_t value);
  std::uint32_t symbol(const std::string& name) const;  // throws where there is none
  void violation(const std::string& what);
  const std::vector<std::string>& violations() const { return violations_; }
  // What stopped it, for a message.
  std::string where() const;

 private:
  struct Window {
    Machine* machine;
    std::uint32_t start;
  };
  static std::uint64_t read_window(uc_engine*, std::uint64_t offset, unsigned size, void* window);
  static void write_window(uc_engine*, std::uint64_t offset, unsigned size, std::uint64_t value, void* window);
  void window(std::uint32_t start, std::uint32_t bytes);
  Peripheral* find(std::uint32_t address, std::uint32_t& offset);
  void load(const std::filesystem::path& elf);
  Stop go(std::uint32_t from, std::uint32_t until);
  Stop handle(std::uint32_t number, const std::function<Stop()>* other);

  uc_engine* uc_ = nullptr;
  std::vector<std::unique_ptr<Window>> windows_;
  struct Place {
    std::uint32_t end;
    Peripheral* peripheral;
  };
  std::map<std::uint32_t, Place> places_;
  std::map<std::string, std::uint32_t> symbols_;
  std::map<std::uint32_t, std::uint32_t> system_;  // of the core: NVIC, SCB
  std::vector<std::string> violations_;
  std::uint32_t vectors_ = 0;
  std::uint64_t instructions_ = 0;
  std::uint64_t pause_at_ = 0;  // zero: nowhere
  bool started_ = false;
  bool wants_reset_ = false;
  uc_err error_ = UC_ERR_OK;
};

}  // namespace flexspline::tests
