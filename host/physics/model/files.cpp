// Model files on disk.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include "host/physics/model/model.hpp"

namespace flexspline::model {
namespace {

namespace fs = std::filesystem;

// The system's message, and what to do about it.
std::string reason(int error) {
  const std::string said = std::strerror(error);
  switch (error) {
    case ENOENT:
      return said + "; create the folder first";
    case EACCES:
    case EPERM:
    case EROFS:
      return said + "; write to a folder that is yours";
    case ENOTDIR:
      return said + "; a part of the path is a file";
    case ENOSPC:
    case EDQUOT:
      return said + "; free some space";
    default:
      return said;
  }
}

// A temporary file in the same folder. It is deleted unless it replaced the real one.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& target) : target_(target), path_(target.string() + ".XXXXXX") {
    descriptor_ = ::mkstemp(path_.data());
    if (descriptor_ < 0) fail();
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!renamed_) ::unlink(path_.c_str());
  }

  void write(const std::string& text) {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t count = ::write(descriptor_, text.data() + done, text.size() - done);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail();
      done += static_cast<std::size_t>(count);
    }
    // As a file has that is made in the ordinary way, or as the one has that is replaced.
    struct stat before {};
    mode_t mode = 0666;
    if (::stat(target_.c_str(), &before) == 0) {
      mode = before.st_mode & 07777U;
    } else {
      const mode_t mask = ::umask(0);
      ::umask(mask);
      mode &= ~mask;
    }
    if (::fchmod(descriptor_, mode) != 0 || ::fsync(descriptor_) != 0) fail();
  }

  void take_place() {
    if (::rename(path_.c_str(), target_.c_str()) != 0) fail();
    renamed_ = true;
  }

 private:
  [[noreturn]] void fail() const {
    throw ModelError(fmt::format("{}: the file cannot be written: {}", target_.string(), reason(errno)));
  }

  fs::path target_;
  std::string path_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

}  // namespace

ModelFile read(const fs::path& path, const KnownEffects& known) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status))
    throw ModelError(fmt::format("{}: there is no such model file; check the path", path.string()));
  if (fs::is_directory(status))
    throw ModelError(fmt::format("{}: this is a folder; name the model file in it", path.string()));
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw ModelError(fmt::format("{}: the model file cannot be read; check its permissions", path.string()));
  std::ostringstream text;
  if (stream.peek() != std::ifstream::traits_type::eof()) text << stream.rdbuf();
  if (stream.bad()) throw ModelError(fmt::format("{}: the model file cannot be read to its end", path.string()));
  return parse(std::move(text).str(), path.string(), known);
}

void save(const fs::path& path, const std::string& text) {
  std::error_code error;
  if (path.empty()) throw ModelError("the model file to write has no name; name a file");
  if (fs::is_directory(path, error))
    throw ModelError(fmt::format("{}: the file cannot be written: this is a folder; name a file in it", path.string()));
  // A link stays a link, the file that it points to is replaced.
  fs::path target = path;
  if (fs::is_symlink(path, error)) {
    const fs::path resolved = fs::weakly_canonical(path, error);
    if (!error) target = resolved;
  }
  TemporaryFile file(target);
  file.write(text);
  file.take_place();
}

}  // namespace flexspline::model
