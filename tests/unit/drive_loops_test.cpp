// No loop without a bound in code that a drive runs: `for` goes over sizes that are known; each `while` is listed here
// with its bound.
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace flexspline::drive_loops_test {
namespace {

namespace fs = std::filesystem;

struct Bounded {
  const char* condition;  // how it begins
  const char* bound;
};
constexpr Bounded kBounded[] = {
    {"c.points < kMostPoints", "points of a table, at most 256"},
    {"slot < kSlotsEnd", "slots of a sector, as slot grows by two"},
    {"open_.code < most", "frames of a message, as code grows by one"},
    {"reports_.room() > 0 && service_.next(m)", "places of a queue, as each turn takes one"},
    {"n < kBoardBytes", "bytes of a board's name"},
    {"!waits_ && line_.receive(byte)", "bytes that a line has received; background work"},
    {"line_.room() >= protocol::kMostSerial && service_.next(m)", "room of a line, as each turn takes some"},
};

// "for (;;)", "do {" and each "while (...)" that is not listed.
std::vector<std::string> unbounded(const std::string& text) {
  const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  std::vector<std::string> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = line.substr(0, line.find("//"));
    for (const std::string word : {"while", "for", "do"})
      for (std::size_t at = 0; (at = line.find(word, at)) != std::string::npos; at += word.size()) {
        if (at > 0 && is_word(line[at - 1])) continue;
        std::size_t next = line.find_first_not_of(' ', at + word.size());
        if (next == std::string::npos || (next == at + word.size() && is_word(line[next]))) continue;
        const std::string rest = line.substr(next);
        bool endless = (word == "do" && rest.starts_with("{")) || (word == "for" && rest.starts_with("(;;"));
        if (word == "while" && rest.starts_with("(")) {
          endless = true;
          for (const Bounded& known : kBounded) endless = endless && !rest.substr(1).starts_with(known.condition);
        }
        if (endless) found.push_back(line.substr(at));
      }
  }
  return found;
}

TEST(DriveLoops, HaveBounds) {
  int files = 0;
  for (const char* folder : {"shared", "firmware"})
    for (const fs::directory_entry& entry :
         fs::recursive_directory_iterator(fs::path(FLEXSPLINE_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".hpp" && entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path(), std::ios::binary);
      for (const std::string& loop : unbounded({std::istreambuf_iterator<char>(in), {}}))
        ADD_FAILURE() << entry.path() << ": \"" << loop
                      << "\" may run without end; make it a for over a known size, or "
                      << "list it with its bound in " << __FILE__;
      ++files;
    }
  EXPECT_GT(files, 50);
}

TEST(DriveLoops, TheRuleFindsThoseThatHaveNone) {
  EXPECT_EQ(unbounded("for (;;) x();\ndo { y(); } while (z);").size(), 3u);
  EXPECT_EQ(unbounded("while (true) x();").size(), 1u);
  EXPECT_TRUE(unbounded("// while (true)\nfor (int i = 0; i < 5; ++i) x();").empty());
}

}  // namespace
}  // namespace flexspline::drive_loops_test
