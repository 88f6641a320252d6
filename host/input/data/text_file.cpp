#include "host/input/data/text_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>

namespace flexspline::data {
namespace {

constexpr std::size_t kHead = 65536;  // by which a binary file is known
constexpr std::size_t kChunk = std::size_t{1} << 20;
// gzip packs text 3 to 20 to 1; beyond this a file is an attack on the memory.
constexpr std::size_t kMostInflation = 200;

// gzread reads files that are not compressed as they are.
class Stream {
 public:
  explicit Stream(const std::filesystem::path& path) : file_(::gzopen(path.c_str(), "rbe")) {
    if (file_ != nullptr) ::gzbuffer(file_, 1U << 18);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() {
    if (file_ != nullptr) ::gzclose(file_);
  }
  bool is_open() const { return file_ != nullptr; }
  // Appends up to `size` bytes; how many, or a negative number where the file is damaged.
  long take(std::string& text, std::size_t size) {
    const std::size_t before = text.size();
    text.resize(before + size);
    const int got = ::gzread(file_, text.data() + before, static_cast<unsigned>(size));
    text.resize(before + static_cast<std::size_t>(std::max(got, 0)));
    int state = Z_OK;
    ::gzerror(file_, &state);
    return state == Z_OK || state == Z_STREAM_END ? got : -1;
  }

 private:
  gzFile file_;
};

void refuse_binary(const std::string& file, const std::string& head, Findings& findings) {
  if (head.starts_with("\xFF\xFE") || head.starts_with("\xFE\xFF"))
    findings.fail("format", file, 0, "the file is UTF-16 text", "save it as CSV in UTF-8");
  if (std::memchr(head.data(), '\0', head.size()) != nullptr)
    findings.fail("format", file, 0, "this is a binary file of a format that is not read",
                  "export the measurement as CSV or MAT; flexspline new --help lists what is read");
}

}  // namespace

bool is_gzip(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  char head[2] = {};
  return file.read(head, 2) && head[0] == '\x1F' && head[1] == '\x8B';
}

std::string read_text(const std::filesystem::path& path, Findings& findings) {
  const std::string file = path.string();
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  Stream stream(path);
  if (error || !stream.is_open())
    findings.fail("file", file, 0, "cannot read this file", "check the path and the permissions");
  const bool packed = is_gzip(path);

  std::string text;
  long got = stream.take(text, kHead);
  refuse_binary(file, text, findings);
  // One more, so that the end is found without another block. What takes far less room on the disk is sparse.
  struct stat state {};
  const bool whole =
      ::stat(path.c_str(), &state) == 0 && static_cast<std::uintmax_t>(state.st_blocks) * 512 >= size / 2;
  if (!packed && whole) text.reserve(size + 1);
  while (got > 0) {
    const std::size_t before = text.size();
    got = stream.take(text, packed ? kChunk : std::min<std::size_t>(kChunk, size > before ? size - before : 1));
    const std::string_view block = std::string_view(text).substr(before);
    if (block.size() >= 4096 && block.find_first_not_of('\0') == std::string_view::npos)
      findings.fail("format", file, 0, fmt::format("the file holds no text from byte {} on, only zeros", before),
                    "it was not written to its end: copy it again, or cut it there");
    if (packed && text.size() > kMostInflation * size + kHead)
      findings.fail("format", file, 0, "the compressed file is far longer than any recording when it is unpacked",
                    "unpack it yourself");
  }
  if (got < 0)
    findings.fail("format", file, 0, "the compressed file is damaged or cut short",
                  "copy it again, or unpack it yourself");
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    findings.fail("header", file, 0, "the file is empty", "record again, or leave the file out");
  return text;
}

bool is_utf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const auto first = static_cast<unsigned char>(text[at]);
    const std::size_t more = first < 0x80                    ? 0
                             : first >= 0xC2 && first < 0xE0 ? 1
                             : (first & 0xF0U) == 0xE0       ? 2
                             : first >= 0xF0 && first < 0xF5 ? 3
                                                             : text.size();
    if (more >= text.size() - at) return false;
    for (std::size_t i = 1; i <= more; ++i)
      if ((static_cast<unsigned char>(text[at + i]) & 0xC0U) != 0x80U) return false;
    at += 1 + more;
  }
  return true;
}

std::string utf8_from_latin1(std::string_view text) {
  std::string utf8;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      utf8 += c;
    } else {
      utf8 += static_cast<char>(0xC0U | (byte >> 6U));
      utf8 += static_cast<char>(0x80U | (byte & 0x3FU));
    }
  }
  return utf8;
}

}  // namespace flexspline::data
