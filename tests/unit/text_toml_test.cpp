// host/common/text: TOML as a tree with positions, the nearest name, signs of units.
#include <gtest/gtest.h>

#include <array>

#include <string>
#include <string_view>

#include "host/common/text/nearest.hpp"
#include "host/common/text/shortened.hpp"
#include "host/common/text/toml.hpp"
#include "host/common/text/unit_signs.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::text::text_toml_test {
namespace {

std::string_view at(std::string_view text, Span span) {
  return text.substr(span.begin, span.end - span.begin);
}

// Line of the error, 0 where there is none.
std::size_t error_line(std::string_view text) {
  try {
    parse_toml(text);
  } catch (const TomlError& error) {
    EXPECT_FALSE(error.remedy().empty());
    EXPECT_FALSE(std::string_view(error.what()).empty());
    return error.line();
  }
  return 0;
}

TEST(Toml, SpansAreBytesAlsoBehindLettersOfSeveral) {
  const std::string text = "\xEF\xBB\xBF# \u00B5\na = \"\u20AC\"\n[t]\n\"\u00E4\" = [1, 2.5] # \u00E4\n";
  const Node root = parse_toml(text);
  EXPECT_EQ(at(text, root.find("a")->span), "\"\u20AC\"");
  EXPECT_EQ(root.find("a")->line, 2u);
  const Node* table = root.find("t");
  EXPECT_TRUE(table->has_header);
  const Entry* entry = table->entry("\u00E4");
  ASSERT_NE(entry, nullptr);
  EXPECT_EQ(at(text, entry->key_span), "\"\u00E4\"");
  EXPECT_EQ(at(text, entry->value.span), "[1, 2.5]");
  EXPECT_EQ(entry->value.items.at(1).number, 2.5);
}

TEST(Toml, EntriesStandInTheOrderOfTheText) {
  const Node root = parse_toml("z = 1\nb = 2\na = 3\n");
  ASSERT_EQ(root.entries.size(), 3u);
  EXPECT_EQ(root.entries[0].key, "z");
  EXPECT_EQ(root.entries[2].key, "a");
}

TEST(Toml, HeadersWithoutANameAreErrorsWithTheirLine) {
  for (const std::string header : {"[.x]", "[[.x]]", "[[[x]", "[ ", "[", "[]", "[[", "[#]", "[ [x]]", "  [.x]\r"})
    EXPECT_EQ(error_line("a = 1\n" + header + "\n"), 2u) << header;
}

TEST(Toml, BracketsInsideValuesAreNoHeaders) {
  EXPECT_EQ(error_line("a = [\n  [1],\n  [ # c ] [\n  ],\n[{ b = 1 }],\n[\n[]]\n]\n[x]\n"), 0u);
  EXPECT_EQ(error_line("a = \"\"\"\n[.x]\n\u00B5\"\"\"\nb = '[.x]'\n# [.x]\n"), 0u);
  EXPECT_EQ(error_line("[\"a]b\"]\nc = 1\n['\u00E4']\n"), 0u);
}

TEST(Toml, AMessageQuotesTheBeginningOfALongLine) {
  try {
    parse_toml("[`" + std::string(500, 'x') + "]\n");
    ADD_FAILURE() << "no error";
  } catch (const TomlError& error) {
    EXPECT_EQ(std::string(error.what()),
              "no name follows the bracket in [`" + std::string(58, 'x') + "... (443 more characters)");
  }
}

TEST(Toml, LettersBeyondAsciiOutsideQuotesAreErrorsWithTheirLine) {
  for (const std::string letter : {"\u00A1", "\u00B2", "\u00E4", "\u00D7", "\u03BC", "\u4E2D", "\u2028", "\xFF"}) {
    EXPECT_EQ(error_line("a = 1\n" + letter + " = 2\n"), 2u) << letter;
    EXPECT_EQ(error_line("a = 1" + letter + "\n"), 1u) << letter;
    EXPECT_EQ(error_line("a = 1\n[" + letter + "]\n"), 2u) << letter;
    EXPECT_EQ(error_line("a = 1\"" + letter + "\"\n"), 1u) << letter;
  }
}

TEST(Nearest, AllowsAThirdOfTheWord) {
  EXPECT_EQ(nearest("gear_ration", {"gear_ratio", "pitch_m"}), "gear_ratio");
  EXPECT_EQ(nearest("sdx", {"std"}), "");
  EXPECT_EQ(nearest("sdx", {"std"}, 2), "std");
  EXPECT_EQ(nearest("ab", {"xb", "ax"}), "xb");
  EXPECT_EQ(nearest("", {"abc"}), "");
}

TEST(Nearest, TwoNeighboursThatChangedPlacesAreOneEdit) {
  EXPECT_EQ(nearest("inof", {"info", "plan"}), "info");
  EXPECT_EQ(nearest("palns", {"plant", "plane", "plans"}), "plans");
  EXPECT_EQ(nearest("ca", {"abc"}), "") << "no letter is edited twice: three edits, not two";
  EXPECT_EQ(nearest("ca", {"abc"}, 2), "");
  EXPECT_EQ(nearest("ca", {"abc"}, 3), "abc");
}

TEST(Nearest, FirstWordsCountOnlyWhereNoWholeNameIsNear) {
  constexpr std::array<std::string_view, 3> kKnown = {"stribeck_gaussian", "gravity", "stiffness_linear"};
  EXPECT_EQ(nearest_or_first_words("stribek", kKnown), "stribeck_gaussian");
  EXPECT_EQ(nearest_or_first_words("gravty", kKnown), "gravity");
  EXPECT_EQ(nearest_or_first_words("backlash", kKnown), "");
  EXPECT_EQ(nearest("stribek", kKnown), "");
}

TEST(Toml, ANumberThatRunsIntoQuotesBeyondAsciiIsAnError) {
  // The reader looks ahead from the number into what follows it.
  for (const std::string text : {"a = 0b=\"\u00e9\"\n", "a = [\n0b=\"\u00e9\"]\n", "a = {b=0c=\"\u00e9\"}\n"})
    EXPECT_THROW(parse_toml(text), TomlError) << text;
  EXPECT_EQ(error_line("a = 1\nb = 0\x01 c=\"\uFDFF\"\n"), 2u);
  for (const std::string text :
       {"a=\"\u00e9\"\nb.c=\"\u00e9\"\n", "d={e=\"\u00e9\",f=\"\u00e9\"}\n", "\"\u00e9\"=\"\u00e9\"\n",
        "\"a:b\"='\u00e9'\n", "g=[\"\u00e9\",\n\"\u00e9\",{h=\"\u00e9\"}]\n", "[x]\r\ni=\"\u00e9\"\r\n"})
    EXPECT_NO_THROW(parse_toml(text)) << text;
}

TEST(Shortened, IsCutBetweenCharacters) {
  const std::string text = "\u00e4\u00f6\u00fcabc\u20ac";
  EXPECT_EQ(beginning_of(text, 3), "\u00e4");
  EXPECT_EQ(beginning_of(text, 4), "\u00e4\u00f6");
  EXPECT_EQ(ending_of(text, 5), "bc\u20ac");
  EXPECT_EQ(ending_of(text, 2), "");
  EXPECT_EQ(beginning_of("abc", 3), "abc");
  EXPECT_EQ(ending_of("abc", 4), "abc");
  EXPECT_EQ(shortened(text, 3), "\u00e4... (10 more characters)");
}

TEST(UnitSigns, BecomeAsciiAndAllElseStays) {
  EXPECT_EQ(unit_in_ascii("kg\u00B7m\u00B2"), "kg*m^2");
  EXPECT_EQ(unit_in_ascii("1/\u00B0C"), "1/degC");
  EXPECT_EQ(unit_in_ascii("\u00B5m"), unit_in_ascii("\u03BCm"));
  EXPECT_EQ(unit_in_ascii("A\u207B\u00B9"), "A-1");
  EXPECT_EQ(unit_in_ascii("\u20AC m"), "\u20AC m");
}

TEST(DatasetToml, BrokenOrUnreadableFilesAreErrorsWithTheirLine) {
  const data::TestFolder folder;
  folder.write("run.csv", data::good_csv(100));
  for (const std::string text : {"a = 1\n\u00E4 = 2\n", "a = 1\nb = \n", "a = 1\nb = 1\"\u00E4\"\n",
                                 "a = 1\nb = 2e{c=\"\uFDFF\"\n", "a = 1\n[.x]\n"}) {
    folder.write("dataset.toml", text);
    const auto errors = data::errors_of({folder.path()});
    ASSERT_EQ(errors.size(), 1u) << text;
    EXPECT_EQ(errors[0].kind, "format");
    EXPECT_EQ(errors[0].line, 2u) << errors[0].text();
  }
  const data::TestFolder other;
  std::filesystem::create_directory(other.path() / "dataset.toml");
  for (const std::string name : {"dataset.toml", "absent/dataset.toml"}) {
    const auto errors = data::errors_of({other.path() / name});
    ASSERT_EQ(errors.size(), 1u) << name;
    EXPECT_EQ(errors[0].kind, "file");
  }
}

}  // namespace
}  // namespace flexspline::text::text_toml_test
