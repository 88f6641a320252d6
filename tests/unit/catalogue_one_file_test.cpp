// An effect is one file and one line: nothing else in the program names one, and the documents keep up.
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

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests::catalogue_one_file_test {
namespace {

namespace fs = std::filesystem;
using catalogue::Entry;
using catalogue::Kind;

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
  return path == "shared/effects/effect.hpp" || path == "shared/effects/variables.hpp" ||
         path == "shared/effects/list.hpp" || path == "shared/effects/walk.hpp";
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

struct Code {
  std::set<std::string> words;     // without those of comments to the end of a line and of literals
  std::set<std::string> literals;  // names in literals, also in lists ("a,b") and with an order ("a:2"); not in prose
};

Code code_of(std::string_view text) {
  Code code;
  const auto is_word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    if (text.substr(at).starts_with("//")) {
      at = text.find('\n', at);
    } else if (text[at] == '"') {
      for (++at; at < text.size() && text[at] != '"' && text[at] != '\n'; ++at) at += text[at] == '\\' ? 1 : 0;
      std::set<std::string> names;
      bool is_prose = false;
      for (std::string_view name : catalogue::split_names(text.substr(begin + 1, at - begin - 1))) {
        while (name.starts_with(' ')) name.remove_prefix(1);
        is_prose = is_prose || name.find(' ') != std::string_view::npos;
        names.emplace(name.substr(0, name.find(':')));
      }
      if (!is_prose) code.literals.merge(names);
      ++at;
    } else if (is_word(static_cast<unsigned char>(text[at]))) {
      while (at < text.size() && is_word(static_cast<unsigned char>(text[at]))) ++at;
      code.words.emplace(text.substr(begin, at - begin));
    } else {
      ++at;
    }
  }
  return code;
}

std::string effect_of(const std::string& path) {
  const std::size_t slash = path.rfind('/') + 1;
  return path.substr(slash, path.rfind('.') - slash);
}

// Where the program names effects, and why it must.
using Reasons = std::map<std::string, std::string>;
const Reasons& reasons() {
  static const Reasons kReasons = {
      {"host/physics/catalogue/user_defined_effect.hpp",
       "what a user made is named in model files and made apart from the others"},
      {"host/app/project/base_model.cpp", "a first model has the effects that every drive has"},
      {"host/app/cli/command_demo.cpp",
       "what the demo may hide is chosen, so that a newcomer sees something that he knows"},
      {"host/drive_link/deployment/drive_settings.cpp",
       "loops are laid out for an inertia, and the lead of a feedforward is as slow as the damping lets it"},
      {"host/engine/sensitivity/changes.cpp", "the report scales the stiffness, and no other parameter"},
      {"host/output/answers/effect_curve.cpp", "a shift is drawn on a spring"}};
  return kReasons;
}

std::vector<std::string> broken_rules(const std::vector<Source>& sources, const Reasons& allowed) {
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
    const Code code = code_of(source.text);
    bool names_one = false;
    for (const auto& [path, type] : types) {
      if (path != source.path && code.words.contains(type))
        broken.push_back(source.path + " names " + type + "; go through the catalogue instead");
      // Effects name those that they are confused with; "inertia" is a parameter too.
      if (source.path.starts_with("shared/effects/") || !code.literals.contains(effect_of(path))) continue;
      names_one = true;
      if (!allowed.contains(source.path))
        broken.push_back(source.path + " names \"" + effect_of(path) +
                         "\"; ask the catalogue for what is special about it, or state the reason in this test");
    }
    if (!names_one && allowed.contains(source.path)) broken.push_back(source.path + " names none and needs no reason");
  }
  return broken;
}

TEST(AddingAnEffect, IsOneFileAndOneLine) {
  const std::vector<Source> sources = sources_below({"shared", "host", "firmware"});
  const auto types = effect_types(sources);
  EXPECT_EQ(types.size(), catalogue::all().size() + 1) << "and the one that users make of a header";
  EXPECT_NE(catalogue::find_user_defined("table_effect"), nullptr);
  for (const Entry& entry : catalogue::all())
    EXPECT_TRUE(types.contains("shared/effects/" + std::string(entry.name()) + ".hpp")) << entry.name();
  for (const std::string& broken : broken_rules(sources, reasons())) ADD_FAILURE() << broken;
}

TEST(AddingAnEffect, TheStatisticalEngineHasNoReasonToNameOne) {
  for (const auto& [path, reason] : reasons())
    EXPECT_FALSE(path.starts_with("host/engine/estimation/") || path.starts_with("host/engine/selection/"))
        << path << ": " << reason << "; state it in the effect's header (effects::Description)";
}

TEST(AddingAnEffect, CheckerSeesWhatBreaksTheRule) {
  const Source list{"shared/effects/list.hpp", "#include \"shared/effects/rub.hpp\"\n"};
  const Source effect{"shared/effects/rub.hpp", "struct Rub {};\nauto n = \"rub\";\nFLEXSPLINE_EFFECT(1, Rub);\n"};
  const Source innocent{"host/a.cpp",
                        "// Rub\nauto x = \"Rub, rubber\"; RubOther y; say(\"dry friction, rub, or play\");\n"};
  const auto broken = [&](std::vector<Source> sources, const Reasons& allowed = {}) {
    return broken_rules(sources, allowed).size();
  };
  EXPECT_EQ(broken({list, effect, innocent}), 0U);
  EXPECT_EQ(broken({list, effect, {"host/a.cpp", "effects::Rub x;\n"}}), 1U);
  EXPECT_EQ(broken({list, effect, {"host/a.cpp", "if (name == \"rub\")\n"}}), 1U);
  EXPECT_EQ(broken({list, effect, {"host/a.cpp", "add(\"slip,rub\");\n"}}), 1U);
  EXPECT_EQ(broken({list, effect, {"host/a.cpp", "add(\"slip, rub:2\");\n"}}), 1U);
  EXPECT_EQ(broken({list, effect, {"host/a.cpp", "add(\"rub\");\n"}}, {{"host/a.cpp", "why"}}), 0U);
  EXPECT_EQ(broken({list, effect, {"host/a.cpp", "add(\"slip\");\n"}}, {{"host/a.cpp", "why"}}), 1U);
  EXPECT_EQ(broken({list, effect, {"shared/effects/slip.hpp", "auto r = \"rub\";\n"}}), 2U) << "no number, not listed";
  EXPECT_EQ(broken({{list.path, ""}, effect}), 1U);
  EXPECT_EQ(broken({{list.path, list.text + list.text}, effect}), 1U);
  EXPECT_EQ(broken({list, {effect.path, "struct Rub {};\n"}}), 1U);
}

std::string text_of(const char* path) {
  std::ifstream in(fs::path(FLEXSPLINE_SOURCE_DIR) / path, std::ios::binary);
  return std::string(std::istreambuf_iterator(in), {});
}

// Rows of the tables of a document by the name in their first column.
std::multimap<std::string, std::string> rows_of(const std::string& text) {
  std::multimap<std::string, std::string> rows;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    if (line.starts_with("| `")) rows.emplace(line.substr(3, line.find('`', 3) - 3), line);
    at = end + 1;
  }
  return rows;
}

bool any_row_has(const std::multimap<std::string, std::string>& rows, std::string_view name, const std::string& text) {
  const auto [first, last] = rows.equal_range(std::string(name));
  return std::any_of(first, last, [&](const auto& row) { return row.second.find(text) != std::string::npos; });
}

TEST(EffectDocuments, CatalogueHasEachEffectWithItsParametersAndRivals) {
  const std::string document = text_of("shared/effects/CATALOGUE.md");
  const auto rows = rows_of(document);
  for (const Entry& entry : catalogue::all()) {
    EXPECT_TRUE(rows.contains(std::string(entry.name()))) << entry.name() << " has no row in CATALOGUE.md";
    for (const auto& parameter : entry.parameters) {
      // weight_1 to weight_8 are written once, as weight_j.
      std::string key(parameter.name);
      if (entry.count(Kind::grid) > 0 || entry.info->host_only)
        while (!key.empty() && std::isdigit(static_cast<unsigned char>(key.back())) != 0) key.pop_back();
      EXPECT_TRUE(any_row_has(rows, entry.name(), "`" + key)) << entry.name() << "." << key << " is not described";
    }
    for (const std::string_view name : catalogue::split_names(entry.info->confused_with))
      EXPECT_TRUE(any_row_has(rows, entry.name(), "`" + std::string(name) + "`"))
          << "CATALOGUE.md does not say that " << entry.name() << " is confused with " << name;
  }
}

}  // namespace
}  // namespace flexspline::tests::catalogue_one_file_test
