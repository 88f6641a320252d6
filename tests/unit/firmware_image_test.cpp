// Firmware images as files: what is made is read, and what is wrong with one is said.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>

#include "host/drive_link/firmware/image_file.hpp"
#include "host/drive_link/firmware/update.hpp"

namespace flexspline::firmware_files::firmware_image_test {
namespace {

Bytes program() {
  Bytes bytes(1000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 7);
  return bytes;
}
std::string refusal(const Bytes& bytes) {
  try {
    parse_image(bytes, "x.image");
  } catch (const ImageError& error) {
    return error.what();
  }
  return {};
}
bool says(const std::string& text, const char* part) {
  return text.starts_with("x.image: ") && text.find(part) != std::string::npos;
}

TEST(FirmwareImage, WhatIsMadeIsRead) {
  const Bytes bytes = make_image(program(), "stm32f405", {3, 14});
  const Image image = parse_image(bytes, "x.image");
  EXPECT_EQ(image.bytes, bytes);
  EXPECT_EQ(image.board(), "stm32f405");
  EXPECT_EQ(text_of(image.header.version), "3.14");
  EXPECT_EQ(image.header.bytes, 1000U);
  EXPECT_EQ(image.header.signature_kind, boot::SignatureKind::none);
  EXPECT_TRUE(std::equal(bytes.begin() + boot::kHeaderBytes, bytes.end(), program().begin()));
}

TEST(FirmwareImage, EveryKindOfDamageIsNamed) {
  const Bytes good = make_image(program(), "board", {1, 0});
  EXPECT_TRUE(says(refusal({}), "empty"));
  EXPECT_TRUE(says(refusal(program()), "not a firmware image"));
  EXPECT_TRUE(says(refusal(Bytes(good.begin(), good.begin() + 100)), "truncated"));
  EXPECT_TRUE(
      says(refusal(Bytes(good.begin(), good.end() - 1)), "truncated: it has 1511 bytes, and its header states 1512"));
  Bytes longer = good;
  longer.push_back(0);
  EXPECT_TRUE(says(refusal(longer), "1 bytes behind the 1512"));
  for (const std::size_t at : {5U, 9U, 20U, 33U, 300U, 511U}) {
    Bytes damaged = good;
    damaged[at] ^= 0x40;
    EXPECT_TRUE(says(refusal(damaged), "checksum of its header")) << at;
  }
  Bytes damaged = good;
  damaged[700] ^= 1;
  EXPECT_TRUE(says(refusal(damaged), "CRC-32"));
}

// The bytes of a suffix, read by DFU 1.1's appendix B: CRC by polynomial division, bit for bit.
TEST(FirmwareImage, TheDfuSuffixIsThatOfTheSpecification) {
  const Bytes image = make_image(program(), "board", {1, 0});
  const Bytes file = with_dfu_suffix(image);
  ASSERT_EQ(file.size(), image.size() + 16);
  const Bytes fixed(file.end() - 16, file.end() - 4);
  EXPECT_EQ(fixed, (Bytes{0xff, 0xff, 0xff, 0xff, 0x09, 0x12, 0x00, 0x01, 'U', 'F', 'D', 16}));
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = 0; i + 4 < file.size(); ++i) {
    crc ^= file[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(file[file.size() - 4 + i], static_cast<std::uint8_t>(crc >> (8 * i)));
  EXPECT_EQ(parse_image(file, "x.image").bytes, image);
  Bytes damaged = file;
  damaged[600] ^= 1;
  EXPECT_TRUE(says(refusal(damaged), "DFU suffix"));
}

TEST(FirmwareImage, WhatCannotBecomeAnImageIsRefused) {
  EXPECT_THROW(make_image({}, "board", {}), ImageError);
  EXPECT_THROW(make_image(program(), "", {}), ImageError);
  EXPECT_THROW(make_image(program(), "a name of sixteen", {}), ImageError);
  EXPECT_THROW(make_image({0x7F, 'E', 'L', 'F', 1}, "board", {}), ImageError);
  EXPECT_EQ(version_of("12.255"), (boot::Version{12, 255}));
  for (const char* text : {"", "1", "1.", ".1", "1.256", "-1.0", "1.2.3", "1.x", " 1.2"})
    EXPECT_THROW(version_of(text), ImageError) << text;
}

TEST(FirmwareUpdate, AnImageThatFailsItsTrialAfterTheFirstAnswerIsSeen) {
  std::optional<boot::Version> runs = boot::Version{1, 2};
  const auto look = [&] { return runs; };
  EXPECT_EQ(text_of(*version_after_trial(look, [&] { runs = boot::Version{1, 1}; })), "1.1");
  EXPECT_EQ(text_of(*version_after_trial(look, [] {})), "1.1");
  EXPECT_FALSE(version_after_trial(look, [&] { runs.reset(); }));
  EXPECT_FALSE(version_after_trial(look, [] { FAIL() << "there is no trial to wait for"; }));
}

}  // namespace
}  // namespace flexspline::firmware_files::firmware_image_test
