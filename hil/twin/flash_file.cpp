#include "hil/twin/flash_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace flexspline::twin {
namespace {

off_t place(std::size_t sector, std::size_t at) {
  return static_cast<off_t>(sector * FlashFile::kSectorBytes + at);
}

}  // namespace

FlashFile::FlashFile(const std::filesystem::path& file)
    : cells_(std::make_unique<std::array<Sector, storage::kSectors>>()) {
  for (Sector& sector : *cells_) sector.fill(0xFF);
  if (file.empty()) return;
  file_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0)
    throw std::runtime_error(file.string() + ": cannot be opened as flash memory: " + std::strerror(errno));
  struct stat info {};
  fstat(file_, &info);
  const auto whole = place(storage::kSectors, 0);
  for (std::size_t s = 0; s < storage::kSectors; ++s) {
    if (info.st_size == 0 ? !save(s, 0, kSectorBytes)
                          : info.st_size != whole || pread(file_, cells_->at(s).data(), kSectorBytes, place(s, 0)) !=
                                                         static_cast<ssize_t>(kSectorBytes)) {
      close(file_);
      throw std::runtime_error(file.string() + ": is no flash memory of a twin; name a file that is not there yet");
    }
  }
}

FlashFile::~FlashFile() {
  if (file_ >= 0) close(file_);
}

bool FlashFile::save(std::size_t sector, std::size_t at, std::size_t count) {
  return file_ < 0 ||
         pwrite(file_, cells_->at(sector).data() + at, count, place(sector, at)) == static_cast<ssize_t>(count);
}

bool FlashFile::erase(std::size_t sector) {
  cells_->at(sector).fill(0xFF);
  return save(sector, 0, kSectorBytes);
}

bool FlashFile::program(std::size_t sector, std::size_t word, std::uint32_t value) {
  std::uint8_t* at = cells_->at(sector).data() + 4 * word;
  for (std::size_t i = 0; i < 4; ++i) at[i] &= static_cast<std::uint8_t>(value >> (8 * i));
  return save(sector, 4 * word, 4);
}

}  // namespace flexspline::twin
