// The one file that knows SQLite. Layout: rosbag2_storage_sqlite3, schema versions 1 to 4.
#include <fmt/format.h>
#include <sqlite3.h>

#include <map>
#include <memory>

#include "host/input/data/byte_reader.hpp"
#include "host/input/data/message_logs.hpp"
#include "host/input/data/ros_message.hpp"

namespace flexspline::data {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

Statement prepared(sqlite3* database, const char* query) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, query, -1, &statement, nullptr);
  return Statement(statement);
}

// False at the end; throws where the file is damaged.
bool step(const Statement& statement) {
  const int state = sqlite3_step(statement.get());
  if (state != SQLITE_ROW && state != SQLITE_DONE) throw DamagedFile();
  return state == SQLITE_ROW;
}

std::string text_of_column(const Statement& row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row.get(), column));
  return text == nullptr ? "" : text;
}

struct Ros2Topic {
  std::string name;
  std::unique_ptr<RosMessageType> type;
};

std::map<std::int64_t, Ros2Topic> topics_of(sqlite3* database, MessageColumns& columns) {
  std::map<std::string, std::string> definitions;
  // Since version 4 the file has them itself.
  if (const Statement stated =
          prepared(database, "SELECT topic_type, encoded_message_definition FROM message_definitions"))
    while (step(stated)) definitions[text_of_column(stated, 0)] = text_of_column(stated, 1);
  std::map<std::int64_t, Ros2Topic> topics;
  const Statement all = prepared(database, "SELECT id, name, type, serialization_format FROM topics");
  if (!all) throw std::runtime_error("is a database, but no recording of ROS 2");
  while (step(all)) {
    Ros2Topic& topic = topics[sqlite3_column_int64(all.get(), 0)];
    topic.name = text_of_column(all, 1);
    const std::string type = text_of_column(all, 2);
    std::string definition = definitions[type];
    if (definition.empty()) definition = usual_ros_definition(type);
    if (definition.empty() || text_of_column(all, 3) != "cdr")
      columns.refuse(topic.name,
                     fmt::format("has messages of type {}, whose definition the file does not hold; ros2 bag "
                                 "convert to MCAP adds it",
                                 type));
    else
      topic.type = std::make_unique<RosMessageType>(definition, RosWire::cdr);
  }
  return topics;
}

}  // namespace

FileContents read_ros2_bag(const std::filesystem::path& path) {
  FileContents contents;
  try {
    sqlite3* opened = nullptr;
    const int state = sqlite3_open_v2(path.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
    const Database database(opened);
    if (state != SQLITE_OK) throw DamagedFile();
    MessageColumns columns;
    const auto topics = topics_of(database.get(), columns);
    const Statement messages =
        prepared(database.get(), "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp");
    if (!messages) throw std::runtime_error("is a database, but no recording of ROS 2");
    while (step(messages)) {
      const auto topic = topics.find(sqlite3_column_int64(messages.get(), 0));
      if (topic == topics.end() || !topic->second.type) continue;
      const auto* data = static_cast<const char*>(sqlite3_column_blob(messages.get(), 2));
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(messages.get(), 2));
      try {
        columns.add(topic->second.name, sqlite3_column_int64(messages.get(), 1),
                    topic->second.type->read(std::string_view(data == nullptr ? "" : data, size)));
      } catch (const DamagedFile&) {
        columns.leave_out(topic->second.name, "do not fit their definition, or are compressed");
      }
    }
    return columns.contents();
  } catch (const std::runtime_error& wrong) {
    contents.failure = wrong.what();
    return contents;
  }
}

}  // namespace flexspline::data
