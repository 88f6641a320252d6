#include "tests/board/machine.hpp"

#include <elf.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace flexspline::tests {
namespace {

constexpr std::uint32_t kRam = 0x20000000, kRamBytes = 128 * 1024, kFlash = 0x08000000, kFlashBytes = 512 * 1024;
constexpr std::uint32_t kSystemMemory = 0x1FFF7000, kPage = 0x1000, kUniqueId = 0x1FFF7A10;
constexpr std::uint32_t kReturn = kSystemMemory + 0x10;  // where a handler returns to
constexpr std::uint32_t kCore = 0xE000E000, kControlState = 0xD04, kVectorTable = 0xD08, kPriorities3 = 0xD20,
                        kReset = 0xD0C, kInterruptEnable = 0x100;

void check(uc_err error, const char* what) {
  if (error != UC_ERR_OK) throw std::runtime_error(std::string(what) + ": " + uc_strerror(error));
}
std::string hex(std::uint32_t value) {
  std::ostringstream out;
  out << "0x" << std::hex << value;
  return out.str();
}

}  // namespace

Machine::Machine(const std::filesystem::path& elf) {
  check(uc_open(UC_ARCH_ARM, static_cast<uc_mode>(UC_MODE_THUMB | UC_MODE_MCLASS), &uc_),
        "the emulator does not start");
  check(uc_ctl_set_cpu_model(uc_, UC_CPU_ARM_CORTEX_M4), "no Cortex-M4");
  check(uc_mem_map(uc_, kRam, kRamBytes, UC_PROT_READ | UC_PROT_WRITE), "RAM");
  check(uc_mem_map(uc_, kSystemMemory, kPage, UC_PROT_READ | UC_PROT_EXEC), "system memory");
  const std::uint32_t id[3] = {0x11112222, 0xABCD0000, 0x03040506};
  check(uc_mem_write(uc_, kUniqueId, id, sizeof(id)), "the unique number");
  window(0x40000000, 0x30000);
  window(0x50000000, 0x8000);
  window(0x50060000, kPage);
  window(kCore, kPage);
  load(elf);
}

Machine::~Machine() {
  uc_close(uc_);
}

void Machine::load(const std::filesystem::path& elf) {
  std::ifstream in(elf, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  Elf32_Ehdr header{};
  if (bytes.size() < sizeof(header)) throw std::runtime_error(elf.string() + ": no image");
  std::memcpy(&header, bytes.data(), sizeof(header));
  std::uint32_t first = UINT32_MAX, last = 0;
  std::vector<Elf32_Phdr> parts(header.e_phnum);
  std::memcpy(parts.data(), bytes.data() + header.e_phoff, parts.size() * sizeof(Elf32_Phdr));
  for (const Elf32_Phdr& p : parts) {
    if (p.p_type != PT_LOAD || p.p_filesz == 0) continue;
    first = std::min(first, p.p_paddr);
    last = std::max(last, p.p_paddr + p.p_filesz);
  }
  if (first < kFlash || last > kFlash + kFlashBytes)
    throw std::runtime_error(elf.string() + ": is not for flash memory");
  const std::uint32_t start = first / kPage * kPage;
  check(uc_mem_map(uc_, start, (last - start + kPage - 1) / kPage * kPage, UC_PROT_READ | UC_PROT_EXEC), "flash");
  for (const Elf32_Phdr& p : parts)
    if (p.p_type == PT_LOAD && p.p_filesz > 0)
      check(uc_mem_write(uc_, p.p_paddr, bytes.data() + p.p_offset, p.p_filesz), "flash");
  std::vector<Elf32_Shdr> sections(header.e_shnum);
  std::memcpy(sections.data(), bytes.data() + header.e_shoff, sections.size() * sizeof(Elf32_Shdr));
  for (const Elf32_Shdr& s : sections) {
    if (s.sh_type != SHT_SYMTAB) continue;
    const char* names = bytes.data() + sections[s.sh_link].sh_offset;
    for (std::uint32_t at = 0; at + sizeof(Elf32_Sym) <= s.sh_size; at += sizeof(Elf32_Sym)) {
      Elf32_Sym symbol{};
      std::memcpy(&symbol, bytes.data() + s.sh_offset + at, sizeof(symbol));
      symbols_[names + symbol.st_name] = symbol.st_value;
    }
  }
  vectors_ = symbol("vectors");
}

void Machine::window(std::uint32_t start, std::uint32_t bytes) {
  windows_.push_back(std::make_unique<Window>(Window{this, start}));
  check(uc_mmio_map(uc_, start, bytes, read_window, windows_.back().get(), write_window, windows_.back().get()),
        "peripherals");
}
void Machine::attach(std::uint32_t address, Peripheral& peripheral, std::uint32_t bytes) {
  places_[address] = {address + bytes, &peripheral};
}
void Machine::attach_memory(std::uint32_t address, std::uint32_t bytes, Peripheral& memory) {
  places_[address] = {address + bytes, &memory};
  window(address, bytes);
}
void Machine::map_erased(std::uint32_t address, std::uint32_t bytes) {
  const std::vector<std::uint8_t> erased(bytes, 0xFF);
  check(uc_mem_map(uc_, address, bytes, UC_PROT_READ), "erased flash");
  check(uc_mem_write(uc_, address, erased.data(), erased.size()), "erased flash");
}
Peripheral* Machine::find(std::uint32_t address, std::uint32_t& offset) {
  auto next = places_.upper_bound(address);
  if (next == places_.begin()) return nullptr;
  --next;
  if (address >= next->second.end) return nullptr;
  offset = address - next->first;
  if (is_clocked && !is_clocked(next->first)) {
    violation("an access to " + hex(address) + ", whose clock is off");
    return nullptr;
  }
  return next->second.peripheral;
}

std::uint64_t Machine::read_window(uc_engine*, std::uint64_t offset, unsigned size, void* user) {
  auto& window = *static_cast<Window*>(user);
  Machine& m = *window.machine;
  const std::uint32_t address = window.start + static_cast<std::uint32_t>(offset);
  if (window.start == kCore) return m.system_[static_cast<std::uint32_t>(offset)];
  std::uint32_t at = 0;
  Peripheral* p = m.find(address & ~3U, at);
  if (p == nullptr) {
    m.violation("reads " + hex(address) + ", where nothing is");
    return 0;
  }
  const std::uint64_t mask = (std::uint64_t{1} << (8 * size)) - 1;
  return (std::uint64_t{p->read(at)} >> (8 * (address & 3))) & mask;
}
void Machine::write_window(uc_engine* uc, std::uint64_t offset, unsigned size, std::uint64_t value, void* user) {
  auto& window = *static_cast<Window*>(user);
  Machine& m = *window.machine;
  const std::uint32_t address = window.start + static_cast<std::uint32_t>(offset);
  const auto word = static_cast<std::uint32_t>(value);
  if (window.start == kCore) {
    // Of the enables of interrupts zeros do nothing (ARMv7-M, B3.4.4).
    const bool sets_only = offset >= kInterruptEnable && offset < kInterruptEnable + 32;
    std::uint32_t& reg = m.system_[static_cast<std::uint32_t>(offset)];
    reg = sets_only ? reg | word : word;
    if (offset == kVectorTable) m.vectors_ = word;
    if (offset == kReset && word == 0x05FA0004) {
      m.wants_reset_ = true;
      uc_emu_stop(uc);
    }
    return;
  }
  std::uint32_t at = 0;
  Peripheral* p = m.find(address, at);
  if (p == nullptr || size != 4) return m.violation("writes " + std::to_string(size) + " bytes at " + hex(address));
  p->write(at, word);
}

Stop Machine::go(std::uint32_t from, std::uint32_t until) {
  error_ = uc_emu_start(uc_, from | 1, until, 0, 0);
  if (wants_reset_) return Stop::reset;
  return error_ == UC_ERR_OK ? Stop::waits : Stop::fault;
}
Stop Machine::run() {
  if (!started_) {
    started_ = true;
    set_reg(UC_ARM_REG_SP, word(vectors_));
    return go(word(vectors_ + 4), 0xFFFFFFFE);
  }
  return go(reg(UC_ARM_REG_PC), 0xFFFFFFFE);
}
Stop Machine::interrupt(std::uint32_t number) {
  return handle(number, nullptr);
}
Stop Machine::interrupted_interrupt(std::uint32_t number, std::uint64_t after, const std::function<Stop()>& other) {
  pause_at_ = instructions_ + after;
  const Stop stop = handle(number, &other);
  pause_at_ = 0;
  return stop;
}
Stop Machine::handle(std::uint32_t number, const std::function<Stop()>* other) {
  // A handler is a function as any other: the hardware saves what a caller would.
  constexpr int kSaved[] = {UC_ARM_REG_R0,  UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R4,  UC_ARM_REG_R5,
                            UC_ARM_REG_R6,  UC_ARM_REG_R7, UC_ARM_REG_R8, UC_ARM_REG_R9, UC_ARM_REG_R10, UC_ARM_REG_R11,
                            UC_ARM_REG_R12, UC_ARM_REG_SP, UC_ARM_REG_LR, UC_ARM_REG_PC, UC_ARM_REG_XPSR};
  constexpr std::uint32_t kPendSv = 14, kConditional = 0x0600FC00;
  std::uint32_t saved[std::size(kSaved)];
  for (std::size_t i = 0; i < std::size(kSaved); ++i) saved[i] = reg(kSaved[i]);
  // What is left of an IT block is not the handler's.
  set_reg(UC_ARM_REG_XPSR, reg(UC_ARM_REG_XPSR) & ~kConditional);
  set_reg(UC_ARM_REG_SP, (reg(UC_ARM_REG_SP) - 32) & ~7U);
  set_reg(UC_ARM_REG_LR, kReturn | 1);
  if (number == kPendSv) system_[kControlState] = 0;
  Stop stop = go(word(vectors_ + 4 * number), kReturn);
  if (other != nullptr && stop == Stop::waits && reg(UC_ARM_REG_PC) != kReturn) {
    pause_at_ = 0;
    stop = (*other)();
    if (stop == Stop::waits) stop = go(reg(UC_ARM_REG_PC), kReturn);
  }
  if (stop != Stop::waits) return stop;
  for (std::size_t i = 0; i < std::size(kSaved); ++i) set_reg(kSaved[i], saved[i]);
  return stop;
}
bool Machine::ticks_itself() const {
  const auto found = system_.find(0x010);
  return found != system_.end() && (found->second & 3) == 3;
}
bool Machine::tick_is_requested() const {
  const auto found = system_.find(kControlState);
  return found != system_.end() && (found->second >> 28 & 1) != 0;
}
std::uint32_t Machine::tick_priority() const {
  const auto found = system_.find(kPriorities3);
  return found == system_.end() ? 0 : found->second >> 16 & 0xFF;
}
void Machine::count_instructions() {
  const auto count = +[](uc_engine*, std::uint64_t, std::uint32_t, void* user) {
    Machine& m = *static_cast<Machine*>(user);
    // Then the present instruction has not been executed.
    if (m.pause_at_ != 0 && m.instructions_ >= m.pause_at_) {
      uc_emu_stop(m.uc_);
    } else {
      ++m.instructions_;
    }
  };
  uc_hook hook = 0;
  check(uc_hook_add(uc_, &hook, UC_HOOK_CODE, reinterpret_cast<void*>(count), this, 1, 0),
        "instructions cannot be counted");
  // What was translated before does not count.
  for (std::uint32_t at = kFlash; at < kFlash + kFlashBytes; at += 2) uc_ctl_remove_cache(uc_, at, at + 2);
}
bool Machine::interrupt_is_enabled(std::uint32_t number) const {
  const auto found = system_.find(kInterruptEnable + 4 * (number / 32));
  return found != system_.end() && (found->second >> (number % 32) & 1) != 0;
}

std::uint32_t Machine::word(std::uint32_t address) const {
  std::uint32_t value = 0;
  check(uc_mem_read(uc_, address, &value, sizeof(value)), "memory cannot be read");
  return value;
}
void Machine::set_word(std::uint32_t address, std::uint32_t value) {
  check(uc_mem_write(uc_, address, &value, sizeof(value)), "memory cannot be written");
}
std::uint32_t Machine::reg(int number) const {
  std::uint32_t value = 0;
  check(uc_reg_read(uc_, number, &value), "a register cannot be read");
  return value;
}
void Machine::set_reg(int number, std::uint32_t value) {
  check(uc_reg_write(uc_, number, &value), "a register cannot be written");
}
std::uint32_t Machine::symbol(const std::string& name) const {
  const auto found = symbols_.find(name);
  if (found == symbols_.end()) throw std::runtime_error("the image has no symbol " + name);
  return found->second;
}
void Machine::violation(const std::string& what) {
  constexpr std::size_t kMost = 20;
  if (violations_.size() < kMost) violations_.push_back(what + ", at " + hex(reg(UC_ARM_REG_PC)));
}
std::string Machine::where() const {
  return std::string(uc_strerror(error_)) + " at " + hex(reg(UC_ARM_REG_PC));
}

}  // namespace flexspline::tests
