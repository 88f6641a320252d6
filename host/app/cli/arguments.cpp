#include "host/app/cli/arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "host/common/text/nearest.hpp"
#include "host/input/data/findings.hpp"

namespace flexspline::cli {
namespace {

bool is_kind(const std::string& word) {
  const auto kinds = data::known_kinds();
  std::error_code ignored;
  return std::any_of(kinds.begin(), kinds.end(), [&](const data::KindInfo& kind) { return kind.name == word; }) &&
         !std::filesystem::exists(word, ignored);
}

}  // namespace

std::vector<std::string> arguments_from(int argc, char** argv) {
  std::vector<std::string> typed(argv + std::min(argc, 1), argv + argc);
  if (!typed.empty() && typed[0] == "help") {
    typed.erase(typed.begin());
    typed.push_back("--help");
  }
  std::vector<std::string> arguments;
  for (std::size_t i = 0; i < typed.size(); ++i) {
    arguments.push_back(typed[i]);
    if (typed[i] != "--tolerate" || i + 1 == typed.size()) continue;
    arguments.push_back(typed[++i]);
    while (i + 1 < typed.size() && is_kind(typed[i + 1])) {
      arguments.emplace_back("--tolerate");
      arguments.push_back(typed[++i]);
    }
  }
  return arguments;
}

std::string misspelt_option(const std::vector<std::string>& arguments, const std::vector<std::string>& known) {
  const std::vector<std::string_view> names(known.begin(), known.end());
  for (const std::string& argument : arguments) {
    const std::string name = argument.substr(0, argument.find('='));
    if (!name.starts_with("--") || name.size() < 4 || std::find(names.begin(), names.end(), name) != names.end())
      continue;
    const std::string near = text::nearest(name, names);
    if (!near.empty()) return fmt::format("{} is not known; did you mean {}?", name, near);
  }
  return {};
}

}  // namespace flexspline::cli
