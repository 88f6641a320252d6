// Layout: the MCAP format specification (mcap.dev/spec).
#include <fmt/format.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/input/data/byte_reader.hpp"
#include "host/input/data/decompress.hpp"
#include "host/input/data/message_logs.hpp"
#include "host/input/data/ros_message.hpp"

namespace flexspline::data {
namespace {

constexpr std::uint8_t kMcapFooter = 2, kMcapSchema = 3, kMcapChannel = 4, kMcapMessage = 5, kMcapChunk = 6;
constexpr std::size_t kMcapMagic = 8;

void take_json(const nlohmann::json& value, const std::string& name, MessageFields& fields, int depth) {
  if (depth > 12) return;
  const std::string prefix = name.empty() ? "" : name + "/";
  if (value.is_number() || value.is_boolean())
    fields.numbers.emplace_back(name, value.is_boolean() ? (value.get<bool>() ? 1.0 : 0.0) : value.get<double>());
  else if (value.is_object())
    for (const auto& [key, inner] : value.items()) take_json(inner, prefix + key, fields, depth + 1);
  else if (value.is_array())
    for (std::size_t k = 0; k < std::min<std::size_t>(value.size(), 64); ++k)
      take_json(value[k], fmt::format("{}[{}]", name, k), fields, depth + 1);
}

MessageFields json_fields(std::string_view message) {
  MessageFields fields;
  const nlohmann::json content = nlohmann::json::parse(message, nullptr, false);
  if (content.is_discarded()) throw DamagedFile();
  take_json(content, "", fields, 0);
  return fields;
}

class Mcap {
 public:
  FileContents read(std::string_view file) {
    if (file.size() < 2 * kMcapMagic) throw DamagedFile();
    records(file.substr(kMcapMagic), 0);
    return columns_.contents();
  }

 private:
  struct Schema {
    std::string name, encoding, definition;
  };
  struct Channel {
    std::string topic;
    std::function<MessageFields(std::string_view)> read;  // empty: it cannot be
  };

  static std::string text(ByteReader& reader) { return std::string(reader.take(reader.u32())); }

  void records(std::string_view bytes, int depth) {
    ByteReader reader(bytes);
    while (!reader.at_end()) {
      const std::uint8_t op = reader.u8();
      // What follows the footer are only the magic bytes again.
      if (op == kMcapFooter && depth == 0) return;
      const std::string_view content = reader.take(reader.u64());
      if (op == kMcapSchema) schema(content);
      if (op == kMcapChannel) channel(content);
      if (op == kMcapMessage) message(content);
      if (op == kMcapChunk && depth == 0) chunk(content);
    }
  }

  void schema(std::string_view content) {
    ByteReader reader(content);
    const auto id = reader.number<std::uint16_t>();
    Schema& made = schemas_[id];
    made.name = text(reader);
    made.encoding = text(reader);
    made.definition = text(reader);
  }

  void channel(std::string_view content) {
    ByteReader reader(content);
    const auto id = reader.number<std::uint16_t>();
    const auto schema_id = reader.number<std::uint16_t>();
    if (channels_.count(id) != 0) return;
    Channel& made = channels_[id];
    made.topic = text(reader);
    const std::string encoding = text(reader);
    const Schema& schema = schemas_[schema_id];
    if (encoding == "json") {
      made.read = json_fields;
    } else if ((encoding == "cdr" && schema.encoding == "ros2msg") ||
               (encoding == "ros1" && schema.encoding == "ros1msg")) {
      const auto type =
          std::make_shared<RosMessageType>(schema.definition, encoding == "cdr" ? RosWire::cdr : RosWire::ros1);
      made.read = [type](std::string_view data) { return type->read(data); };
    } else {
      columns_.refuse(made.topic, fmt::format("has messages in {} ({}), which is not read", encoding, schema.encoding));
    }
  }

  void message(std::string_view content) {
    ByteReader reader(content);
    const auto at = channels_.find(reader.number<std::uint16_t>());
    if (at == channels_.end()) throw DamagedFile();
    reader.u32();  // its number in the sequence
    const auto logged_ns = static_cast<std::int64_t>(reader.u64());
    reader.u64();  // when it was published
    if (!at->second.read) return;
    try {
      columns_.add(at->second.topic, logged_ns, at->second.read(reader.take(reader.left())));
    } catch (const DamagedFile&) {
      columns_.leave_out(at->second.topic, "do not fit their definition");
    }
  }

  void chunk(std::string_view content) {
    ByteReader reader(content);
    reader.u64();  // times of its first and last message
    reader.u64();
    const std::uint64_t size = reader.u64();
    reader.u32();  // checksum
    const std::string compression = text(reader);
    const std::string_view data = reader.take(reader.u64());
    if (compression.empty()) return records(data, 1);
    if (compression == "zstd") return records(decompress_zstd(data, size), 1);
    if (compression == "lz4") return records(decompress_lz4(data, size), 1);
    throw std::runtime_error(
        fmt::format("is compressed by {}, which is not read; run mcap compress on it", compression));
  }

  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  MessageColumns columns_;
};

}  // namespace

FileContents read_mcap(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  try {
    return Mcap().read(bytes);
  } catch (const std::runtime_error& wrong) {
    FileContents contents;
    contents.failure = wrong.what();
    return contents;
  }
}

}  // namespace flexspline::data
