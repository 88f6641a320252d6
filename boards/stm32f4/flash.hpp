// Erases sectors and programs words of the chip's flash memory (RM0090, 3.6). The processor runs from the same memory:
// it is stalled until an operation ends, with all its interrupts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/stm32f4/registers.hpp"

namespace flexspline::stm32f4 {

inline constexpr std::uint32_t kFlashStart = 0x08000000;

// The sectors of a bank: four of 16 KB, one of 64 KB, then 128 KB each (RM0090, table 5; RM0390, table 4).
constexpr std::uint32_t sector_address(std::uint32_t number) {
  if (number < 4) return kFlashStart + number * 0x4000;
  return number == 4 ? kFlashStart + 0x10000 : kFlashStart + (number - 4) * 0x20000;
}
constexpr std::uint32_t sector_bytes(std::uint32_t number) {
  return number < 4 ? 0x4000 : number == 4 ? 0x10000 : 0x20000;
}
static_assert(sector_address(4) == 0x08010000 && sector_address(5) == 0x08020000 && sector_address(11) == 0x080E0000);

// `Busy` has flash_works(): called before and after each operation, as the control tick is late then.
template <class Busy>
class Flash {
 public:
  explicit constexpr Flash(Busy& busy) : busy_(busy) {}

  // False: the memory reported an error, or was not ready in time.
  bool erase(std::uint32_t sector) {
    const bool good = run(kErase | (sector << 3), 0, 0, true);
    reset_caches();
    return good;
  }
  // A word at an address that is a multiple of four.
  bool program(std::uint32_t address, std::uint32_t value) {
    const bool good = run(kProgram, address, value, false);
    reset_caches();
    return good;
  }

 private:
  static constexpr std::uint32_t kKey = kFlash + 0x04, kStatus = kFlash + 0x0C, kControl = kFlash + 0x10;
  static constexpr std::uint32_t kBusy = 1U << 16, kErrors = 0xF2, kEnd = 1U << 0;
  static constexpr std::uint32_t kProgram = 1U << 0, kErase = 1U << 1, kWords = 2U << 8, kStart = 1U << 16,
                                 kLock = 1U << 31;
  static constexpr std::uint32_t kCaches = 3U << 9, kCacheResets = 3U << 11;  // of instructions and of data
  // An erase takes 2 s at most (128 KB); reading the register from a memory that is busy takes as long as that anyway.
  static constexpr std::uint32_t kTries = 50'000'000;

  // Both caches hold old contents of the memory, the instruction cache as well where an image was written
  // (RM0090, 3.5.2). A cache can only be reset while it is off.
  static void reset_caches() {
    clear_bits(kFlash, kCaches);
    set_bits(kFlash, kCacheResets);
    clear_bits(kFlash, kCacheResets);
    set_bits(kFlash, kCaches);
  }
  bool run(std::uint32_t what, std::uint32_t address, std::uint32_t value, bool starts) {
    busy_.flash_works();
    if (!wait_for(kStatus, kBusy, 0, kTries)) return false;
    hardware(kStatus) = kErrors | kEnd;  // of earlier operations
    if ((hardware(kControl) & kLock) != 0) {
      hardware(kKey) = 0x45670123;
      hardware(kKey) = 0xCDEF89AB;
    }
    hardware(kControl) = what | kWords;
    if (starts) {
      set_bits(kControl, kStart);
    } else {
      hardware(address) = value;
    }
    asm volatile("dsb" ::: "memory");
    const bool ended = wait_for(kStatus, kBusy, 0, kTries);
    const bool good = (hardware(kStatus) & kErrors) == 0;
    hardware(kControl) = kLock;
    busy_.flash_works();
    return ended && good;
  }

  Busy& busy_;
};

// Two sectors of one size, as the parameter store needs them (shared/storage/flash_port.hpp).
template <class Busy, std::uint32_t first_sector>
class ParameterFlash {
 public:
  static constexpr std::size_t kSectorBytes = sector_bytes(first_sector);
  static_assert(sector_bytes(first_sector + 1) == kSectorBytes);

  explicit constexpr ParameterFlash(Busy& busy) : flash_(busy) {}
  bool erase(std::size_t sector) { return flash_.erase(first_sector + static_cast<std::uint32_t>(sector)); }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    return flash_.program(address_of(sector) + 4 * static_cast<std::uint32_t>(word), value);
  }
  std::span<const std::uint8_t> bytes(std::size_t sector) const {
    return {reinterpret_cast<const std::uint8_t*>(static_cast<std::uintptr_t>(address_of(sector))), kSectorBytes};
  }

 private:
  static constexpr std::uint32_t address_of(std::size_t sector) {
    return sector_address(first_sector + static_cast<std::uint32_t>(sector));
  }
  Flash<Busy> flash_;
};

// The sector of the pairing key (shared/storage/pairing_memory.hpp), the start of one of the memory's: never erased.
template <class Busy, std::uint32_t sector>
class PairingFlash {
 public:
  static constexpr std::size_t kSectorBytes = 0x4000;

  explicit constexpr PairingFlash(Busy& busy) : flash_(busy) {}
  static bool erase(std::size_t) { return false; }
  bool program(std::size_t, std::size_t word, std::uint32_t value) {
    return flash_.program(sector_address(sector) + 4 * static_cast<std::uint32_t>(word), value);
  }
  std::span<const std::uint8_t> bytes(std::size_t) const {
    return {reinterpret_cast<const std::uint8_t*>(static_cast<std::uintptr_t>(sector_address(sector))), kSectorBytes};
  }

 private:
  Flash<Busy> flash_;
};

// Three sectors of one size for images (shared/boot/slots.hpp), each at the start of a sector of the memory, which may
// be longer: the application, the download and the previous application. Then one for the security counter.
template <class Busy, std::size_t size, std::uint32_t application, std::uint32_t download, std::uint32_t old,
          std::uint32_t counter>
class ImageFlash {
 public:
  static constexpr std::size_t kSectorBytes = size;
  static_assert(sector_bytes(application) >= size && sector_bytes(download) >= size && sector_bytes(old) >= size);

  explicit constexpr ImageFlash(Busy& busy) : flash_(busy) {}
  bool erase(std::size_t slot) { return flash_.erase(kNumbers[slot]); }
  bool program(std::size_t slot, std::size_t word, std::uint32_t value) {
    return flash_.program(sector_address(kNumbers[slot]) + 4 * static_cast<std::uint32_t>(word), value);
  }
  std::span<const std::uint8_t> bytes(std::size_t slot) const {
    return {reinterpret_cast<const std::uint8_t*>(static_cast<std::uintptr_t>(sector_address(kNumbers[slot]))),
            slot == 3 ? sector_bytes(counter) : kSectorBytes};
  }

 private:
  static constexpr std::uint32_t kNumbers[4] = {application, download, old, counter};
  Flash<Busy> flash_;
};

}  // namespace flexspline::stm32f4
