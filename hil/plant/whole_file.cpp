#include "hil/plant/whole_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>
#include <system_error>

namespace flexspline::plant {

void write_whole(const std::filesystem::path& file, std::string_view text) {
  std::filesystem::path draft = file;
  draft += ".partial";
  {
    std::ofstream out(draft, std::ios::binary | std::ios::trunc);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.close();
    if (!out) {
      std::error_code ignored;
      std::filesystem::remove(draft, ignored);
      throw std::runtime_error(
          fmt::format("{}: cannot be written; check the folder's permissions and free space", file.string()));
    }
  }
  std::error_code failed;
  std::filesystem::rename(draft, file, failed);
  if (failed) {
    std::error_code ignored;
    std::filesystem::remove(draft, ignored);
    throw std::runtime_error(fmt::format("{}: cannot be put in place: {}", file.string(), failed.message()));
  }
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) {
    throw std::runtime_error(fmt::format("{}: the folder could not be created: {}", folder.string(), failed.message()));
  }
}

}  // namespace flexspline::plant
