// host/input/data: MAT files that were cut short or damaged end in a message or in numbers, never in a crash or without
// end.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>

#include "host/input/data/contents_guard.hpp"
#include "host/input/data/mat5_check.hpp"
#include "tests/unit/data_mat_writer.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_mat_damage_test {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string fixture(const char* name) {
  return bytes_of(fs::path(FLEXSPLINE_SOURCE_DIR) / "tests/unit/fixtures" / name);
}

std::string written(const TestFolder& folder, MatFormat format) {
  std::vector<double> values(60);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = 0.1 * static_cast<double>(k);
  const fs::path file = folder.path() / "written.mat";
  write_mat(file, format,
            {mat_vector("time_s", values),
             mat_vector("log.iq", values),
             mat_vector("log.q", values),
             {"data", {20, 3}, values}});
  return bytes_of(file);
}

// Some bytes changed: to any, one bit turned, or to those that sizes and counts fear.
std::string damaged(std::string bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  for (std::size_t i = 0, n = 1 + below(3); i < n; ++i) {
    char& c = bytes[below(bytes.size())];
    switch (below(4)) {
      case 0:
        c = static_cast<char>(below(256));
        break;
      case 1:
        c = static_cast<char>(c ^ 1 << below(8));
        break;
      case 2:
        c = '\xFF';
        break;
      default:
        c = '\0';
    }
  }
  if (below(4) == 0) bytes.resize(below(bytes.size()));
  return bytes;
}

TEST(MatDamage, AFileCutShortAnywhereIsRefused) {
  const TestFolder folder;
  const auto expect_refused = [&](const std::string& bytes, std::size_t size) {
    const std::vector<Finding> errors = errors_of({folder.write("cut.mat", bytes.substr(0, size))});
    ASSERT_EQ(errors.size(), 1u) << size;
    EXPECT_EQ(errors[0].kind, size == 0 ? "header" : "format") << errors[0].text();
    EXPECT_FALSE(errors[0].remedy.empty());
  };
  for (const char* name : {"scipy_plain.mat", "scipy_packed.mat"}) {
    const std::string whole = fixture(name);
    for (std::size_t size = 0; size < whole.size(); size += 173) expect_refused(whole, size == 0 ? 0 : size + 1);
  }
  for (const MatFormat format : {MatFormat::v7_3, MatFormat::v7_3_packed}) {
    const std::string whole = written(folder, format);
    for (std::size_t part = 0; part < 16; ++part) expect_refused(whole, whole.size() * part / 16);
  }
}

// The check by itself, which is our own code and runs on every file of version 5: many more cases.
TEST(MatDamage, TheCheckOfVersion5WithstandsAnyByte) {
  const std::string whole = fixture("scipy_packed.mat");
  EXPECT_EQ(damage_of_mat5(whole), "");
  std::size_t overlooked = 0;
  for (std::size_t at = 128; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 1 << at % 8);
    if (damage_of_mat5(bytes).empty()) ++overlooked;
  }
  EXPECT_LE(overlooked, 11u);  // checksums cover all but the spare bits at the ends of 11 variables, which mean nothing
  std::mt19937 random(1);
  const std::string plain = fixture("scipy_plain.mat");
  std::size_t refused = 0;
  for (int i = 0; i < 2000; ++i) refused += damage_of_mat5(damaged(plain, random)).empty() ? 0 : 1;
  EXPECT_GT(refused, 500u);
  EXPECT_LT(refused, 2000u);  // among numbers it cannot be seen
}

TEST(MatDamage, DamagedFilesEndInAMessageOrInNumbersOfTheSizeThatTheyState) {
  const TestFolder folder;
  std::mt19937 random(2);
  std::size_t failures = 0, reads = 0;
  for (const std::string& whole : {fixture("scipy_plain.mat"), fixture("scipy_packed.mat"),
                                   written(folder, MatFormat::v7_3), written(folder, MatFormat::v7_3_packed)}) {
    const FileFormat format = format_of(folder.write("a.mat", whole));
    EXPECT_EQ(read_contents(folder.path() / "a.mat", format).failure, "");
    for (int i = 0; i < 20; ++i) {
      const FileContents contents = read_contents(folder.write("a.mat", damaged(whole, random)), format);
      ++(contents.failure.empty() ? reads : failures);
      for (const NamedArray& array : contents.arrays) {
        std::size_t count = 1;
        for (const std::size_t d : array.dims) count *= d;
        ASSERT_EQ(array.values.size(), count);
      }
    }
  }
  EXPECT_GT(failures, 10u);
  EXPECT_GT(reads, 10u);
}

// Sizes near what 32 bits can say, which overflow in sums and products; matio believes them.
TEST(MatDamage, SizesThatCannotBeAreRefused) {
  const std::string plain = fixture("scipy_plain.mat");
  for (std::size_t at = 128; at + 4 <= plain.size() && at < 600; at += 4) {
    for (const char* word : {"\xFF\xFF\xFF\x7F", "\xFF\xFF\xFF\xFF", "\xF0\xFF\xFF\x0F"}) {
      std::string bytes = plain;
      std::copy(word, word + 4, bytes.begin() + static_cast<std::ptrdiff_t>(at));
      damage_of_mat5(bytes);
    }
  }
  std::string bytes = plain;
  std::copy_n("\xFF\xFF\xFF\x7F", 4, bytes.begin() + 132);  // the size of the first variable
  EXPECT_NE(damage_of_mat5(bytes), "");
  bytes = plain;
  std::copy_n("\xFF\xFF\xFF\x7F", 4, bytes.begin() + 160);  // its rows
  EXPECT_NE(damage_of_mat5(bytes), "");
}

}  // namespace
}  // namespace flexspline::data::data_mat_damage_test
