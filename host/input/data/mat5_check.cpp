// Layout: MATLAB's document "MAT-File Format", chapter 1, "MAT-File Level 5 Format".
#include "host/input/data/mat5_check.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

namespace flexspline::data {
namespace {

constexpr std::size_t kHeader = 128;
constexpr int kDeepestElement = 32;
constexpr std::size_t kMostDimensions = 32;
constexpr std::size_t kMostBytesInflated = std::size_t{1} << 32;

// Types of elements that matter here.
constexpr std::uint32_t kInt32 = 5, kUint32 = 6, kMatrix = 14, kCompressed = 15;
// Classes of arrays.
constexpr std::uint32_t kCell = 1, kStruct = 2, kObject = 3, kFirstNumeric = 6, kLastNumeric = 15;
constexpr std::uint32_t kComplexFlag = 0x0800;

// Bytes of one value of a numeric element type; 0 for all others.
std::size_t value_size(std::uint32_t type) {
  constexpr std::array<std::uint8_t, 14> kSizes = {0, 1, 1, 2, 2, 4, 4, 4, 0, 8, 0, 0, 8, 8};
  return type < kSizes.size() ? kSizes[type] : 0;
}

struct Element {
  std::uint32_t type = 0;
  std::string_view data;
};

// Elements one after another; each is checked to be within its container.
class Elements {
 public:
  Elements(std::string_view bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}

  bool at_end() const { return bytes_.empty(); }
  std::uint32_t number(std::string_view bytes, std::size_t index) const {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + 4 * index, 4);
    return swapped_ ? __builtin_bswap32(value) : value;
  }
  // Nothing if the element is cut off.
  std::optional<Element> next() {
    if (bytes_.size() < 8) return std::nullopt;
    const std::uint32_t first = number(bytes_, 0);
    if (const std::uint32_t small = first >> 16; small != 0) {  // up to four bytes next to the tag
      if (small > 4) return std::nullopt;
      return taken({first & 0xFFFF, bytes_.substr(4, small)}, 8);
    }
    const std::size_t size = number(bytes_, 1);
    if (size > bytes_.size() - 8) return std::nullopt;
    // Compressed elements are not padded, and the last element of an array may not be.
    const std::size_t padded = first == kCompressed ? size : (size + 7) / 8 * 8;
    return taken({first, bytes_.substr(8, size)}, 8 + padded);
  }

 private:
  Element taken(Element element, std::size_t size) {
    bytes_.remove_prefix(std::min(size, bytes_.size()));
    return element;
  }

  std::string_view bytes_;
  bool swapped_;
};

class Checker {
 public:
  explicit Checker(bool swapped) : swapped_(swapped) {}

  // What is wrong with an array, or nothing.
  std::string array(std::string_view bytes, int depth, std::string* name_of_it = nullptr) {
    if (bytes.empty()) return {};  // as MATLAB writes an empty element of a cell or struct
    if (depth > kDeepestElement) return "nests too deeply";
    Elements parts(bytes, swapped_);
    const auto flags = parts.next();
    if (!flags || (flags->type != kUint32 && flags->type != kInt32) || flags->data.size() != 8)
      return "does not state its class";
    const std::uint32_t flag = parts.number(flags->data, 0);
    const std::uint32_t kind = flag & 0xFF;
    if (kind == 0 || kind > 17) return "is of a class that does not exist";
    if (kind == 17) return {};  // an object, whose layout is not published; it is not read

    const auto dims = parts.next();
    if (!dims || (dims->type != kInt32 && dims->type != kUint32) || dims->data.size() % 4 != 0 ||
        dims->data.size() < 8 || dims->data.size() > 4 * kMostDimensions)
      return "has no dimensions";
    std::size_t count = 1;
    for (std::size_t i = 0; i < dims->data.size() / 4; ++i) {
      const std::uint32_t d = parts.number(dims->data, i);
      if (d > std::uint32_t{std::numeric_limits<std::int32_t>::max()} || __builtin_mul_overflow(count, d, &count))
        return "has dimensions that cannot be";
    }
    const auto name = parts.next();
    if (!name || (value_size(name->type) != 1 && name->type != 16)) return "has no name";
    if (name_of_it != nullptr) *name_of_it = std::string(name->data);

    if (kind >= kFirstNumeric && kind <= kLastNumeric) return numbers(parts, count, (flag & kComplexFlag) != 0);
    if (kind == kCell) return children(parts, count, depth);
    if (kind == kStruct || kind == kObject) return fields(parts, kind, count, depth);
    while (!parts.at_end())
      if (!parts.next()) return "is cut short";
    return {};
  }

 private:
  static std::string numbers(Elements& parts, std::size_t count, bool complex) {
    for (int part = 0; part < (complex ? 2 : 1); ++part) {
      if (count == 0 && parts.at_end()) return {};
      const auto values = parts.next();
      if (!values) return "is cut short";
      const std::size_t size = value_size(values->type);
      if (size == 0 || values->data.size() % size != 0 || values->data.size() / size != count)
        return fmt::format("holds another number of values than its dimensions state ({})", count);
    }
    return {};
  }

  std::string fields(Elements& parts, std::uint32_t kind, std::size_t count, int depth) {
    if (kind == kObject && !parts.next()) return "has no class name";
    const auto length = parts.next();
    if (!length || length->data.size() != 4) return "has no names of fields";
    const std::size_t name_bytes = parts.number(length->data, 0);
    const auto names = parts.next();
    if (!names || name_bytes == 0 || name_bytes > 4096 || names->data.size() % name_bytes != 0)
      return "has no names of fields";
    for (std::size_t at = name_bytes; at <= names->data.size(); at += name_bytes)
      if (names->data[at - 1] != '\0') return "has names of fields without an end";
    std::size_t all = 0;
    if (__builtin_mul_overflow(count, names->data.size() / name_bytes, &all)) return "has dimensions that cannot be";
    return children(parts, all, depth);
  }

  std::string children(Elements& parts, std::size_t count, int depth) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto child = parts.next();
      if (!child) return "is cut short";
      if (child->type != kMatrix) return "has a part that is not an array";
      if (std::string wrong = array(child->data, depth + 1); !wrong.empty()) return wrong;
    }
    return {};
  }

  bool swapped_;
};

class Inflater {
 public:
  Inflater() { ready_ = ::inflateInit(&stream_) == Z_OK; }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() {
    if (ready_) ::inflateEnd(&stream_);
  }

  // Nothing if the data are damaged, by their structure or their checksum.
  std::optional<std::string> inflate(std::string_view packed) {
    if (!ready_) return std::nullopt;
    std::string all;
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream_.avail_in = static_cast<uInt>(packed.size());
    int state = Z_OK;
    while (state == Z_OK && all.size() < kMostBytesInflated) {
      const std::size_t before = all.size();
      all.resize(before + std::max<std::size_t>(before / 2, 65536));
      stream_.next_out = reinterpret_cast<Bytef*>(all.data() + before);
      stream_.avail_out = static_cast<uInt>(all.size() - before);
      state = ::inflate(&stream_, Z_NO_FLUSH);
      all.resize(all.size() - stream_.avail_out);
    }
    if (state != Z_STREAM_END) return std::nullopt;
    return all;
  }

 private:
  z_stream stream_{};
  bool ready_ = false;
};

std::string called(std::size_t number, const std::string& name) {
  const bool legible =
      !name.empty() && std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < 127; });
  return legible ? fmt::format("its variable \"{}\"", name) : fmt::format("its variable {}", number);
}

}  // namespace

MatVersion mat_version(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(kHeader, '\0');
  file.read(head.data(), static_cast<std::streamsize>(kHeader));
  head.resize(static_cast<std::size_t>(file.gcount()));
  if (head.size() >= kHeader) {
    const std::string_view mark = std::string_view(head).substr(124, 4);
    using namespace std::string_view_literals;
    if (mark == "\x00\x01IM"sv || mark == "\x01\x00MI"sv) return MatVersion::v5;
    if (mark == "\x00\x02IM"sv || mark == "\x02\x00MI"sv) return MatVersion::v7_3;
  }
  // Type MOPT with zeros where they must be, then rows, columns, whether it is complex, and the length of a name.
  if (head.size() >= 20) {
    std::array<std::uint32_t, 5> words{};
    std::memcpy(words.data(), head.data(), 20);
    if (words[0] > 5000)
      for (std::uint32_t& word : words) word = __builtin_bswap32(word);
    if (words[0] <= 4052 && words[3] <= 1 && words[4] >= 1 && words[4] <= 64) return MatVersion::v4;
  }
  return MatVersion::none;
}

std::string damage_of_mat5(std::string_view file) {
  if (file.size() < kHeader) return "is cut short";
  const bool swapped = (file[126] == 'M') == (std::endian::native == std::endian::little);
  Elements variables(file.substr(kHeader), swapped);
  for (std::size_t number = 1; !variables.at_end(); ++number) {
    const auto element = variables.next();
    if (!element) return fmt::format("is cut short, or damaged, in {}", called(number, ""));
    std::string_view array = element->data;
    std::string inflated;
    if (element->type == kCompressed) {
      std::optional<std::string> whole = Inflater().inflate(element->data);
      if (!whole) return fmt::format("is damaged: the compressed data of {} are not whole", called(number, ""));
      inflated = std::move(*whole);
      const auto inner = Elements(inflated, swapped).next();
      if (!inner || inner->type != kMatrix) return fmt::format("is damaged: {} is not an array", called(number, ""));
      array = inner->data;
    } else if (element->type != kMatrix) {
      return fmt::format("is damaged: {} is not an array", called(number, ""));
    }
    std::string name;
    const std::string wrong = Checker(swapped).array(array, 0, &name);
    if (!wrong.empty()) return fmt::format("is damaged: {} {}", called(number, name), wrong);
  }
  return {};
}

}  // namespace flexspline::data
