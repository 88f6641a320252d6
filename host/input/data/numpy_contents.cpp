// Layouts: NumPy Enhancement Proposal 1, "A simple file format for NumPy arrays"; PKWARE's APPNOTE.TXT for ZIP.
#include "host/input/data/numpy_contents.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string_view>

#include "host/input/data/row_major_columns.hpp"

namespace flexspline::data {
namespace {

constexpr const char* kDamagedNumpy = "is damaged or cut short";

std::string whole_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// An unsigned number of `size` bytes, the least first; 0 beyond the end.
std::uint64_t little(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;)
    value = value << 8U | (at + i < bytes.size() ? static_cast<unsigned char>(bytes[at + i]) : 0U);
  return value;
}

struct NumpyType {
  char kind = 'f';  // f, i, u, b; M: a date
  std::size_t size = 8;
  bool swapped = false;
  double factor = 1.0;  // of a date: seconds a unit
};

// "<f8", "|u1", "<M8[ns]"; nothing where it holds no numbers.
std::optional<NumpyType> numpy_type(std::string_view text) {
  if (text.size() < 3) return std::nullopt;
  NumpyType type;
  type.swapped = text[0] == '>' && std::endian::native == std::endian::little;
  type.kind = text[1];
  type.size = static_cast<std::size_t>(text[2] - '0');
  const std::string_view rest = text.substr(3);
  if (type.kind == 'M')
    type.factor = rest == "[s]" ? 1.0 : rest == "[ms]" ? 1e-3 : rest == "[us]" ? 1e-6 : rest == "[ns]" ? 1e-9 : 0.0;
  else if (!rest.empty())
    return std::nullopt;
  const bool number = type.kind == 'f'   ? type.size == 4 || type.size == 8
                      : type.kind == 'b' ? type.size == 1
                      : type.kind == 'i' || type.kind == 'u'
                          ? type.size == 1 || type.size == 2 || type.size == 4 || type.size == 8
                          : type.kind == 'M' && type.size == 8 && type.factor > 0.0;
  return number ? std::optional(type) : std::nullopt;
}

// The values at `at`, `at` + `step` ...
std::vector<double> numpy_values(std::string_view bytes, std::size_t at, std::size_t step, std::size_t count,
                                 const NumpyType& type) {
  std::vector<double> values(count);
  std::int64_t first = 0;
  for (std::size_t k = 0; k < count; ++k) {
    std::uint64_t raw = little(bytes, at + k * step, type.size);
    if (type.swapped) raw = __builtin_bswap64(raw) >> (64U - 8U * type.size);
    const auto shift = static_cast<unsigned>(64 - 8 * type.size);
    const auto integer = static_cast<std::int64_t>(raw << shift) >> shift;
    if (k == 0) first = integer;
    if (type.kind == 'f')
      values[k] = type.size == 8 ? std::bit_cast<double>(raw) : std::bit_cast<float>(static_cast<std::uint32_t>(raw));
    else if (type.kind == 'i')
      values[k] = static_cast<double>(integer);
    else if (type.kind == 'M')
      // A date has more digits than a double; what is no date (NaT) may be as far off as there are numbers.
      values[k] = type.factor * static_cast<double>(static_cast<std::int64_t>(static_cast<std::uint64_t>(integer) -
                                                                              static_cast<std::uint64_t>(first)));
    else
      values[k] = static_cast<double>(raw);
  }
  return values;
}

// What follows 'key': in the header, a dictionary as Python prints it, up to `end`.
std::string_view header_entry(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) return {};
  std::string_view value = header.substr(at + key.size() + 3);
  while (value.starts_with(' ')) value.remove_prefix(1);
  return value;
}

std::vector<std::size_t> shape_of(std::string_view header) {
  std::vector<std::size_t> dims;
  std::string_view text = header_entry(header, "shape");
  text = text.substr(0, text.find(')'));
  for (std::size_t at = 0; at < text.size();) {
    std::size_t value = 0, digits = 0;
    for (; at < text.size() && text[at] >= '0' && text[at] <= '9' && digits < 15; ++at, ++digits)
      value = 10 * value + static_cast<std::size_t>(text[at] - '0');
    if (digits > 0)
      dims.push_back(value);
    else
      ++at;
  }
  return dims;
}

struct NumpyField {
  std::string name;
  std::string type;
};
// [('t', '<f8'), ('day', '<M8[ns]')]; nothing where an entry is another one than a name and a type, such as
// ('tau', '<f8', (3,)).
std::optional<std::vector<NumpyField>> fields_of(std::string_view descr) {
  std::vector<NumpyField> fields;
  // Dates have brackets of their own; no other entry of the header has.
  descr = descr.substr(1, descr.rfind(']') - 1);
  const auto skip = [&](std::string_view characters) {
    descr.remove_prefix(std::min(descr.find_first_not_of(characters), descr.size()));
  };
  const auto text = [&]() -> std::optional<std::string> {
    skip(" ");
    if (!descr.starts_with('\'')) return std::nullopt;
    const std::size_t end = descr.find('\'', 1);
    if (end == std::string_view::npos) return std::nullopt;
    std::string found(descr.substr(1, end - 1));
    descr.remove_prefix(end + 1);
    return found;
  };
  const auto is_next = [&](char character) {
    skip(" ");
    if (!descr.starts_with(character)) return false;
    descr.remove_prefix(1);
    return true;
  };
  for (skip(", "); !descr.empty(); skip(", ")) {
    if (!is_next('(')) return std::nullopt;
    std::optional<std::string> name = text();
    if (!name || !is_next(',')) return std::nullopt;
    std::optional<std::string> type = text();
    if (!type || !is_next(')')) return std::nullopt;
    fields.push_back({std::move(*name), std::move(*type)});
  }
  return fields;
}

void take_fields(std::string_view descr, std::string_view data, std::size_t count, const std::string& name,
                 FileContents& contents) {
  const std::optional<std::vector<NumpyField>> fields = fields_of(descr);
  if (!fields) return contents.refused.push_back({name, "has fields that are no single numbers"});
  std::size_t entry = 0;
  for (const NumpyField& field : *fields) {
    const auto type = numpy_type(field.type);
    if (!type) return contents.refused.push_back({name, "has fields that are no numbers"});
    entry += type->size;
  }
  if (entry == 0 || data.size() % entry != 0 || data.size() / entry != count)
    return contents.refused.push_back({name, kDamagedNumpy});
  std::size_t at = 0;
  for (const NumpyField& field : *fields) {
    const NumpyType type = *numpy_type(field.type);
    contents.arrays.push_back({name + "." + field.name, {count}, numpy_values(data, at, entry, count, type)});
    at += type.size;
  }
}

// One .npy.
void take_array(std::string_view bytes, const std::string& name, FileContents& contents) {
  const auto damaged = [&] { contents.refused.push_back({name, kDamagedNumpy}); };
  if (bytes.size() < 12 || !bytes.starts_with("\x93NUMPY")) return damaged();
  const std::size_t length_bytes = bytes[6] == 1 ? 2 : 4;
  const std::size_t length = little(bytes, 8, length_bytes), begin = 8 + length_bytes + length;
  if (begin > bytes.size()) return damaged();
  const std::string_view header = bytes.substr(8 + length_bytes, length);
  const std::string_view data = bytes.substr(begin);
  std::vector<std::size_t> dims = shape_of(header);
  std::size_t count = 1;
  for (const std::size_t d : dims)
    if (__builtin_mul_overflow(count, d, &count)) return damaged();
  std::string_view descr = header_entry(header, "descr");
  if (descr.starts_with('[')) {
    if (count == 0) return contents.refused.push_back({name, "is empty"});
    return take_fields(descr, data, count, name, contents);
  }
  if (descr.size() < 2) return damaged();
  descr = descr.substr(1, descr.find('\'', 1) - 1);
  const auto type = numpy_type(descr);
  if (!type)
    return contents.refused.push_back(
        {name, descr.starts_with("|O") ? "holds Python objects" : "holds no real numbers"});
  if (data.size() / type->size < count) return damaged();
  const std::vector<double> values = numpy_values(data, 0, type->size, count, *type);
  if (header_entry(header, "fortran_order").starts_with("True") && dims.size() == 2) {
    std::vector<double> rows(values.size());
    for (std::size_t r = 0; r < dims[0]; ++r)
      for (std::size_t c = 0; c < dims[1]; ++c) rows[r * dims[1] + c] = values[c * dims[0] + r];
    return add_row_major_columns(contents, name, dims, rows);
  }
  add_row_major_columns(contents, name, dims, values);
}

std::optional<std::string> inflated(std::string_view packed, std::size_t size) {
  // deflate makes at most 1032 bytes of one.
  if (size / 1100 > packed.size() + 1) return std::nullopt;
  std::string text(size, '\0');
  z_stream stream{};
  if (::inflateInit2(&stream, -MAX_WBITS) != Z_OK) return std::nullopt;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(size);
  const int state = ::inflate(&stream, Z_FINISH);
  const bool whole = state == Z_STREAM_END && stream.avail_out == 0;
  ::inflateEnd(&stream);
  return whole ? std::optional(std::move(text)) : std::nullopt;
}

// One entry of a ZIP file's directory, "iq.npy".
bool take_zip_entry(std::string_view file, std::size_t entry, FileContents& contents) {
  std::uint64_t packed = little(file, entry + 20, 4), size = little(file, entry + 24, 4),
                at = little(file, entry + 42, 4);
  const std::size_t name_size = little(file, entry + 28, 2), extra_size = little(file, entry + 30, 2);
  if (entry + 46 + name_size + extra_size > file.size()) return false;
  // Sizes of 4 GB and more are in an extra field.
  for (std::size_t extra = entry + 46 + name_size, end = extra + extra_size; extra + 4 <= end;) {
    std::size_t value = extra + 4;
    if (little(file, extra, 2) == 1)
      for (std::uint64_t* const wide : {&size, &packed, &at})
        if (*wide == 0xFFFFFFFFU) {
          *wide = little(file, value, 8);
          value += 8;
        }
    extra += 4 + little(file, extra + 2, 2);
  }
  const std::string name(file.substr(entry + 46, name_size));
  if (at > file.size() || file.size() - at < 30) return false;
  const std::size_t begin = at + 30 + little(file, at + 26, 2) + little(file, at + 28, 2);
  if (begin > file.size() || file.size() - begin < packed || packed > std::numeric_limits<uInt>::max()) return false;
  if (!name.ends_with(".npy")) return true;
  const std::uint64_t method = little(file, entry + 10, 2);
  const std::string_view data = file.substr(begin, packed);
  const std::optional<std::string> whole = method == 0   ? std::optional(std::string(data))
                                           : method == 8 ? inflated(data, size)
                                                         : std::nullopt;
  if (!whole || ::crc32(0, reinterpret_cast<const Bytef*>(whole->data()), static_cast<uInt>(whole->size())) !=
                    little(file, entry + 16, 4))
    return false;
  take_array(*whole, name.substr(0, name.size() - 4), contents);
  return true;
}

}  // namespace

FileContents read_npy(const std::filesystem::path& path) {
  FileContents contents;
  take_array(whole_file(path), "array", contents);
  return contents;
}

FileContents read_npz(const std::filesystem::path& path) {
  const std::string bytes = whole_file(path);
  const std::string_view file = bytes;
  FileContents contents;
  // The directory's end record is at the end, before a comment of at most 65535 bytes.
  const std::size_t end = file.rfind(std::string_view("PK\x05\x06", 4));
  std::size_t entry = end == std::string_view::npos ? file.size() : little(file, end + 16, 4);
  const std::size_t count = end == std::string_view::npos ? 0 : little(file, end + 10, 2);
  for (std::size_t i = 0; i < count; ++i) {
    if (entry + 46 > file.size() || little(file, entry, 4) != 0x02014B50U || !take_zip_entry(file, entry, contents)) {
      contents = {};
      contents.failure = kDamagedNumpy;
      return contents;
    }
    entry += 46 + little(file, entry + 28, 2) + little(file, entry + 30, 2) + little(file, entry + 32, 2);
  }
  if (contents.arrays.empty() && contents.refused.empty()) contents.failure = "holds no array of NumPy";
  return contents;
}

}  // namespace flexspline::data
