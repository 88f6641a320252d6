// Telemetry logs of mjlib, as tview of moteus writes them. Layout: mjlib/telemetry/README.md.
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "host/input/data/byte_reader.hpp"
#include "host/input/data/message_columns.hpp"
#include "host/input/data/message_logs.hpp"

namespace flexspline::data {
namespace {

enum MjlibKind : std::uint64_t {
  kMjlibFinal = 0,
  kMjlibNull = 1,
  kMjlibBoolean = 2,
  kMjlibInt = 3,
  kMjlibUint = 4,
  kMjlibVarint = 5,
  kMjlibVaruint = 6,
  kMjlibFloat32 = 7,
  kMjlibFloat64 = 8,
  kMjlibBytes = 9,
  kMjlibString = 10,
  kMjlibObject = 16,
  kMjlibEnum = 17,
  kMjlibArray = 18,
  kMjlibFixedArray = 19,
  kMjlibMap = 20,
  kMjlibUnion = 21,
  kMjlibTimestamp = 22,
  kMjlibDuration = 23,
};

struct MjlibType {
  std::uint64_t kind = kMjlibNull;
  std::uint64_t size = 0;          // bytes of an integer, elements of a fixed array
  std::vector<std::string> names;  // of an object's fields
  std::vector<MjlibType> parts;    // fields, element, types of a union
};

constexpr std::uint64_t kBlockSchema = 1, kBlockData = 2;
constexpr std::uint64_t kFlagPrevious = 1, kFlagTime = 2, kFlagChecksum = 4, kFlagPacked = 16;
constexpr int kDeepestType = 16;
constexpr std::uint64_t kMostOfArray = 64;

class MjlibLog {
 public:
  FileContents read(std::string_view file) {
    ByteReader reader(file.substr(std::min<std::size_t>(8, file.size())));
    if (reader.varuint() != 0) throw DamagedFile();
    while (!reader.at_end()) {
      const std::uint64_t kind = reader.varuint();
      const std::string_view block = reader.take(reader.varuint());
      if (kind == kBlockSchema) schema(block);
      if (kind == kBlockData) data(block);
    }
    return columns_.contents();
  }

 private:
  struct Record {
    std::string name;
    MjlibType type;
  };

  static std::string text(ByteReader& reader) { return std::string(reader.take(reader.varuint())); }

  MjlibType type(ByteReader& reader, int depth) {
    if (depth > kDeepestType) throw DamagedFile();
    MjlibType made;
    made.kind = reader.varuint();
    if (made.kind == kMjlibInt || made.kind == kMjlibUint) made.size = reader.u8();
    if (made.kind == kMjlibObject) object(reader, made, depth);
    if (made.kind == kMjlibEnum) {
      made.parts.push_back(type(reader, depth + 1));
      for (std::uint64_t count = reader.varuint(); count > 0; --count) {
        number(reader, made.parts[0]);
        text(reader);
      }
    }
    if (made.kind == kMjlibFixedArray) made.size = reader.varuint();
    if (made.kind == kMjlibArray || made.kind == kMjlibFixedArray || made.kind == kMjlibMap)
      made.parts.push_back(type(reader, depth + 1));
    if (made.kind == kMjlibUnion)
      while (true) {
        MjlibType part = type(reader, depth + 1);
        if (part.kind == kMjlibFinal) break;
        made.parts.push_back(std::move(part));
      }
    return made;
  }

  void object(ByteReader& reader, MjlibType& made, int depth) {
    reader.varuint();  // flags
    while (true) {
      reader.varuint();  // flags of a field
      std::string name = text(reader);
      for (std::uint64_t aliases = reader.varuint(); aliases > 0; --aliases) text(reader);
      MjlibType field = type(reader, depth + 1);
      if (field.kind == kMjlibFinal) {
        if (reader.u8() != 0) throw DamagedFile();  // no default
        return;
      }
      // A default value, or none.
      if (reader.u8() != 0) {
        MessageFields ignored;
        value(reader, field, "", ignored, depth);
      }
      made.names.push_back(std::move(name));
      made.parts.push_back(std::move(field));
    }
  }

  static double number(ByteReader& reader, const MjlibType& of) {
    const std::uint64_t kind = of.kind;
    if (kind == kMjlibBoolean) return reader.u8();
    if (kind == kMjlibFloat32) return reader.number<float>();
    if (kind == kMjlibFloat64) return reader.number<double>();
    if (kind == kMjlibTimestamp || kind == kMjlibDuration)
      return 1e-6 * static_cast<double>(reader.number<std::int64_t>());
    if (kind == kMjlibVaruint) return static_cast<double>(reader.varuint());
    if (kind == kMjlibVarint) {
      const std::uint64_t zigzag = reader.varuint();
      const auto half = static_cast<double>(zigzag / 2);
      return zigzag % 2 != 0 ? -half - 1.0 : half;
    }
    const bool is_signed = kind == kMjlibInt;
    switch (of.size) {
      case 1:
        return is_signed ? reader.number<std::int8_t>() : reader.u8();
      case 2:
        return is_signed ? reader.number<std::int16_t>() : reader.number<std::uint16_t>();
      case 4:
        return is_signed ? reader.number<std::int32_t>() : reader.u32();
      case 8:
        return is_signed ? static_cast<double>(reader.number<std::int64_t>()) : static_cast<double>(reader.u64());
      default:
        throw DamagedFile();
    }
  }

  void value(ByteReader& reader, const MjlibType& of, const std::string& name, MessageFields& fields, int depth) {
    if (depth > kDeepestType) throw DamagedFile();
    switch (of.kind) {
      case kMjlibNull:
        return;
      case kMjlibBytes:
      case kMjlibString:
        text(reader);
        return;
      case kMjlibObject:
        for (std::size_t k = 0; k < of.parts.size(); ++k)
          value(reader, of.parts[k], name.empty() ? of.names[k] : name + "/" + of.names[k], fields, depth + 1);
        return;
      case kMjlibEnum:
        fields.numbers.emplace_back(name, number(reader, of.parts.at(0)));
        return;
      case kMjlibArray:
      case kMjlibFixedArray: {
        const std::uint64_t count = of.kind == kMjlibArray ? reader.varuint() : of.size;
        if (count > reader.left()) throw DamagedFile();
        MessageFields unwanted;
        for (std::uint64_t k = 0; k < count; ++k)
          value(reader, of.parts.at(0), fmt::format("{}[{}]", name, k), count <= kMostOfArray ? fields : unwanted,
                depth + 1);
        return;
      }
      case kMjlibMap:
        for (std::uint64_t count = reader.varuint(); count > 0; --count) {
          const std::string key = text(reader);
          value(reader, of.parts.at(0), name + "/" + key, fields, depth + 1);
        }
        return;
      case kMjlibUnion: {
        const std::uint64_t which = reader.varuint();
        if (which >= of.parts.size()) throw DamagedFile();
        return value(reader, of.parts[which], name, fields, depth + 1);
      }
      default:
        fields.numbers.emplace_back(name, number(reader, of));
    }
  }

  void schema(std::string_view block) {
    ByteReader reader(block);
    const std::uint64_t id = reader.varuint();
    reader.varuint();  // flags
    Record& record = records_[id];
    record.name = text(reader);
    record.type = type(reader, 0);
  }

  void data(std::string_view block) {
    ByteReader reader(block);
    const auto at = records_.find(reader.varuint());
    if (at == records_.end()) throw DamagedFile();
    const std::uint64_t flags = reader.varuint();
    std::int64_t time_us = 0;
    if ((flags & kFlagPrevious) != 0) reader.varuint();
    if ((flags & kFlagTime) != 0) time_us = reader.number<std::int64_t>();
    if ((flags & kFlagChecksum) != 0) reader.u32();
    if ((flags & kFlagPacked) != 0)
      return columns_.refuse(at->second.name, "is compressed; log it without compression");
    if ((flags & kFlagTime) == 0) return columns_.refuse(at->second.name, "has no time");
    MessageFields fields;
    value(reader, at->second.type, "", fields, 0);
    // In nanoseconds there is room until the year 2262.
    constexpr std::int64_t kLast_us = std::numeric_limits<std::int64_t>::max() / 1000;
    if (time_us < -kLast_us || time_us > kLast_us) throw DamagedFile();
    columns_.add(at->second.name, time_us * 1000, fields);
  }

  std::map<std::uint64_t, Record> records_;
  MessageColumns columns_;
};

}  // namespace

FileContents read_mjlib_log(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  try {
    return MjlibLog().read(bytes);
  } catch (const std::runtime_error& wrong) {
    FileContents contents;
    contents.failure = wrong.what();
    return contents;
  }
}

}  // namespace flexspline::data
