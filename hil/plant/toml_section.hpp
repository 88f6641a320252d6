// Reading a TOML file key by key, with errors that say where. Only the sources that read files include this: the
// library is heavy.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// The reader asserts what it then checks itself: a header such as "[.x]" would end the program where asserts are on,
// and let the optimiser leave out the check where they are off. Without either it is an error with a line. Every source
// that includes the reader has these lines: of functions that several compile, the linker takes one.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

namespace flexspline::plant {

/// Reads the keys of one table, and refuses those it was not asked for: a misspelt key must not pass as a default.
class Section {
 public:
  Section(const toml::table& table, std::string_view origin, std::string where)
      : table_(table), origin_(origin), where_(std::move(where)) {}

  [[noreturn]] void fail(const toml::node* node, const std::string& what) const {
    const auto line = (node == nullptr ? table_.source() : node->source()).begin.line;
    throw std::runtime_error(fmt::format("{}:{}: {}: {}", origin_, line, where_, what));
  }

  double number(std::string_view key, double& value, bool required = false) {
    read(key, value, required, "a finite number");
    if (!std::isfinite(value)) fail(table_.get(key), fmt::format("{} must be a finite number", key));
    return value;
  }
  void positive(std::string_view key, double& value, bool required = false) {
    if (!(number(key, value, required) > 0.0)) fail(table_.get(key), fmt::format("{} must be positive", key));
  }
  void not_negative(std::string_view key, double& value) {
    if (number(key, value) < 0.0) fail(table_.get(key), fmt::format("{} must not be negative", key));
  }
  void flag(std::string_view key, bool& value) { read(key, value, false, "true or false"); }
  void whole(std::string_view key, int& value, int least) {
    read(key, value, false, "a whole number");
    if (value < least) fail(table_.get(key), fmt::format("{} must be at least {}", key, least));
  }
  void text(std::string_view key, std::string& value, bool required = false) { read(key, value, required, "text"); }
  /// What stands under a key, whatever it is; nullptr where there is nothing.
  const toml::node* node(std::string_view key) {
    known_.emplace_back(key);
    return table_.get(key);
  }
  const toml::table* table(std::string_view key) {
    known_.emplace_back(key);
    const toml::node* node = table_.get(key);
    if (node != nullptr && !node->is_table()) fail(node, fmt::format("{} must be a table", key));
    return node == nullptr ? nullptr : node->as_table();
  }
  /// The name that the text under `key` stands for.
  template <class T>
  void choice(std::string_view key, T& value, std::initializer_list<std::pair<std::string_view, T>> names) {
    std::string name;
    text(key, name);
    if (name.empty()) return;
    std::string all;
    for (const auto& [label, meaning] : names) {
      if (label == name) {
        value = meaning;
        return;
      }
      all += fmt::format("{}{}", all.empty() ? "" : ", ", label);
    }
    fail(table_.get(key), fmt::format("{} = \"{}\" is unknown; use one of {}", key, name, all));
  }
  void done() const {
    for (const auto& [key, node] : table_) {
      if (std::find(known_.begin(), known_.end(), key.str()) == known_.end()) {
        fail(&node, fmt::format("unknown key \"{}\"; take it out or correct its spelling", key.str()));
      }
    }
  }

 private:
  template <class T>
  void read(std::string_view key, T& value, bool required, std::string_view kind) {
    known_.emplace_back(key);
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      if (required) fail(nullptr, fmt::format("the key \"{}\" is missing", key));
      return;
    }
    const auto found = node->value<T>();
    if (!found) fail(node, fmt::format("{} must be {}", key, kind));
    value = *found;
  }

  const toml::table& table_;
  std::string_view origin_;
  std::string where_;
  std::vector<std::string> known_;
};

template <class Reader>
void for_each_table(const toml::table& root, std::string_view key, std::string_view origin, Reader read) {
  const toml::node* node = root.get(key);
  if (node == nullptr) return;
  const toml::array* list = node->as_array();
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    const toml::table* table = list->get(i)->as_table();
    if (table == nullptr)
      list = nullptr;
    else
      read(*table);
  }
  if (list == nullptr) {
    throw std::runtime_error(
        fmt::format("{}:{}: {} must be written as [[{}]]", origin, node->source().begin.line, key, key));
  }
}

inline std::string text_of(const std::filesystem::path& file, std::string_view kind) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(fmt::format("{}: cannot be read; check the path of the {}", file.string(), kind));
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline toml::table parse_ascii(std::string_view text, std::string_view origin) {
  // Outside quotes and comments the reader's behaviour is undefined for some letters beyond ASCII. These files need
  // none.
  const auto foreign =
      std::find_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) > 127; });
  if (foreign != text.end()) {
    throw std::runtime_error(
        fmt::format("{}:{}: a letter or sign that is not ASCII; write it in plain ASCII, comments too", origin,
                    1 + std::count(text.begin(), foreign, '\n')));
  }
  try {
    return toml::parse(text, origin);
  } catch (const toml::parse_error& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", origin, error.source().begin.line, error.description()));
  }
}

}  // namespace flexspline::plant
