// host/input/data: recordings of messages, whole and damaged.
#include <gtest/gtest.h>

#include <random>

#include "host/input/data/byte_reader.hpp"
#include "host/input/data/contents_guard.hpp"
#include "host/input/data/message_columns.hpp"
#include "host/input/data/message_logs.hpp"
#include "host/input/data/ros_message.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_message_logs_test {
namespace {

namespace fs = std::filesystem;

const fs::path kLogs = fs::path(FLEXSPLINE_SOURCE_DIR) / "tests/cli/fixtures";

const NamedArray* find(const FileContents& contents, const std::string& name) {
  for (const NamedArray& array : contents.arrays)
    if (array.name == name) return &array;
  return nullptr;
}

TEST(MessageLogs, BagsAndMcapGiveTheSameNumbersByTopicAndField) {
  for (const char* name : {"joint_states.bag", "joint_states.db3", "joint_states.mcap"}) {
    const FileContents contents = read_contents(kLogs / name, format_of(kLogs / name));
    EXPECT_EQ(contents.failure, "");
    const NamedArray* time = find(contents, "/joint_states/time");
    const NamedArray* effort = find(contents, "/joint_states/effort[1]");
    const NamedArray* rest = find(contents, "/joint_states/position[0]");
    ASSERT_TRUE(time && effort && rest) << name;
    ASSERT_EQ(time->values.size(), effort->values.size());
    EXPECT_GE(time->values.size(), 750u);
    EXPECT_EQ(time->values[0], 0.0);  // by the header's stamp, not by when it was logged
    EXPECT_NEAR(time->values[100], 0.8, 1e-9);
    EXPECT_EQ(rest->values[100], 0.0);
    EXPECT_NEAR(effort->values[0], 100.0 * (1e-3 * 90.0 + 0.05), 1e-9);
  }
}

TEST(MessageLogs, ATopicThatCannotBeReadIsRefusedWithItsReason) {
  const FileContents contents = read_contents(kLogs / "joint_states.db3", FileFormat::ros2_bag);
  ASSERT_EQ(contents.refused.size(), 1u);
  EXPECT_EQ(contents.refused[0].name, "/camera");
  EXPECT_NE(contents.refused[0].why.find("sensor_msgs/msg/Image"), std::string::npos);
}

TEST(MessageLogs, MessagesThatAreLeftOutAreCounted) {
  MessageColumns columns;
  columns.add("/joint", 0, {{{"q", 1.0}}, std::nullopt});
  columns.leave_out("/joint", "do not fit their definition");
  columns.leave_out("/joint", "do not fit their definition");
  columns.leave_out("/camera", "do not fit their definition");
  const FileContents contents = columns.contents();
  ASSERT_EQ(contents.losses.size(), 1u);  // of the other topic nothing is read at all
  EXPECT_EQ(contents.losses[0], "2 messages of /joint are left out: they do not fit their definition");
  EXPECT_EQ(contents.refused.size(), 2u);
}

TEST(MessageLogs, CutOnesEndInAMessageOrInWhatWasWhole) {
  const TestFolder folder;
  for (const char* name : {"joint_states.bag", "joint_states.db3", "joint_states.mcap", "tview.log"}) {
    std::string whole(fs::file_size(kLogs / name), '\0');
    std::ifstream(kLogs / name, std::ios::binary).read(whole.data(), static_cast<std::streamsize>(whole.size()));
    const FileFormat format = format_of(kLogs / name);
    for (std::size_t length = 20; length < whole.size(); length += 1 + whole.size() / 9) {
      const FileContents contents = read_contents(folder.write(name, whole.substr(0, length)), format);
      EXPECT_TRUE(!contents.failure.empty() || !contents.arrays.empty()) << name << " " << length;
    }
  }
}

// In this process, where the sanitizers see what the readers do.
TEST(MessageLogs, BytesChangedAtRandomEndInAMessageOrInColumnsOfTheSizeThatTheyState) {
  const TestFolder folder;
  std::mt19937 random(1);
  std::size_t refused = 0, read = 0;
  const std::pair<const char*, FileContents (*)(const fs::path&)> readers[] = {
      {"joint_states.bag", read_ros1_bag}, {"joint_states.mcap", read_mcap}, {"tview.log", read_mjlib_log}};
  for (const auto& [name, reader] : readers) {
    std::string whole(fs::file_size(kLogs / name), '\0');
    std::ifstream(kLogs / name, std::ios::binary).read(whole.data(), static_cast<std::streamsize>(whole.size()));
    for (int i = 0; i < 40; ++i) {
      std::string damaged = whole;
      const std::size_t span = i % 2 == 0 ? damaged.size() : 600;
      for (std::size_t k = 0; k < 1 + random() % 4; ++k)
        damaged[random() % span] = static_cast<char>(random() % 3 == 0 ? 0xFF : random());
      const FileContents contents = reader(folder.write(name, damaged));
      ++(contents.failure.empty() ? read : refused);
      for (const NamedArray& array : contents.arrays) ASSERT_EQ(array.values.size(), array.dims.at(0));
    }
  }
  EXPECT_GT(refused, 10u);
  EXPECT_GT(read, 10u);
}

// A message of every kind of field, in both ways of writing it.
TEST(MessageLogs, FieldsOfAllKindsAreFoundInBothWires) {
  const std::string definition =
      "# a comment\nuint8 MODE=3\nbool on\nfloat64 x\nstring label\nint16[2] pair\nInner[] parts\ntime t\n"
      "================\nMSG: pack/Inner\nfloat32 y\nuint8 z\n";
  std::string packed;
  const auto put = [&](const auto& value) { packed.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(std::uint8_t{1});
  put(2.5);
  put(std::uint32_t{3});
  packed += "abc";
  put(std::int16_t{-7});
  put(std::int16_t{8});
  put(std::uint32_t{1});
  put(0.5F);
  put(std::uint8_t{9});
  put(std::uint32_t{1});
  put(std::uint32_t{2});
  const MessageFields fields = RosMessageType(definition, RosWire::ros1).read(packed);
  const std::vector<std::pair<std::string, double>> expected = {
      {"on", 1.0}, {"x", 2.5}, {"pair[0]", -7.0}, {"pair[1]", 8.0}, {"parts[0]/y", 0.5}, {"parts[0]/z", 9.0}};
  EXPECT_EQ(fields.numbers, expected);
  for (std::size_t length = 0; length < packed.size(); ++length)
    EXPECT_THROW(RosMessageType(definition, RosWire::ros1).read(packed.substr(0, length)), DamagedFile);

  // CDR aligns each number to its size, counted from behind its four bytes.
  const std::string cdr(
      "\x00\x01\x00\x00"
      "\x01\x00\x00\x00\x00\x00\x00\x00"
      "\x00\x00\x00\x00\x00\x00\x04\x40",
      20);
  const MessageFields aligned = RosMessageType("bool on\nfloat64 x\n", RosWire::cdr).read(cdr);
  ASSERT_EQ(aligned.numbers.size(), 2u);
  EXPECT_EQ(aligned.numbers[1].second, 2.5);
}

}  // namespace
}  // namespace flexspline::data::data_message_logs_test
