#include "host/common/system/temporary_folder.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace flexspline::system {

TemporaryFolder::TemporaryFolder() {
  std::string path = (std::filesystem::temp_directory_path() / "flexspline-XXXXXX").string();
  if (::mkdtemp(path.data()) == nullptr)
    throw std::runtime_error(
        fmt::format("{}: no temporary folder could be created: {}; check TMPDIR", path, std::strerror(errno)));
  path_ = path;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace flexspline::system
