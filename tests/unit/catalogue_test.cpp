// The catalogue: what users, model files and parameter blocks rely on stands as the published list of effects says, and
// an effect is one file and one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "host/catalogue/catalogue.hpp"

namespace flexspline::tests {
namespace {

namespace fs = std::filesystem;
using catalogue::Balance;
using catalogue::Entry;
using catalogue::Kind;
using catalogue::Phase;
using effects::Limit;

struct Published {
  struct Parameter {
    std::string_view name;
    std::string_view unit;
    Kind kind;
    double usual;
    double usual_to;  // the end of a range, or as `usual`
  };
  std::string_view name;
  std::size_t id;  // in the parameter block: never changed, never given again
  Balance balance;
  Phase phase;
  std::vector<Parameter> parameters;
};

const std::vector<Published>& published() {
  using enum Balance;
  using enum Phase;
  using enum Kind;
  static const std::vector<Published> list = {
      {"inertia", 1, motor, source, {{"inertia", "kg*m^2", linear, 1e-4, 1e-4}}},
      {"viscous_friction", 2, motor, source, {{"coefficient", "N*m*s/rad", linear, 3.6e-4, 3.6e-4}}},
      {"coulomb_friction", 3, motor, source, {{"torque", "N*m", linear, 0.045, 0.045}}},
      {"viscous_asymmetry", 4, motor, source, {{"coefficient", "N*m*s/rad", linear, 1e-5, 1e-4}}},
      {"coulomb_asymmetry", 5, motor, source, {{"torque", "N*m", linear, 1e-3, 6e-3}}},
      {"stribeck_gaussian",
       6,
       motor,
       source,
       {{"amplitude_positive", "N*m", linear, 0.012, 0.012},
        {"amplitude_negative", "N*m", linear, 0.012, 0.012},
        {"velocity", "rad/s", shape, 3.0, 3.0}}},
      {"power_law_friction",
       7,
       motor,
       source,
       {{"torque", "N*m", linear, 0.02, 0.02}, {"exponent", "1", shape, 0.4, 0.7}}},
      {"load_dependent_friction", 8, motor, source, {{"coefficient", "1", linear, 0.03, 0.08}}},
      {"temperature_viscous", 9, motor, modulate, {{"coefficient", "1/degC", shape, 0.012, 0.012}}},
      {"dahl_friction",
       10,
       motor,
       source,
       {{"torque", "N*m", linear, 0.045, 0.045}, {"presliding", "rad", shape, 0.05, 0.05}}},
      {"torque_ripple",
       11,
       motor,
       source,
       {{"order", "1", given, 2.0, 4.0}, {"cosine", "N*m", linear, 0.004, 0.004}, {"sine", "N*m", linear, 0.0, 0.004}}},
      {"current_offset", 12, motor, source, {{"current", "A", linear, 0.05, 0.05}}},
      {"torque_bias", 13, motor, source, {{"torque", "N*m", linear, 0.0, 0.045}}},  // no size published
      {"linear_stiffness", 14, transmission, source, {{"stiffness", "N*m/rad", linear, 6.3e3, 6.3e3}}},
      {"structural_damping",
       15,
       transmission,
       source,
       {{"torque", "N*m", linear, 57.0, 57.0}, {"exponent", "1", shape, 0.5, 0.5}}},
      {"backlash", 16, transmission, shift, {{"half_width", "rad", shape, 1.5e-4, 1.5e-4}}},
      {"output_inertia", 17, load, source, {{"inertia", "kg*m^2", linear, 0.06, 0.06}}},
      {"output_viscous_friction", 18, load, source, {{"coefficient", "N*m*s/rad", linear, 0.5, 0.5}}},
      {"output_coulomb_friction", 19, load, source, {{"torque", "N*m", linear, 0.6, 0.6}}},
      {"gravity", 20, load, source, {{"cosine", "N*m", linear, 0.0, 3.0}, {"sine", "N*m", linear, 3.0, 3.0}}},
  };
  return list;
}

// Every name of the published list, built or not: what descriptions may refer to.
const std::set<std::string_view> kPublishedNames = {"inertia",
                                                    "viscous_friction",
                                                    "coulomb_friction",
                                                    "viscous_asymmetry",
                                                    "coulomb_asymmetry",
                                                    "stribeck_gaussian",
                                                    "stribeck_hess_soom",
                                                    "power_law_friction",
                                                    "quadratic_drag",
                                                    "load_dependent_friction",
                                                    "temperature_viscous",
                                                    "temperature_coulomb",
                                                    "dahl_friction",
                                                    "lugre_friction",
                                                    "torque_ripple",
                                                    "load_scaled_ripple",
                                                    "current_offset",
                                                    "torque_bias",
                                                    "torque_constant_error",
                                                    "torque_constant_saturation",
                                                    "current_saturation",
                                                    "current_delay",
                                                    "linear_stiffness",
                                                    "quadratic_stiffness",
                                                    "cubic_stiffness",
                                                    "piecewise_stiffness",
                                                    "structural_damping",
                                                    "dahl_hysteresis",
                                                    "modified_dahl_hysteresis",
                                                    "duhem_hysteresis",
                                                    "bouc_wen_hysteresis",
                                                    "prandtl_ishlinskii_hysteresis",
                                                    "preisach_hysteresis",
                                                    "torque_proportional_hysteresis",
                                                    "kinematic_error",
                                                    "backlash",
                                                    "torque_offset",
                                                    "torque_sensor_gain",
                                                    "torque_sensor_ripple",
                                                    "torsion_zero",
                                                    "output_inertia",
                                                    "output_viscous_friction",
                                                    "output_coulomb_friction",
                                                    "gravity",
                                                    "table_effect",
                                                    "expression_effect"};

TEST(Catalogue, HasEveryPublishedEffectWithItsNumberKeysUnitsAndUsualSizes) {
  for (const Published& expected : published()) {
    SCOPED_TRACE(expected.name);
    const Entry* entry = catalogue::find(expected.name);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(entry->id, expected.id);
    EXPECT_EQ(entry->info->balance, expected.balance);
    EXPECT_EQ(entry->info->phase, expected.phase);
    ASSERT_EQ(entry->parameters.size(), expected.parameters.size());
    for (std::size_t k = 0; k < expected.parameters.size(); ++k) {
      const auto& parameter = entry->parameters[k];
      SCOPED_TRACE(parameter.name);
      EXPECT_EQ(parameter.name, expected.parameters[k].name);
      EXPECT_EQ(parameter.unit.rotary, expected.parameters[k].unit);
      EXPECT_EQ(parameter.kind, expected.parameters[k].kind);
      EXPECT_GE(parameter.usual, expected.parameters[k].usual);
      EXPECT_LE(parameter.usual, expected.parameters[k].usual_to);
      EXPECT_EQ(entry->index_of(parameter.name), k);
    }
  }
}

TEST(Catalogue, NamesAndNumbersAreUniqueAndRising) {
  std::set<std::string_view> names;
  std::size_t last = 0;
  for (const Entry& entry : catalogue::all()) {
    EXPECT_TRUE(names.insert(entry.name()).second) << entry.name() << " stands twice";
    EXPECT_TRUE(kPublishedNames.contains(entry.name())) << entry.name() << " is not in the published list";
    EXPECT_GT(entry.id, last);
    EXPECT_LE(entry.id, effects::kLastId);
    last = entry.id;
    std::set<std::string_view> keys;
    for (const auto& parameter : entry.parameters) EXPECT_TRUE(keys.insert(parameter.name).second);
  }
  EXPECT_GE(names.size(), published().size());
}

TEST(Catalogue, DescribesEachEffectToSomebodyWhoNeverHeardOfIt) {
  for (const Entry& entry : catalogue::all()) {
    SCOPED_TRACE(entry.name());
    const effects::Description& info = *entry.info;
    for (const std::string_view text :
         {info.explanation, info.causes, info.equation, info.source, info.shows_over, info.separated_by})
      EXPECT_FALSE(text.empty());
    for (const std::string_view sentence : {info.explanation, info.causes}) {
      EXPECT_GT(sentence.size(), 40U);
      EXPECT_TRUE(sentence.ends_with('.'));
    }
    EXPECT_NE(info.reads, 0U);
    for (const std::string_view list : {info.rivals, info.replaces, info.modulates})
      for (const std::string_view name : catalogue::split_names(list)) {
        EXPECT_TRUE(kPublishedNames.contains(name)) << '"' << name << '"';
        EXPECT_NE(name, entry.name());
      }
    EXPECT_FALSE(info.rivals.empty());
    if (info.phase == Phase::modulate)
      EXPECT_NE(catalogue::find(info.modulates), nullptr) << "what it scales must be there to be scaled";
    else
      EXPECT_TRUE(info.modulates.empty());
  }
}

TEST(Catalogue, BoundsHoldTheUsualValueAndShapesAreBounded) {
  for (const Entry& entry : catalogue::all()) {
    for (const auto& parameter : entry.parameters) {
      SCOPED_TRACE(std::string(entry.name()) + "." + std::string(parameter.name));
      EXPECT_TRUE(std::isfinite(parameter.usual));
      EXPECT_LT(parameter.low, parameter.high);
      EXPECT_LE(parameter.low, parameter.usual);
      EXPECT_GE(parameter.high, parameter.usual);
      if (parameter.kind == Kind::linear) {
        EXPECT_EQ(parameter.limit, Limit::stated);
        continue;
      }
      // A shape is searched for: from below it needs a bound of its own, from above one of its own or of the data.
      EXPECT_TRUE(std::isfinite(parameter.low));
      EXPECT_TRUE(std::isfinite(parameter.high) || parameter.limit != Limit::stated);
      EXPECT_NE(parameter.usual, 0.0);
    }
    EXPECT_EQ(entry.parameters.size(), entry.count(Kind::linear) + entry.count(Kind::shape) + entry.count(Kind::given));
    EXPECT_GT(entry.parameters.size(), 0U);
  }
}

// Torque becomes force, inertia mass, and angle length.
std::string on_linear_axis(std::string unit) {
  const auto replace = [&](std::string_view from, std::string_view to) {
    for (auto at = unit.find(from); at != std::string::npos; at = unit.find(from, at + to.size()))
      unit.replace(at, from.size(), to);
  };
  replace("kg*m^2", "kg");
  replace("N*m", "N");
  replace("rad", "m");
  return unit;
}

TEST(Catalogue, LinearAxisHasForcesAndMetresForTorquesAndAngles) {
  EXPECT_EQ(on_linear_axis("N*m*s^2/rad^2"), "N*s^2/m^2");
  for (const Entry& entry : catalogue::all())
    for (const auto& parameter : entry.parameters)
      EXPECT_EQ(parameter.unit.linear, on_linear_axis(std::string(parameter.unit.rotary))) << entry.name();
}

TEST(Catalogue, OffersEachEffectTheFunctionsOfItsPhase) {
  for (const Entry& entry : catalogue::all()) {
    SCOPED_TRACE(entry.name());
    const bool source = entry.info->phase == Phase::source;
    EXPECT_EQ(entry.real.torque != nullptr, source);
    EXPECT_EQ(entry.dual.torque != nullptr, source);
    EXPECT_EQ(entry.real.change != nullptr, !source);
    EXPECT_EQ(entry.dual.change != nullptr, !source);
    EXPECT_NE(entry.make, nullptr);
    EXPECT_EQ(entry.has_state, entry.name() == "dahl_friction");
  }
}

TEST(Catalogue, SaysThatANameIsUnknown) {
  EXPECT_EQ(catalogue::find("viscous"), nullptr);
  EXPECT_THROW(catalogue::get("viscous"), std::out_of_range);
  EXPECT_EQ(&catalogue::get("gravity"), catalogue::find("gravity"));
  const Entry& gravity = catalogue::get("gravity");
  EXPECT_EQ(gravity.index_of("tangent"), gravity.parameters.size());
}

TEST(Catalogue, SplitsListsOfNames) {
  EXPECT_TRUE(catalogue::split_names("").empty());
  EXPECT_EQ(catalogue::split_names("a,bc,d"), (std::vector<std::string_view>{"a", "bc", "d"}));
  EXPECT_TRUE(catalogue::names_contain("a,bc", "bc"));
  EXPECT_FALSE(catalogue::names_contain("a,bc", "b"));
}

// One file and one line.

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
