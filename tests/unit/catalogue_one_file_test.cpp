// An effect is one file and one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "host/catalogue/catalogue.hpp"

namespace flexspline::tests {
namespace {

namespace fs = std::filesystem;
using catalogue::Entry;

struct Source {
  std::string path;  // from the project's root
  std::string text;
};

std::vector<Source> sources_below(std::initializer_list<const char*> folders) {
  const fs::path root = FLEXSPLINE_SOURCE_DIR;
  std::vector<Source> sources;
  for (const char* folder : folders)
    for (const auto& file : fs::recursive_directory_iterator(root / folder)) {
      if (file.path().extension() != ".hpp" && file.path().extension() != ".cpp") continue;
      std::ifstream in(file.path(), std::ios::binary);
      sources.push_back(
          {fs::relative(file.path(), root).generic_string(), std::string(std::istreambuf_iterator(in), {})});
    }
  return sources;
}

bool is_infrastructure(std::string_view path) {
  return path == "shared/effects/effect.hpp" || path == "shared/effects/list.hpp" || path == "shared/effects/walk.hpp";
}

// C++ type of the effect that each header defines: FLEXSPLINE_EFFECT(16, Backlash) stands once in each.
std::map<std::string, std::string> effect_types(const std::vector<Source>& sources) {
  std::map<std::string, std::string> types;
  for (const Source& source : sources) {
    if (!source.path.starts_with("shared/effects/") || is_infrastructure(source.path)) continue;
    std::string& type = types[source.path];
    const std::size_t definition = source.text.find("\nFLEXSPLINE_EFFECT(");
    if (definition == std::string::npos) continue;
    const std::size_t comma = source.text.find(", ", definition);
    const std::size_t close = source.text.find(");\n", definition);
    if (comma < close && close != std::string::npos) type = source.text.substr(comma + 2, close - comma - 2);
  }
  return types;
}

int count(std::string_view text, std::string_view part) {
  int found = 0;
  for (auto at = text.find(part); at != std::string_view::npos; at = text.find(part, at + part.size())) ++found;
  return found;
}

// Words of the code, without those of comments to the end of a line and of literals.
std::set<std::string> words_of(std::string_view text) {
  std::set<std::string> words;
  for (std::size_t at = 0; at < text.size();) {
    const auto is_word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
    const std::size_t begin = at;
    if (text.substr(at).starts_with("//")) {
      at = text.find('\n', at);
    } else if (text[at] == '"') {
      for (++at; at < text.size() && text[at] != '"' && text[at] != '\n'; ++at) at += text[at] == '\\' ? 1 : 0;
      ++at;
    } else if (is_word(static_cast<unsigned char>(text[at]))) {
      while (at < text.size() && is_word(static_cast<unsigned char>(text[at]))) ++at;
      words.emplace(text.substr(begin, at - begin));
    } else {
      ++at;
    }
  }
  return words;
}

std::vector<std::string> broken_rules(const std::vector<Source>& sources) {
  std::vector<std::string> broken;
  const auto types = effect_types(sources);
  const auto list =
      std::find_if(sources.begin(), sources.end(), [](const auto& s) { return s.path == "shared/effects/list.hpp"; });
  if (list == sources.end()) return {"no list of effects"};
  for (const auto& [path, type] : types) {
    if (type.empty()) broken.push_back(path + " defines no effect with a number");
    if (count(list->text, "#include \"" + path + "\"\n") != 1) broken.push_back(path + " is not once in list.hpp");
  }
  for (const Source& source : sources) {
    const std::set<std::string> words = words_of(source.text);
    for (const auto& [path, type] : types)
      if (path != source.path && words.contains(type))
        broken.push_back(source.path + " names " + type + "; go through the catalogue instead");
  }
  return broken;
}

TEST(AddingAnEffect, IsOneFileAndOneLine) {
  const std::vector<Source> sources = sources_below({"shared", "host"});
  const auto types = effect_types(sources);
  EXPECT_EQ(types.size(), catalogue::all().size());
  for (const Entry& entry : catalogue::all())
    EXPECT_TRUE(types.contains("shared/effects/" + std::string(entry.name()) + ".hpp")) << entry.name();
  for (const std::string& broken : broken_rules(sources)) ADD_FAILURE() << broken;
}

TEST(AddingAnEffect, CheckerSeesWhatBreaksTheRule) {
  const Source list{"shared/effects/list.hpp", "#include \"shared/effects/rub.hpp\"\n"};
  const Source effect{"shared/effects/rub.hpp", "struct Rub {};\nFLEXSPLINE_EFFECT(1, Rub);\n"};
  const Source innocent{"host/a.cpp", "// Rub\nauto x = \"Rub\"; RubOther y;\n"};
  EXPECT_TRUE(broken_rules({list, effect, innocent}).empty());
  EXPECT_EQ(broken_rules({list, effect, {"host/a.cpp", "effects::Rub x;\n"}}).size(), 1U);
  EXPECT_EQ(broken_rules({{list.path, ""}, effect}).size(), 1U);
  EXPECT_EQ(broken_rules({{list.path, list.text + list.text}, effect}).size(), 1U);
  EXPECT_EQ(broken_rules({list, {effect.path, "struct Rub {};\n"}}).size(), 1U);
}

}  // namespace
}  // namespace flexspline::tests
