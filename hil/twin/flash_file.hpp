#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "shared/boot/slots.hpp"
#include "shared/storage/flash_port.hpp"

namespace flexspline::twin {

/// Flash memory in this process, and, where a file is named, in that file as well, word by word as it is written. So a
/// killed twin starts again with the memory that a drive has after a power cut.
class FlashMemory {
 public:
  /// An empty path: no file. A file of `older_sectors` is the memory of an older twin and starts anew. Throws
  /// std::runtime_error where the file cannot be opened or is not such a memory.
  FlashMemory(std::size_t sector_bytes, std::size_t sectors, const std::filesystem::path& file,
              std::size_t older_sectors = 0);
  ~FlashMemory();
  FlashMemory(const FlashMemory&) = delete;
  FlashMemory& operator=(const FlashMemory&) = delete;

  bool erase(std::size_t sector);
  bool program(std::size_t sector, std::size_t word, std::uint32_t value);
  std::span<const std::uint8_t> bytes(std::size_t sector) const {
    return std::span(cells_).subspan(sector * sector_bytes_, sector_bytes_);
  }

 private:
  bool save(std::size_t at, std::size_t count);

  std::size_t sector_bytes_;
  std::vector<std::uint8_t> cells_;  ///< the heap's alignment is that of a flash word and more
  int file_ = -1;
};

/// The twin's parameters.
class FlashFile : public FlashMemory {
 public:
  static constexpr std::size_t kSectorBytes = 16'384;
  explicit FlashFile(const std::filesystem::path& file = {}) : FlashMemory(kSectorBytes, storage::kSectors, file) {}
};

/// The sector of its pairing key.
class PairingFile : public FlashMemory {
 public:
  static constexpr std::size_t kSectorBytes = 16'384;
  explicit PairingFile(const std::filesystem::path& file = {}) : FlashMemory(kSectorBytes, 1, file) {}
};

/// Its firmware images, and the security counter, without which older twins had images that were not signed.
class ImageFlash : public FlashMemory {
 public:
  static constexpr std::size_t kSectorBytes = 65'536;
  explicit ImageFlash(const std::filesystem::path& file = {})
      : FlashMemory(kSectorBytes, boot::kImageSectors, file, boot::kSlots) {}
};

}  // namespace flexspline::twin
