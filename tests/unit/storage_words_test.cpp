// Bytes as words of a flash memory.
#include "shared/storage/words.hpp"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

namespace flexspline::storage::storage_words_test {
namespace {

using Words = std::vector<std::pair<std::size_t, std::uint32_t>>;

Words words_of(std::span<const std::uint8_t> bytes) {
  Words words;
  EXPECT_TRUE(for_each_word(bytes, [&](std::size_t number, std::uint32_t word) {
    words.emplace_back(number, word);
    return true;
  }));
  return words;
}

TEST(StorageWords, AreLittleEndianAndTheLastIsFilledWithOnes) {
  EXPECT_EQ(words_of({}), Words{});
  EXPECT_EQ(words_of(std::array<std::uint8_t, 4>{1, 2, 3, 4}), (Words{{0, 0x04030201}}));
  EXPECT_EQ(words_of(std::array<std::uint8_t, 6>{1, 2, 3, 4, 5, 6}), (Words{{0, 0x04030201}, {1, 0xFFFF0605}}));
}

TEST(StorageWords, NoneFollowsOneThatCouldNotBeWritten) {
  int calls = 0;
  EXPECT_FALSE(for_each_word(std::array<std::uint8_t, 12>{}, [&](std::size_t, std::uint32_t) { return ++calls < 2; }));
  EXPECT_EQ(calls, 2);
}

TEST(StorageWords, ABlankMemoryHasOnesAlone) {
  std::array<std::uint8_t, 5> bytes;
  bytes.fill(0xFF);
  EXPECT_TRUE(is_blank(bytes));
  bytes[4] = 0xFE;
  EXPECT_FALSE(is_blank(bytes));
}

}  // namespace
}  // namespace flexspline::storage::storage_words_test
