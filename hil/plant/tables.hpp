#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::plant {

struct Entry;

struct Entries {
  std::size_t line = 0;
  std::vector<Entry> entries;
};
/// The value of a key of a TOML file. Only the member of its type is filled; a single number or text is a list of one.
struct Entry {
  std::string name;
  std::size_t line = 0;
  bool is_list = false;
  std::vector<double> numbers;
  std::vector<std::string> texts;
  std::vector<std::vector<double>> rows;  ///< of a list of lists of numbers
  std::vector<Entries> tables;            ///< one, or those of a list of tables
};

/// A TOML text as tables, for readers that know its keys. Throws std::runtime_error with `origin` and line.
Entries read_entries(std::string_view text, std::string_view origin);
/// The content of a file; `kind` is its role in error messages.
std::string read_text(const std::filesystem::path& file, std::string_view kind);

}  // namespace flexspline::plant
