// Reads a file in a child process, which hands back plain values through a pipe.
#include "host/input/data/contents_guard.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>

#include "host/input/data/hdf5_contents.hpp"
#include "host/input/data/mat5_check.hpp"
#include "host/input/data/mat_contents.hpp"
#include "host/input/data/message_logs.hpp"
#include "host/input/data/numpy_contents.hpp"

// GCC and Clang have different macros for it.
#if defined(__SANITIZE_ADDRESS__)
#define FLEXSPLINE_ADDRESS_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define FLEXSPLINE_ADDRESS_SANITIZER 1
#endif
#endif
#ifndef FLEXSPLINE_ADDRESS_SANITIZER
#define FLEXSPLINE_ADDRESS_SANITIZER 0
#endif

namespace flexspline::data {
namespace {

constexpr char kEndMark = 'E';  // without it the answer was cut short

class Pipe {
 public:
  Pipe() { open_ = ::pipe2(ends_, O_CLOEXEC) == 0; }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close(0);
    close(1);
  }
  bool is_open() const { return open_; }
  int read_end() const { return ends_[0]; }
  int write_end() const { return ends_[1]; }
  void close(std::size_t end) {
    if (ends_[end] >= 0) ::close(ends_[end]);
    ends_[end] = -1;
  }

 private:
  int ends_[2] = {-1, -1};
  bool open_ = false;
};

class Packer {
 public:
  explicit Packer(int file) : file_(file) {}

  void number(std::uint64_t value) { bytes(&value, sizeof value); }
  void text(const std::string& value) {
    number(value.size());
    bytes(value.data(), value.size());
  }
  void bytes(const void* data, std::size_t size) {
    const char* at = static_cast<const char*>(data);
    while (size > 0 && good_) {
      const ssize_t written = ::write(file_, at, size);
      if (written < 0 && errno == EINTR) continue;
      good_ = written > 0;
      if (!good_) return;
      at += written;
      size -= static_cast<std::size_t>(written);
    }
  }
  bool good() const { return good_; }

 private:
  int file_;
  bool good_ = true;
};

// Reads the output of a process that may have failed: every size is checked against the bytes that are there.
class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    take(&value, sizeof value);
    return value;
  }
  // A number of things to come, each of at least `size` bytes.
  std::size_t count(std::size_t size) {
    const std::uint64_t value = number();
    if (value > bytes_.size() / size) good_ = false;
    return good_ ? static_cast<std::size_t>(value) : 0;
  }
  std::string text() {
    std::string value(count(1), '\0');
    take(value.data(), value.size());
    return value;
  }
  void take(void* to, std::size_t size) {
    if (!good_ || size > bytes_.size()) {
      good_ = false;
      return;
    }
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  bool is_whole() const { return good_ && bytes_.size() == 1 && bytes_.front() == kEndMark; }

 private:
  std::string_view bytes_;
  bool good_ = true;
};

bool pack(const FileContents& contents, int file) {
  Packer packer(file);
  packer.number(contents.arrays.size());
  for (const NamedArray& array : contents.arrays) {
    packer.text(array.name);
    packer.number(array.dims.size());
    for (const std::size_t d : array.dims) packer.number(d);
    packer.number(array.values.size());
    packer.bytes(array.values.data(), array.values.size() * sizeof(double));
  }
  packer.number(contents.texts.size());
  for (const NamedText& text : contents.texts) {
    packer.text(text.name);
    packer.text(text.text);
  }
  packer.number(contents.refused.size());
  for (const NotAColumn& refused : contents.refused) {
    packer.text(refused.name);
    packer.text(refused.why);
  }
  packer.number(contents.losses.size());
  for (const std::string& loss : contents.losses) packer.text(loss);
  packer.text(contents.failure);
  packer.bytes(&kEndMark, 1);
  return packer.good();
}

// Columns are taken from an array by its dimensions.
bool fits(const NamedArray& array) {
  std::size_t left = array.values.size();
  for (const std::size_t d : array.dims) {
    if (d == 0 || left % d != 0) return false;
    left /= d;
  }
  return left == 1;
}

bool unpack(std::string_view bytes, FileContents& contents) {
  Unpacker unpacker(bytes);
  // A name and two counts are the least that an array takes, two counts the least of the others.
  contents.arrays.resize(unpacker.count(24));
  for (NamedArray& array : contents.arrays) {
    array.name = unpacker.text();
    array.dims.resize(unpacker.count(8));
    for (std::size_t& d : array.dims) d = unpacker.number();
    array.values.resize(unpacker.count(8));
    unpacker.take(array.values.data(), array.values.size() * sizeof(double));
  }
  contents.texts.resize(unpacker.count(16));
  for (NamedText& text : contents.texts) {
    text.name = unpacker.text();
    text.text = unpacker.text();
  }
  contents.refused.resize(unpacker.count(16));
  for (NotAColumn& refused : contents.refused) {
    refused.name = unpacker.text();
    refused.why = unpacker.text();
  }
  contents.losses.resize(unpacker.count(8));
  for (std::string& loss : contents.losses) loss = unpacker.text();
  contents.failure = unpacker.text();
  return unpacker.is_whole() && std::all_of(contents.arrays.begin(), contents.arrays.end(), fits);
}

void limit_resources(std::uintmax_t file_bytes) {
  const rlim_t seconds = 5 + static_cast<rlim_t>(file_bytes >> 20);  // matio reads some 100 MB a second
  rlimit time{seconds, seconds};
  ::setrlimit(RLIMIT_CPU, &time);
  rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
#if !FLEXSPLINE_ADDRESS_SANITIZER  // which reserves terabytes of addresses
  // deflate makes at most 1032 bytes of one, but signals with any noise are not packed 20 to 1; and as double each byte
  // becomes eight.
  const rlim_t bytes = (rlim_t{4} << 30) + 160 * static_cast<rlim_t>(file_bytes);
  rlimit memory{bytes, bytes};
  ::setrlimit(RLIMIT_AS, &memory);
#endif
}

std::string bytes_of(const std::filesystem::path& path, std::uintmax_t size) {
  std::string bytes(size, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

FileContents read_mat5(const std::filesystem::path& path, std::uintmax_t size) {
  FileContents contents;
  contents.failure = damage_of_mat5(bytes_of(path, size));
  return contents.failure.empty() ? read_mat_unguarded(path) : contents;
}

FileContents read_unguarded(const std::filesystem::path& path, FileFormat format, std::uintmax_t size) {
  switch (format) {
    case FileFormat::mat5:
      return read_mat5(path, size);
    case FileFormat::mat7_3: {
      FileContents contents = read_mat_unguarded(path);
      return contents.arrays.empty() ? read_hdf5_unguarded(path, true) : contents;
    }
    case FileFormat::hdf5:
      return read_hdf5_unguarded(path, false);
    case FileFormat::npz:
      return read_npz(path);
    case FileFormat::npy:
      return read_npy(path);
    case FileFormat::ros1_bag:
      return read_ros1_bag(path);
    case FileFormat::ros2_bag:
      return read_ros2_bag(path);
    case FileFormat::mcap:
      return read_mcap(path);
    case FileFormat::mjlib_log:
      return read_mjlib_log(path);
    default: {
      FileContents contents;
      contents.failure = "is of no format that holds named arrays";
      return contents;
    }
  }
}

[[noreturn]] void be_the_child(const std::filesystem::path& path, FileFormat format, int file) {
  // Libraries print messages about damage; the parent's message is better.
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
  int code = 1;
  try {
    std::error_code error;
    std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error) size = 0;
    limit_resources(size);
    code = pack(read_unguarded(path, format, size), file) ? 0 : 1;
  } catch (...) {  // out of memory: the exit code is enough
  }
  ::_exit(code);
}

}  // namespace

FileContents read_contents(const std::filesystem::path& path, FileFormat format) {
  FileContents contents;
  Pipe pipe;
  const pid_t child = pipe.is_open() ? ::fork() : -1;
  if (child < 0) {
    contents.failure = "cannot be read, as the system gives no process to read it in";
    return contents;
  }
  if (child == 0) be_the_child(path, format, pipe.write_end());
  pipe.close(1);

  std::string bytes;
  std::string block(1 << 20, '\0');
  while (true) {
    const ssize_t got = ::read(pipe.read_end(), block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    bytes.append(block, 0, static_cast<std::size_t>(got));
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || !unpack(bytes, contents)) {
    contents = {};
    contents.failure = "cannot be read: it is damaged, or asks for more memory than there is";
  }
  return contents;
}

}  // namespace flexspline::data
