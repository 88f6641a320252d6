// Layout: ROS wiki, "Bags/Format/2.0".
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <map>
#include <memory>

#include "host/input/data/byte_reader.hpp"
#include "host/input/data/decompress.hpp"
#include "host/input/data/message_logs.hpp"
#include "host/input/data/ros_message.hpp"

namespace flexspline::data {
namespace {

constexpr std::uint8_t kBagMessage = 2, kBagChunk = 5, kBagConnection = 7;

using BagHeader = std::map<std::string, std::string_view, std::less<>>;

BagHeader bag_header(std::string_view bytes) {
  BagHeader header;
  for (ByteReader reader(bytes); !reader.at_end();) {
    const std::string_view field = reader.take(reader.u32());
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) throw DamagedFile();
    header[std::string(field.substr(0, equals))] = field.substr(equals + 1);
  }
  return header;
}

ByteReader field_of(const BagHeader& header, std::string_view name) {
  const auto at = header.find(name);
  if (at == header.end()) throw DamagedFile();
  return ByteReader(at->second);
}

class Ros1Bag {
 public:
  FileContents read(std::string_view file) {
    records(file.substr(file.find('\n') + 1), 0);
    return columns_.contents();
  }

 private:
  struct Connection {
    std::string topic;
    std::unique_ptr<RosMessageType> type;
  };

  void records(std::string_view bytes, int depth) {
    ByteReader reader(bytes);
    while (!reader.at_end()) {
      const BagHeader header = bag_header(reader.take(reader.u32()));
      const std::string_view data = reader.take(reader.u32());
      const std::uint8_t op = field_of(header, "op").u8();
      if (op == kBagConnection) connection(header, data);
      if (op == kBagMessage) message(header, data);
      if (op == kBagChunk && depth == 0) chunk(header, data);
    }
  }

  void chunk(const BagHeader& header, std::string_view data) {
    const auto at = header.find("compression");
    const std::string_view compression = at == header.end() ? "none" : at->second;
    if (compression == "none") return records(data, 1);
    if (compression == "lz4") return records(decompress_lz4(data, field_of(header, "size").u32()), 1);
    throw std::runtime_error(fmt::format(
        "is compressed by {}, which is not read; run rosbag decompress on it, or rosbag compress --lz4", compression));
  }

  void connection(const BagHeader& header, std::string_view data) {
    const std::uint32_t id = field_of(header, "conn").u32();
    if (connections_.count(id) != 0) return;
    const BagHeader about = bag_header(data);
    const auto text = [&](const BagHeader& of, const char* name) {
      const auto at = of.find(name);
      return at == of.end() ? std::string() : std::string(at->second);
    };
    Connection& made = connections_[id];
    made.topic = text(header, "topic");
    made.type = std::make_unique<RosMessageType>(text(about, "message_definition"), RosWire::ros1);
  }

  void message(const BagHeader& header, std::string_view data) {
    const auto at = connections_.find(field_of(header, "conn").u32());
    if (at == connections_.end()) throw DamagedFile();
    ByteReader time = field_of(header, "time");
    const std::int64_t seconds = time.u32();
    try {
      columns_.add(at->second.topic, seconds * 1'000'000'000 + time.u32(), at->second.type->read(data));
    } catch (const DamagedFile&) {
      columns_.leave_out(at->second.topic, "do not fit their definition");
    }
  }

  std::map<std::uint32_t, Connection> connections_;
  MessageColumns columns_;
};

}  // namespace

FileContents read_ros1_bag(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  try {
    return Ros1Bag().read(bytes);
  } catch (const std::runtime_error& wrong) {
    FileContents contents;
    contents.failure = wrong.what();
    return contents;
  }
}

}  // namespace flexspline::data
