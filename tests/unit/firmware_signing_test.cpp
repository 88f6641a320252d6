// Firmware images are signed by the host and checked as on a drive; keys as files.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "host/drive_link/firmware/signing.hpp"
#include "shared/boot/development_key.hpp"

namespace flexspline::firmware_files::firmware_signing_test {
namespace {

namespace fs = std::filesystem;

Bytes image_of(std::size_t bytes) {
  Bytes program(bytes);
  for (std::size_t i = 0; i < program.size(); ++i) program[i] = static_cast<std::uint8_t>(i * 11);
  return make_image(program, "board", {1, 2});
}
bool is_signed(const Bytes& image, const ed25519::PublicKey& key) {
  boot::ImageHeader header;
  if (boot::read_image(image, header) != boot::ImageFinding::none) return false;
  ed25519::Verification verification(key, header.signature);
  boot::each_signed_part(image, [&](std::span<const std::uint8_t> part) { verification.add(part); });
  return header.signature_kind == boot::SignatureKind::ed25519 && verification.is_valid();
}

class Folder : public ::testing::Test {
 protected:
  Folder() {
    char name[] = "/tmp/flexspline-keys-XXXXXX";
    path_ = mkdtemp(name);
  }
  ~Folder() override { fs::remove_all(path_); }
  fs::path file(const char* name) const { return path_ / name; }
  std::string refusal(const char* name) const {
    try {
      load_key_pair(file(name));
    } catch (const ImageError& error) {
      return error.what();
    }
    return {};
  }
  void write(const char* name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    chmod(file(name).c_str(), 0600);
  }
  std::string read(const char* name) const {
    std::ifstream in(file(name));
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

 private:
  fs::path path_;
};
using FirmwareKeys = Folder;

TEST(FirmwareSigning, ASignedImageIsTakenByItsKeyAloneAndStaysAnImage) {
  const KeyPair key = new_key_pair(), other = new_key_pair();
  EXPECT_NE(key.public_key(), other.public_key());
  Bytes image = image_of(1000);
  EXPECT_FALSE(is_signed(image, key.public_key())) << "not signed yet";
  key.sign(image, 7);
  EXPECT_TRUE(is_signed(image, key.public_key()));
  EXPECT_FALSE(is_signed(image, other.public_key()));
  EXPECT_FALSE(is_signed(image, boot::kDevelopmentKey));
  const Image read = parse_image(image, "x.image");
  EXPECT_EQ(read.header.security_counter, 7);
  EXPECT_EQ(read.header.signature_kind, boot::SignatureKind::ed25519);
  EXPECT_EQ(text_of(read.header.version), "1.2");
  other.sign(image, 8);
  EXPECT_TRUE(is_signed(image, other.public_key())) << "another signature replaces the first";
}

// Header and program: whoever changes them makes the checksums fit.
TEST(FirmwareSigning, TheSignatureCoversBoardVersionCounterAndProgram) {
  const KeyPair key = development_key_pair();
  Bytes image = image_of(100);
  key.sign(image, 3);
  const auto changed = [&](auto change) {
    Bytes bytes = image;
    boot::ImageHeader header;
    EXPECT_EQ(boot::read_image(bytes, header), boot::ImageFinding::none);
    change(header, bytes);
    header.crc = model::crc32(std::span(bytes).subspan(boot::kHeaderBytes));
    boot::write_header(std::span<std::uint8_t, boot::kHeaderBytes>(bytes.data(), boot::kHeaderBytes), header);
    return bytes;
  };
  const auto& good = key.public_key();
  EXPECT_TRUE(is_signed(changed([](boot::ImageHeader&, Bytes&) {}), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader& h, Bytes&) { h.board = boot::board_bytes("other"); }), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader& h, Bytes&) { h.version.major = 9; }), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader& h, Bytes&) { h.security_counter = 4; }), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader& h, Bytes&) { h.signature[5] ^= 1; }), good));
  EXPECT_FALSE(
      is_signed(changed([](boot::ImageHeader& h, Bytes&) { h.signature_kind = boot::SignatureKind::none; }), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader&, Bytes& b) { b[boot::kHeaderBytes] ^= 1; }), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader&, Bytes& b) { b.back() ^= 0x80; }), good));
  EXPECT_FALSE(is_signed(changed([](boot::ImageHeader& h, Bytes& b) {
                           b.pop_back();
                           --h.bytes;
                         }),
                         good));
}

TEST(FirmwareSigning, OnlyWholeImagesAreSigned) {
  const KeyPair key = development_key_pair();
  Bytes image = image_of(100);
  image.push_back(0);
  EXPECT_THROW(key.sign(image, 0), ImageError);
  image.resize(200);
  EXPECT_THROW(key.sign(image, 0), ImageError);
}

TEST_F(FirmwareKeys, AKeyIsReadBackAndItsFileIsForItsOwnerAlone) {
  const mode_t before = umask(0);
  const KeyPair key = new_key_pair();
  key.save(file("a.key"));
  umask(before);
  struct stat info {};
  ASSERT_EQ(stat(file("a.key").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 07777, 0600U);
  EXPECT_EQ(load_key_pair(file("a.key")).public_key(), key.public_key());
  EXPECT_THROW(new_key_pair().save(file("a.key")), ImageError) << "never overwritten";
  EXPECT_EQ(load_key_pair(file("a.key")).public_key(), key.public_key());
}

TEST_F(FirmwareKeys, WhatIsNoKeyOrOthersMayReadIsRefused) {
  new_key_pair().save(file("a.key"));
  const std::string good = read("a.key");
  EXPECT_NE(refusal("none.key").find("cannot be read"), std::string::npos);
  write("text.key", "hello");
  EXPECT_NE(refusal("text.key").find("is not a file of keys"), std::string::npos);
  write("short.key", R"({"format": "flexspline-signing-key/1", "public": "", "secret": "00"})");
  EXPECT_NE(refusal("short.key").find("64 hexadecimal digits"), std::string::npos);
  std::string other = good;
  char& digit = other[other.find("public") + 12];
  digit = digit == '0' ? '1' : '0';
  write("other.key", other);
  EXPECT_NE(refusal("other.key").find("does not belong"), std::string::npos);
  chmod(file("a.key").c_str(), 0640);
  EXPECT_NE(refusal("a.key").find("others may read"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::firmware_files::firmware_signing_test
