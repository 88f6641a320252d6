#include "hil/twin/flash_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace flexspline::twin {

FlashMemory::FlashMemory(std::size_t sector_bytes, std::size_t sectors, const std::filesystem::path& file,
                         std::size_t older_sectors)
    : sector_bytes_(sector_bytes), cells_(sector_bytes * sectors, 0xFF) {
  if (file.empty()) return;
  file_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0)
    throw std::runtime_error(file.string() + ": cannot be opened as flash memory: " + std::strerror(errno));
  struct stat info {};
  fstat(file_, &info);
  const auto whole = static_cast<ssize_t>(cells_.size());
  const bool is_older = info.st_size == static_cast<off_t>(sector_bytes * older_sectors);
  const bool good = info.st_size == 0 || is_older
                        ? save(0, cells_.size())
                        : info.st_size == whole && pread(file_, cells_.data(), cells_.size(), 0) == whole;
  if (!good) {
    close(file_);
    throw std::runtime_error(file.string() + ": is not a flash memory of a twin; name a file that does not exist yet");
  }
}

FlashMemory::~FlashMemory() {
  if (file_ >= 0) close(file_);
}

bool FlashMemory::save(std::size_t at, std::size_t count) {
  return file_ < 0 || pwrite(file_, cells_.data() + at, count, static_cast<off_t>(at)) == static_cast<ssize_t>(count);
}

bool FlashMemory::erase(std::size_t sector) {
  const auto begin = cells_.begin() + static_cast<std::ptrdiff_t>(sector * sector_bytes_);
  std::fill(begin, begin + static_cast<std::ptrdiff_t>(sector_bytes_), std::uint8_t{0xFF});
  return save(sector * sector_bytes_, sector_bytes_);
}

bool FlashMemory::program(std::size_t sector, std::size_t word, std::uint32_t value) {
  const std::size_t at = sector * sector_bytes_ + 4 * word;
  for (std::size_t i = 0; i < 4; ++i) cells_[at + i] &= static_cast<std::uint8_t>(value >> (8 * i));
  return save(at, 4);
}

}  // namespace flexspline::twin
