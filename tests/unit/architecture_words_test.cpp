// Architecture test of the project's words: terms of the textbooks instead of private words, in names, comments,
// messages and documents. The replacement is in the message. CONTRIBUTING.md has the rule.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::architecture_words_test {
namespace {

namespace fs = std::filesystem;

struct Word {
  std::string_view word, use;
};

// Lower case, parts of a name separated by spaces.
constexpr Word kWords[] = {
    {"nought", "zero"},
    {"noughts", "zeros"},
    {"brain", "controller"},
    {"contender", "effect hypothesis, or candidate"},
    {"contenders", "effect hypotheses, or candidates"},
    {"contest", "comparison of hypotheses"},
    {"testimony", "evidence"},
    {"told by", "identifiable from, or identified on"},
    {"told apart", "distinguished"},
    {"lock step", "co-simulation"},
    {"house test", "architecture test"},
    {"to be had", "available, or \"cannot be read\""},
    {"halvings", "exponent of two"},
    {"surer", "significance checks"},
    {"imitation", "projection residual"},
    {"own share", "tolerance, or variance inflation factor"},
    {"own part", "orthogonal part"},
    {"held torque", "zero-order-hold correction"},
    {"may give up", "cancellation check"},
    {"spoilt", "corrupted"},
    {"knock", "request origin"},
    {"doubts", "significance checks"},
    {"verifying", "checked"},
    {"trusting", "unchecked"},
    {"giving up", "cancellation token"},
};

// The text in lower case with the parts of names separated: kHeldTorque, held_torque and held-torque become "held
// torque".
std::string separated(std::string_view text) {
  std::string words = " ";
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool is_letter = std::isalnum(c) != 0;
    if (std::isupper(c) != 0 && i > 0 && std::islower(static_cast<unsigned char>(text[i - 1])) != 0) words += ' ';
    words += is_letter ? static_cast<char>(std::tolower(c)) : ' ';
  }
  return words + ' ';
}

// "path:line: says "word"; use ..." for each line of `text` that has a word of the list.
std::vector<std::string> private_words(const std::string& path, std::string_view text) {
  std::vector<std::string> found;
  long line = 1;
  for (std::size_t start = 0; start < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string words = separated(text.substr(start, end - start));
    for (const Word& w : kWords)
      if (words.find(' ' + std::string(w.word) + ' ') != std::string::npos)
        found.push_back(path + ":" + std::to_string(line) + ": says \"" + std::string(w.word) + "\"; use " +
                        std::string(w.use));
    start = end + 1;
  }
  return found;
}

// A heading says what a page is about: "beside" says only that there is a second thing.
std::vector<std::string> vague_headings(const std::string& path, std::string_view text) {
  std::vector<std::string> found;
  long line = 1;
  for (std::size_t start = 0; start < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string_view heading = text.substr(start, end - start);
    if (heading.starts_with('#') && separated(heading).find(" beside ") != std::string::npos)
      found.push_back(path + ":" + std::to_string(line) + ": a heading with \"beside\"; use \"compared with\"");
    start = end + 1;
  }
  return found;
}

bool is_ours(const fs::path& path) {
  static constexpr std::string_view kEndings[] = {".hpp", ".cpp", ".h",   ".c",     ".md",   ".py",
                                                  ".sh",  ".ts",  ".mjs", ".cmake", ".toml", ".txt"};
  return path.filename() != "architecture_words_test.cpp" &&
         std::any_of(std::begin(kEndings), std::end(kEndings),
                     [&](std::string_view ending) { return path.extension() == ending; });
}

template <class Rule>
std::string violations(const Rule& rule) {
  std::string all;
  const fs::path root = FLEXSPLINE_SOURCE_DIR;
  const auto look_at = [&](const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    for (const std::string& v : rule(path.lexically_relative(root).generic_string(), text)) all += "\n  " + v;
  };
  for (const char* name : {"dev", "README.md", "CONTRIBUTING.md", "CMakeLists.txt"}) look_at(root / name);
  for (const char* folder : {"shared", "firmware", "boards", "hil", "host", "tests"})
    for (auto entry = fs::recursive_directory_iterator(root / folder); entry != fs::recursive_directory_iterator();
         ++entry) {
      if (entry->path().filename() == "node_modules" || entry->path().filename() == "built")
        entry.disable_recursion_pending();
      if (entry->is_regular_file() && is_ours(entry->path())) look_at(entry->path());
    }
  return all;
}

TEST(ArchitectureWords, AreThoseOfTheTextbooks) {
  EXPECT_EQ(violations(private_words), "");
}

TEST(ArchitectureWords, HeadingsSayWhatIsComparedWithWhat) {
  EXPECT_EQ(violations([](const std::string& path, std::string_view text) {
              return path.ends_with(".md") ? vague_headings(path, text) : std::vector<std::string>{};
            }),
            "");
}

TEST(ArchitectureWords, APrivateWordIsFoundInNamesCommentsAndTextWithItsReplacement) {
  const std::string found = "host/a.cpp:2: says \"nought\"; use zero";
  EXPECT_EQ(private_words("host/a.cpp", "int a;\ndouble at_nought_rad = 1;\n"), std::vector{found});
  EXPECT_EQ(private_words("host/a.cpp", "\ndouble atNoughtRad;"), std::vector{found});
  EXPECT_EQ(private_words("host/a.cpp", "\nIs it Nought?\n"), std::vector{found});
  EXPECT_EQ(private_words("host/a.cpp", "told-by, kLockStep\n").size(), 2u);
}

TEST(ArchitectureWords, PartsOfOtherWordsAreNoViolation) {
  EXPECT_TRUE(private_words("a.md", "contestant, brainstorm, knockout; as told. By the way: zero").empty());
}

TEST(ArchitectureWords, AHeadingWithBesideIsFound) {
  EXPECT_EQ(vague_headings("a.md", "text beside\n## Speed beside NumPy\n"),
            std::vector{std::string("a.md:2: a heading with \"beside\"; use \"compared with\"")});
}

}  // namespace
}  // namespace flexspline::architecture_words_test
