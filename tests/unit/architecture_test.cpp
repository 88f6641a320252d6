// Keeps the rules of the architecture: who may include whom, what shared/ may use, where heavy headers stand.
// Each rule is a function over source texts, so that it is also tried on made-up texts that break it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/unit/architecture_source.hpp"

namespace flexspline::architecture_test {
namespace {

using architecture::code_only;
using architecture::is_word;
using architecture::kTopFolders;
using architecture::project_files;
using architecture::SourceFile;
namespace fs = std::filesystem;

using Violations = std::vector<std::string>;

constexpr long kMaxLines = 500;
// Folders of tests/ whose files are compiled together (tests/CMakeLists.txt).
const std::set<std::string> kTogether = {"unit", "cli", "campaign", "report"};

const std::map<std::string, std::set<std::string>, std::less<>> kMayInclude = {
    {"shared", {"shared"}},
    {"firmware", {"firmware", "shared"}},
    {"boards", {"boards", "firmware", "shared"}},
    {"hil", {"hil", "firmware", "shared"}},
    {"host", {"host", "shared"}},
    {"tests", {"shared", "firmware", "boards", "hil", "host", "tests"}},
};

// The groups of host/, from the bottom up: a file includes its own group and those before it.
constexpr std::array<std::string_view, 7> kHostGroups = {"common", "input",      "physics", "engine",
                                                         "output", "drive_link", "app"};

// Headers that need neither heap nor floating point nor an operating system.
const std::set<std::string, std::less<>> kFreestandingHeaders = {
    "array",  "bit",  "climits",     "compare", "concepts",    "cstddef", "cstdint", "cstring", "initializer_list",
    "limits", "span", "string_view", "tuple",   "type_traits", "utility", "version"};

// Each costs many seconds a file under sanitizers, so each stands in one file of the folders that need it.
const std::map<std::string, std::set<std::string>, std::less<>> kHeavyHeaders = {
    {"toml++/toml.hpp", {"host", "hil"}}, {"toml++/toml.h", {"host", "hil"}},     {"CLI/CLI.hpp", {"host", "hil"}},
    {"ceres/ceres.h", {"host"}},          {"matio.h", {"host", "tests"}},         {"hdf5.h", {"host", "tests"}},
    {"sqlite3.h", {"host", "tests"}},     {"hidapi/hidapi.h", {"host", "tests"}}, {"httplib.h", {"host"}},
    {"libusb-1.0/libusb.h", {"host"}},
};

std::string top_folder(std::string_view path) {
  return std::string(path.substr(0, path.find('/')));
}

bool ends_with_any(std::string_view path, std::initializer_list<std::string_view> endings) {
  return std::any_of(endings.begin(), endings.end(), [&](std::string_view end) { return path.ends_with(end); });
}

bool is_cpp(std::string_view path) {
  return ends_with_any(path, {".hpp", ".cpp", ".h", ".c"});
}
bool is_header(std::string_view path) {
  return ends_with_any(path, {".hpp", ".h"});
}

struct Line {
  long number;
  std::string_view text;
};

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    lines.push_back({static_cast<long>(lines.size()) + 1, text.substr(start, end - start)});
    start = end + 1;
  }
  return lines;
}

std::string place(const SourceFile& file, long line) {
  return file.path + ":" + std::to_string(line) + ": ";
}

struct Include {
  long line;
  char kind;  // '"' or '<'; '?' for a name that is computed by a macro
  std::string name;
};

std::vector<Include> includes_of(const SourceFile& file) {
  std::vector<Include> includes;
  const std::string code = code_only(file.text);
  for (const Line& line : lines_of(code)) {
    const std::size_t hash = line.text.find_first_not_of(" \t");
    if (hash == std::string_view::npos || line.text[hash] != '#') continue;
    const std::size_t word = line.text.find_first_not_of(" \t", hash + 1);
    if (word == std::string_view::npos || !line.text.substr(word).starts_with("include")) continue;
    const std::size_t open = line.text.find_first_of("\"<", word);
    const std::size_t close = open == std::string_view::npos ? open : line.text.find_first_of("\">", open + 1);
    if (close == std::string_view::npos) {
      includes.push_back({line.number, '?', std::string(line.text)});
    } else {
      includes.push_back({line.number, line.text[open], std::string(line.text.substr(open + 1, close - open - 1))});
    }
  }
  return includes;
}

Violations broken_arrows(const std::vector<SourceFile>& files) {
  Violations found;
  for (const SourceFile& file : files) {
    const std::string folder = top_folder(file.path);
    const auto rule = kMayInclude.find(folder);
    if (!is_cpp(file.path) || rule == kMayInclude.end()) continue;
    for (const Include& include : includes_of(file)) {
      const std::string target = top_folder(include.name);
      const bool ours = include.name.find('/') != std::string::npos && kMayInclude.contains(target);
      const bool climbs = include.name.find("..") != std::string::npos;
      if (include.kind == '?' || climbs || (include.kind == '"' && !ours)) {
        found.push_back(place(file, include.line) + "includes " + include.name +
                        "; write our own headers as \"folder/...\" from the project's root, others as <...>");
      } else if (ours && !rule->second.contains(target)) {
        found.push_back(place(file, include.line) + folder + " may not include " + target + " (" + include.name + ")");
      } else if (!ours && folder == "shared" && !kFreestandingHeaders.contains(include.name)) {
        found.push_back(place(file, include.line) + "shared may not include <" + include.name + ">");
      }
    }
  }
  return found;
}

// A board's image is built anew where its own folder changes, or one of these (boards/CMakeLists.txt).
Violations boards_of_others(const std::vector<SourceFile>& files) {
  const auto board_of = [](std::string_view path) {
    const std::string_view inside = path.substr(path.find('/') + 1);
    return std::string(inside.substr(0, inside.find('/')));
  };
  Violations found;
  for (const SourceFile& file : files) {
    if (!is_cpp(file.path) || top_folder(file.path) != "boards") continue;
    for (const Include& include : includes_of(file)) {
      if (top_folder(include.name) != "boards") continue;
      const std::string board = board_of(include.name);
      if (board != board_of(file.path) && board != "stm32f4" && board != "cortex_m4")
        found.push_back(place(file, include.line) + "includes another board's " + include.name +
                        "; what boards share is in stm32f4 and cortex_m4");
    }
  }
  return found;
}

std::size_t host_group(std::string_view path) {
  const std::string_view inside = path.substr(std::min(path.size(), std::string_view("host/").size()));
  const auto group = std::find(kHostGroups.begin(), kHostGroups.end(), inside.substr(0, inside.find('/')));
  return static_cast<std::size_t>(group - kHostGroups.begin());
}

Violations arrows_up_in_host(const std::vector<SourceFile>& files) {
  Violations found;
  for (const SourceFile& file : files) {
    if (!is_cpp(file.path) || !file.path.starts_with("host/") || file.path == "host/main.cpp") continue;
    if (host_group(file.path) == kHostGroups.size()) found.push_back(file.path + ": stands in no group of host/");
    for (const Include& include : includes_of(file))
      if (include.name.starts_with("host/") && host_group(include.name) > host_group(file.path))
        found.push_back(place(file, include.line) + std::string(kHostGroups[host_group(file.path)]) +
                        " stands below what it includes (" + include.name + ")");
  }
  return found;
}

// What shared/ may not use: heap, exceptions, and functions that its number systems have to supply.
Violations forbidden_in_shared(const std::vector<SourceFile>& files) {
  static const std::set<std::string, std::less<>> kWords = {"new", "malloc", "calloc",       "realloc", "throw",
                                                            "try", "catch",  "dynamic_cast", "typeid"};
  static const std::set<std::string, std::less<>> kStd = {
      "vector", "string", "map",  "unordered_map", "set",    "deque", "list",  "function", "unique_ptr", "shared_ptr",
      "abs",    "fabs",   "sin",  "cos",           "tan",    "asin",  "acos",  "atan",     "atan2",      "sinh",
      "cosh",   "tanh",   "exp",  "exp2",          "log",    "log2",  "log10", "pow",      "sqrt",       "cbrt",
      "hypot",  "floor",  "ceil", "round",         "lround", "trunc", "fmod",  "copysign", "isnan",      "isfinite"};
  Violations found;
  for (const SourceFile& file : files) {
    if (!is_cpp(file.path) || top_folder(file.path) != "shared") continue;
    const std::string code = code_only(file.text);
    for (const Line& line : lines_of(code)) {
      const std::size_t first = std::min(line.text.find_first_not_of(" \t"), line.text.size());
      if (line.text.substr(first).starts_with("#include")) continue;  // broken_arrows() judges these
      for (std::size_t i = 0; i < line.text.size();) {
        if (!is_word(line.text[i])) {
          ++i;
          continue;
        }
        const std::size_t start = i;
        while (i < line.text.size() && is_word(line.text[i])) ++i;
        const std::string_view word = line.text.substr(start, i - start);
        const bool in_std = line.text.substr(0, start).ends_with("std::");
        if (in_std ? kStd.contains(word) : kWords.contains(word)) {
          found.push_back(place(file, line.number) + "shared may not use " + (in_std ? "std::" : "") +
                          std::string(word));
        }
      }
    }
  }
  return found;
}

Violations misplaced_heavy_headers(const std::vector<SourceFile>& files) {
  Violations found;
  std::map<std::string, std::string> first_user;  // by top folder and header
  for (const SourceFile& file : files) {
    const std::string folder = top_folder(file.path);
    if (!is_cpp(file.path)) continue;
    for (const Include& include : includes_of(file)) {
      const auto heavy = kHeavyHeaders.find(include.name);
      if (heavy == kHeavyHeaders.end()) continue;
      const std::string what = place(file, include.line) + "heavy header " + include.name;
      if (is_header(file.path)) {
        found.push_back(what + " in a header reaches every file that includes it; include it in a .cpp");
      } else if (!heavy->second.contains(folder)) {
        found.push_back(what + " does not belong in " + folder);
      } else if (const auto [user, is_new] =
                     first_user.try_emplace(folder + " " + include.name.substr(0, include.name.find('/')), file.path);
                 !is_new && user->second != file.path) {
        found.push_back(what + " is already included by " + user->second);
      }
    }
  }
  return found;
}

Violations too_long(const std::vector<SourceFile>& files) {
  Violations found;
  for (const SourceFile& file : files) {
    if (!is_cpp(file.path) && file.path != "dev" && !ends_with_any(file.path, {".js", ".mjs", ".ts", ".css", ".S"}))
      continue;
    const long lines = std::count(file.text.begin(), file.text.end(), '\n');
    if (lines > kMaxLines) {
      found.push_back(file.path + " has " + std::to_string(lines) + " lines, more than " + std::to_string(kMaxLines));
    }
  }
  return found;
}

// Tests of a folder are compiled together, so that what two of them call alike would be defined twice.
Violations tests_without_own_namespace(const std::vector<SourceFile>& files) {
  Violations found;
  for (const SourceFile& file : files) {
    const fs::path path(file.path);
    const std::string stem = path.stem().string();
    const bool is_together = path.begin() != path.end() && *path.begin() == "tests" &&
                             ends_with_any(file.path, {"_test.cpp"}) &&
                             kTogether.contains(path.parent_path().filename().string());
    if (is_together && file.text.find("::" + stem + " {\n") == std::string::npos)
      found.push_back(file.path + " has no namespace of its own: open it with `namespace flexspline::" + stem + " {`");
  }
  return found;
}

Violations developer_paths(const std::vector<SourceFile>& files) {
  // Put together here, so that this file does not break its own rule.
  static const std::array<std::string, 2> kPlaces = {std::string("/") + "work/", std::string("/") + "home/"};
  Violations found;
  for (const SourceFile& file : files) {
    for (const Line& line : lines_of(file.text)) {
      for (const std::string& path : kPlaces) {
        const std::size_t at = line.text.find(path);
        if (at == std::string_view::npos) continue;
        // "tests/work/x" and "./work/x" are relative.
        const char before = at == 0 ? ' ' : line.text[at - 1];
        if (!is_word(before) && before != '.' && before != '-' && before != '}') {
          found.push_back(place(file, line.number) + "names " + path + ", a place on one developer's machine");
        }
      }
    }
  }
  return found;
}

Violations folders_without_readme(const fs::path& root) {
  Violations found;
  for (const std::string_view folder : kTopFolders) {
    if (!fs::is_regular_file(root / folder / "README.md"))
      found.push_back(std::string(folder) + "/README.md is missing");
  }
  return found;
}

std::string listed(const Violations& violations) {
  std::string text;
  for (const std::string& violation : violations) text += "\n  " + violation;
  return text;
}

#define EXPECT_NO_VIOLATION(expression)                    \
  do {                                                     \
    const Violations violations = (expression);            \
    EXPECT_TRUE(violations.empty()) << listed(violations); \
  } while (false)

Violations arrows_of(const std::string& path, const std::string& text) {
  return broken_arrows({{path, text}});
}
Violations shared_rules_of(const std::string& text) {
  return forbidden_in_shared({{"shared/a.hpp", text}});
}

// The rules on the project itself.

TEST(Architecture, IsReadFromTheSourceTree) {
  for (const std::string_view folder : {"shared", "host", "hil", "tests"}) {
    EXPECT_TRUE(std::any_of(project_files().begin(), project_files().end(),
                            [&](const SourceFile& f) { return top_folder(f.path) == folder && is_cpp(f.path); }))
        << folder << " holds no source file";
  }
}

TEST(Architecture, FoldersIncludeOnlyWhatTheyMay) {
  EXPECT_NO_VIOLATION(broken_arrows(project_files()));
}
TEST(Architecture, GroupsOfHostIncludeOnlyWhatStandsBelowThem) {
  EXPECT_NO_VIOLATION(arrows_up_in_host(project_files()));
}
TEST(Architecture, BoardsIncludeNothingOfOtherBoards) {
  EXPECT_NO_VIOLATION(boards_of_others(project_files()));
}
TEST(Architecture, SharedUsesNoHeapNoExceptionsAndNoMathLibrary) {
  EXPECT_NO_VIOLATION(forbidden_in_shared(project_files()));
}
TEST(Architecture, HeavyHeadersStandInOneFileOfAFolder) {
  EXPECT_NO_VIOLATION(misplaced_heavy_headers(project_files()));
}
TEST(Architecture, NoSourceFileOutgrowsAHead) {
  EXPECT_NO_VIOLATION(too_long(project_files()));
}
TEST(Architecture, EachTestFileHasANamespaceOfItsOwn) {
  EXPECT_NO_VIOLATION(tests_without_own_namespace(project_files()));
}
TEST(Architecture, NoFileNamesADeveloperMachine) {
  EXPECT_NO_VIOLATION(developer_paths(project_files()));
}
TEST(Architecture, EveryTopFolderHasAReadme) {
  EXPECT_NO_VIOLATION(folders_without_readme(FLEXSPLINE_SOURCE_DIR));
}

// The rules on texts that break them.

TEST(ArchitectureRules, ArrowsAgainstTheDesignAreFound) {
  EXPECT_EQ(arrows_of("shared/a.hpp", "#include \"host/x.hpp\"\n").size(), 1u);
  EXPECT_EQ(arrows_of("shared/a.hpp", "#include \"firmware/x.hpp\"\n").size(), 1u);
  EXPECT_EQ(arrows_of("firmware/a.hpp", "#include \"boards/x.hpp\"\n").size(), 1u);
  EXPECT_EQ(arrows_of("boards/a.cpp", "#include \"hil/x.hpp\"\n").size(), 1u);
  EXPECT_EQ(arrows_of("hil/plant/a.cpp", "  #  include <host/x.hpp>\n").size(), 1u);
  EXPECT_EQ(arrows_of("host/a.cpp", "#include \"hil/x.hpp\"\n#include \"tests/x.hpp\"\n").size(), 2u);
}

TEST(ArchitectureRules, ArrowsOfTheDesignAreAllowed) {
  EXPECT_NO_VIOLATION(arrows_of("shared/a.hpp", "#include <cstdint>\n#include \"shared/fixed/x.hpp\"\n"));
  EXPECT_NO_VIOLATION(arrows_of("firmware/a.hpp", "#include \"shared/x.hpp\"\n"));
  EXPECT_NO_VIOLATION(arrows_of("boards/a.cpp", "#include \"firmware/x.hpp\"\n#include \"shared/x.hpp\"\n"));
  EXPECT_NO_VIOLATION(arrows_of("hil/a.cpp", "#include <cmath>\n#include \"firmware/x.hpp\"\n"));
  EXPECT_NO_VIOLATION(arrows_of("host/a.cpp", "#include <Eigen/Dense>\n#include \"shared/x.hpp\"\n"));
  EXPECT_NO_VIOLATION(arrows_of("tests/unit/a.cpp", "#include \"host/x.hpp\"\n#include \"hil/x.hpp\"\n"));
  EXPECT_NO_VIOLATION(arrows_of("shared/a.hpp", "// #include <cmath>\n/*\n#include \"host/x.hpp\"\n*/\n"));
}

TEST(ArchitectureRules, ArrowsUpInHostAndFilesOutsideItsGroupsAreFound) {
  const auto of = [](const char* path, const char* text) { return arrows_up_in_host({{path, text}}); };
  EXPECT_EQ(of("host/engine/a/a.cpp", "#include \"host/output/b/b.hpp\"\n").size(), 1u);
  EXPECT_EQ(of("host/common/a/a.hpp", "#include \"host/input/b/b.hpp\"\n").size(), 1u);
  EXPECT_NO_VIOLATION(
      of("host/output/b/b.cpp", "#include \"host/engine/a/a.hpp\"\n#include \"host/output/c/c.hpp\"\n"));
  EXPECT_EQ(of("host/elsewhere/a.cpp", "").size(), 1u);
}

TEST(ArchitectureRules, AnIncludeOfAnotherBoardIsFound) {
  EXPECT_EQ(boards_of_others({{"boards/a/main.cpp", "#include \"boards/b/board.hpp\"\n"}}).size(), 1u);
  EXPECT_EQ(boards_of_others({{"boards/stm32f4/a.hpp", "#include \"boards/b/board.hpp\"\n"}}).size(), 1u);
  EXPECT_TRUE(boards_of_others({{"boards/a/main.cpp",
                                 "#include \"boards/a/board.hpp\"\n#include \"boards/stm32f4/drive.hpp\"\n"
                                 "#include \"shared/a.hpp\"\n"}})
                  .empty());
}
TEST(ArchitectureRules, HeadersOutsideTheAllowListAreFoundInShared) {
  for (const char* header : {"cmath", "math.h", "vector", "string", "new", "Eigen/Dense"}) {
    EXPECT_EQ(arrows_of("shared/a.hpp", std::string("#include <") + header + ">\n").size(), 1u) << header;
  }
}

TEST(ArchitectureRules, DetoursAroundTheRootAreFound) {
  EXPECT_EQ(arrows_of("shared/effects/a.hpp", "#include \"../../host/x.hpp\"\n").size(), 1u);
  EXPECT_EQ(arrows_of("host/a.cpp", "#include \"neighbour.hpp\"\n").size(), 1u);
  EXPECT_EQ(arrows_of("host/a.cpp", "#include CHOSEN_HEADER\n").size(), 1u);
}

TEST(ArchitectureRules, AViolationNamesFileLineAndWhatIsWrong) {
  const Violations found = arrows_of("host/a.cpp", "#include <vector>\n/* two\nlines */ #include \"hil/x.hpp\"\n");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0], "host/a.cpp:3: host may not include hil (hil/x.hpp)");
}

TEST(ArchitectureRules, HeapExceptionsAndMathAreFoundInShared) {
  EXPECT_EQ(shared_rules_of("int* p = new int;\n").size(), 1u);
  EXPECT_EQ(shared_rules_of("void* p = malloc(4);\n").size(), 1u);
  EXPECT_EQ(shared_rules_of("std::vector<int> a; std::string b;\n").size(), 2u);
  EXPECT_EQ(shared_rules_of("try { throw 1; } catch (...) {}\n").size(), 3u);
  EXPECT_EQ(shared_rules_of("auto x = std::sqrt(y) + std::abs(z);\n").size(), 2u);
  EXPECT_EQ(shared_rules_of("#define MAKE new int\n").size(), 1u);
  EXPECT_EQ(shared_rules_of("auto x = 1'000; auto c = 'a'; throw c;\n").size(), 1u);
}

TEST(ArchitectureRules, WordsInCommentsLiteralsAndLongerNamesAreNoViolation) {
  EXPECT_NO_VIOLATION(shared_rules_of("// try a new one, std::sqrt\n/* throw\n new */ int news = 1'000'000;\n"));
  EXPECT_NO_VIOLATION(shared_rules_of("constexpr std::string_view s = \"a new \\\" throw\";\n"));
  EXPECT_NO_VIOLATION(shared_rules_of("auto s = R\"x(try \" new)x\"; char c = '\"'; auto t = N::sqrt(v);\n"));
  EXPECT_NO_VIOLATION(forbidden_in_shared({{"host/a.cpp", "auto x = std::sqrt(2.0);\n"}}));
}

TEST(ArchitectureRules, ASecondUserOfAHeavyHeaderIsFound) {
  const std::string toml = "#include <toml++/toml.hpp>\n";
  EXPECT_NO_VIOLATION(misplaced_heavy_headers({{"host/a.cpp", toml}, {"hil/b.cpp", toml}}));
  EXPECT_EQ(misplaced_heavy_headers({{"host/a.cpp", toml}, {"host/b.cpp", toml}}).size(), 1u);
  EXPECT_EQ(misplaced_heavy_headers({{"host/a.cpp", toml}, {"host/b.cpp", "#include <toml++/toml.h>\n"}}).size(), 1u);
  EXPECT_EQ(misplaced_heavy_headers({{"host/a.hpp", "#include <CLI/CLI.hpp>\n"}}).size(), 1u);
  EXPECT_EQ(misplaced_heavy_headers({{"hil/a.cpp", "#include <ceres/ceres.h>\n"}}).size(), 1u);
}

TEST(ArchitectureRules, LongFilesAreFound) {
  const auto with_lines = [](long n) { return std::string(static_cast<std::size_t>(n), '\n'); };
  EXPECT_NO_VIOLATION(too_long({{"host/a.cpp", with_lines(kMaxLines)}, {"tests/data.csv", with_lines(kMaxLines + 1)}}));
  EXPECT_EQ(too_long({{"host/a.cpp", with_lines(kMaxLines + 1)}, {"dev", with_lines(kMaxLines + 1)}}).size(), 2u);
}

TEST(ArchitectureRules, ATestFileWithoutANamespaceOfItsOwnIsFound) {
  EXPECT_EQ(tests_without_own_namespace({{"tests/unit/a_test.cpp", "namespace flexspline::b {\n"}}).size(), 1u);
  EXPECT_EQ(tests_without_own_namespace({{"tests/unit/a_test.cpp", "namespace {\n"}}).size(), 1u);
  EXPECT_NO_VIOLATION(tests_without_own_namespace({{"tests/unit/a_test.cpp", "namespace flexspline::b::a_test {\n"}}));
  EXPECT_NO_VIOLATION(tests_without_own_namespace({{"tests/board/a_test.cpp", "namespace {\n"}}));
}

TEST(ArchitectureRules, PathsOfADeveloperMachineAreFound) {
  const std::string root = "/";
  EXPECT_EQ(developer_paths({{"dev", "cd " + root + "work/main\n"}}).size(), 1u);
  EXPECT_EQ(developer_paths({{"host/a.cpp", "open(\"" + root + "home/me/x.csv\");\n"}}).size(), 1u);
  EXPECT_NO_VIOLATION(developer_paths({{"host/a.cpp", "tests" + root + "home/x and ." + root + "work/x\n"}}));
}

TEST(ArchitectureRules, AFolderWithoutReadmeIsFound) {
  EXPECT_EQ(folders_without_readme(fs::path(FLEXSPLINE_SOURCE_DIR) / "no-such-folder").size(), kTopFolders.size());
}

}  // namespace
}  // namespace flexspline::architecture_test
