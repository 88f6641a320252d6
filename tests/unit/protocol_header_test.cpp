// The C header's offsets compared with bytes that the protocol and the block writer themselves put there.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <map>
#include <sstream>

#include "host/common/text/build_identity.hpp"
#include "host/drive_link/deployment/maker.hpp"
#include "host/output/interchange/enumerators.hpp"
#include "host/output/interchange/protocol_header.hpp"
#include "host/physics/model/signature.hpp"
#include "shared/model/block.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::interchange::protocol_header_test {
namespace {

const std::map<std::string, std::uint64_t>& numbers() {
  static const auto all = [] {
    std::map<std::string, std::uint64_t> found;
    std::istringstream lines(protocol_header("a test"));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string define, name, value;
      if (words >> define >> name >> value && define == "#define" && name.starts_with("FLEXSPLINE_") &&
          value.ends_with("u"))
        found[name.substr(11)] = std::stoull(value, nullptr, 0);
    }
    return found;
  }();
  return all;
}
std::uint64_t number(const std::string& name) {
  const auto found = numbers().find(name);
  EXPECT_NE(found, numbers().end()) << name;
  return found == numbers().end() ? 0 : found->second;
}
template <class T>
T at(std::span<const std::uint8_t> bytes, const std::string& name) {
  T value{};
  const std::uint64_t place = number(name);
  EXPECT_LE(place + sizeof(T), bytes.size()) << name;
  if (place + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + place, sizeof(T));
  return value;
}

TEST(ProtocolHeader, FieldsStandWhereTheProtocolPutsThem) {
  using namespace protocol;
  Identity identity;
  identity.tick_hz = 0x12345678;
  identity.serial[15] = 7;
  identity.has_output_encoder = 1;
  const Message a = request(Kind::identify, 1, identity);
  EXPECT_EQ(at<std::uint32_t>(a.content(), "IDENTITY_TICK_HZ_AT"), 0x12345678u);
  EXPECT_EQ(a.content()[number("IDENTITY_SERIAL_AT") + 15], 7);
  EXPECT_EQ(at<std::uint8_t>(a.content(), "IDENTITY_HAS_OUTPUT_ENCODER_AT"), 1);
  EXPECT_EQ(number("IDENTITY_BYTES"), a.length);

  Status status;
  status.fault_limit = -5;
  status.sequence = 0xABCD;
  status.previous.crc = 0x87654321;
  const Message b = request(Kind::status, 1, status);
  EXPECT_EQ(at<std::int32_t>(b.content(), "STATUS_FAULT_LIMIT_AT"), -5);
  EXPECT_EQ(at<std::uint16_t>(b.content(), "STATUS_SEQUENCE_AT"), 0xABCD);
  EXPECT_EQ(at<std::uint32_t>(b.content(), "STATUS_PREVIOUS_CRC_AT"), 0x87654321u);

  Command command;
  command.position = -0x123456789AB;
  command.current = 77;
  const Message c = request(Kind::command, 1, command);
  EXPECT_EQ(at<std::int64_t>(c.content(), "COMMAND_POSITION_AT"), -0x123456789AB);
  EXPECT_EQ(at<std::int32_t>(c.content(), "COMMAND_CURRENT_AT"), 77);
  EXPECT_EQ(number("COMMAND_BYTES"), c.length);

  ExcitationLines lines;
  lines.count = 4;
  lines.lines[0].harmonic = 9;
  const Message d = request(Kind::excitation_lines, 1, lines);
  EXPECT_EQ(at<std::uint8_t>(d.content(), "EXCITATION_LINES_COUNT_AT"), 4);
  EXPECT_EQ(at<std::uint16_t>(d.content(), "EXCITATION_LINES_LINES_AT"), 9);
  EXPECT_EQ(number("EXCITATION_LINES_BYTES"), d.length);

  Subscription subscription;
  subscription.count = 2;
  subscription.channels = {Channel::state, Channel::torque};
  const Message e = request(Kind::telemetry, 1, subscription);
  EXPECT_EQ(e.content()[number("SUBSCRIPTION_CHANNELS_AT") + 1], number("CHANNEL_TORQUE"));
}

TEST(ProtocolHeader, HasTheNumbersOfTheEnumerations) {
  EXPECT_EQ(number("KIND_TELEMETRY_FRAMES"), static_cast<std::uint64_t>(protocol::Kind::telemetry_frames));
  EXPECT_EQ(number("CODE_WORN"), static_cast<std::uint64_t>(protocol::Code::worn));
  EXPECT_EQ(number("SECTION_SAFETY"), static_cast<std::uint64_t>(model::Section::safety));
  EXPECT_EQ(number("REASON_ARMED"), static_cast<std::uint64_t>(model::BlockFault::armed));
  std::size_t channels = 0;
  for (const auto& [name, value] : numbers()) channels += name.starts_with("CHANNEL_") ? 1 : 0;
  EXPECT_EQ(channels, protocol::kChannels);
}

enum class Gaps : std::uint8_t { first = 2, second = 5 };
TEST(Enumerators, AreThoseThatHaveANameAndNoOther) {
  std::string all;
  for_each_enumerator<Gaps, 0, 8>(
      [&](std::string_view name, std::size_t value) { all += std::string(name) + std::to_string(value) + " "; });
  EXPECT_EQ(all, "first2 second5 ");
}

TEST(ProtocolHeader, HeaderAndEntriesOfABlockStandWhereTheWriterPutsThem) {
  model::BlockHeader header;
  std::snprintf(header.drive.data(), header.drive.size(), "drive");
  header.encoder_counts = 4096;
  header.bases.gear_ratio = {1 << 29, 8};
  header.bases.others[2] = {1 << 29, -13};
  header.limits.direction_band.raw = 1234;
  std::vector<std::uint8_t> block(model::kLargestBlock);
  model::BlockWriter writer(block);
  writer.begin(header);
  writer.add_bytes(deployment::kMakerNote, deployment::maker_note());
  block.resize(writer.end());
  EXPECT_EQ(at<std::uint32_t>(block, "BLOCK_MAGIC_AT"), number("BLOCK_MAGIC"));
  EXPECT_EQ(at<std::uint32_t>(block, "BLOCK_TOTAL_BYTES_AT"), block.size());
  EXPECT_EQ(block[number("BLOCK_DRIVE_NAME_AT") + 1], 'r');
  EXPECT_EQ(at<std::uint32_t>(block, "BLOCK_ENCODER_COUNTS_AT"), 4096u);
  EXPECT_EQ(at<std::int32_t>(block, "BASE_GEAR_RATIO_AT"), 1 << 29);
  EXPECT_EQ(block[number("BASE_TIME_AT") + 4], static_cast<std::uint8_t>(-13));
  EXPECT_EQ(at<std::int32_t>(block, "LIMIT_DIRECTION_BAND_AT"), 1234);
  EXPECT_EQ(at<std::uint16_t>(block, "BLOCK_ENTRIES_AT"), deployment::kMakerNote);
  EXPECT_EQ(deployment::maker_of(block), text::tool_name());
}

TEST(Signature, IsTheLastLineAndReplacesAnOlderOne) {
  const std::string mine = "# Last written by " + text::tool_name() + ".\n";
  EXPECT_EQ(model::signed_by_tool("a = 1\n"), "a = 1\n" + mine);
  EXPECT_EQ(model::signed_by_tool("a = 1"), "a = 1\n" + mine);
  EXPECT_EQ(model::signed_by_tool("a = 1\n# Last written by flexspline 0.0.1 (x, y).\nb = 2\n"),
            "a = 1\nb = 2\n" + mine);
  EXPECT_EQ(model::signed_by_tool(model::signed_by_tool("a = 1\n")), "a = 1\n" + mine);
  EXPECT_TRUE(model::signed_by_tool("a = 1\r\n").ends_with(".\r\n"));
}

}  // namespace
}  // namespace flexspline::interchange::protocol_header_test
