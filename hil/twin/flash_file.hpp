#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "shared/storage/flash_port.hpp"

namespace flexspline::twin {

/// The twin's flash memory: in this process, and, where a file is named, in that file as well, word by word as it is
/// written. So a twin that was killed finds at its next start what a drive would find after a power cut.
class FlashFile {
 public:
  static constexpr std::size_t kSectorBytes = 16384;

  /// An empty path: no file. Throws std::runtime_error where the file cannot be opened or is no such memory.
  explicit FlashFile(const std::filesystem::path& file = {});
  ~FlashFile();
  FlashFile(const FlashFile&) = delete;
  FlashFile& operator=(const FlashFile&) = delete;

  bool erase(std::size_t sector);
  bool program(std::size_t sector, std::size_t word, std::uint32_t value);
  std::span<const std::uint8_t> bytes(std::size_t sector) const { return cells_->at(sector); }

 private:
  bool save(std::size_t sector, std::size_t at, std::size_t count);

  struct alignas(8) Sector : std::array<std::uint8_t, kSectorBytes> {};
  std::unique_ptr<std::array<Sector, storage::kSectors>> cells_;
  int file_ = -1;
};

}  // namespace flexspline::twin
