// The project's own source files, and their code without comments and texts.
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace architecture {

namespace fs = std::filesystem;

inline constexpr std::array<std::string_view, 6> kTopFolders = {"shared", "firmware", "boards", "hil", "host", "tests"};

struct SourceFile {
  std::string path;  // from the project's root, with forward slashes
  std::string text;
};

inline bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

// The text with comments and the contents of string and character literals blanked; lines stay where they are.
// Texts between quotes are kept on #include lines, where they are the name of a header.
inline std::string code_only(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  std::size_t i = 0;
  const auto at = [&](std::size_t k) { return k < text.size() ? text[k] : '\0'; };
  const auto blank_to = [&](std::size_t end) {
    for (end = std::min(end, text.size()); i < end; ++i) out += text[i] == '\n' ? '\n' : ' ';
  };
  const auto on_include_line = [&] {
    const std::size_t start = out.rfind('\n') == std::string::npos ? 0 : out.rfind('\n') + 1;
    const std::size_t hash = out.find_first_not_of(" \t", start);
    return hash != std::string::npos && out[hash] == '#' && out.find("include", hash) != std::string::npos;
  };
  while (i < text.size()) {
    if (at(i) == '/' && at(i + 1) == '/') {
      blank_to(text.find('\n', i));
    } else if (at(i) == '/' && at(i + 1) == '*') {
      const std::size_t end = text.find("*/", i + 2);
      blank_to(end == std::string_view::npos ? end : end + 2);
    } else if (is_word(at(i))) {
      // A whole word or number at once, so that the quote in 1'000 opens no literal.
      const bool number = std::isdigit(static_cast<unsigned char>(at(i))) != 0;
      const std::size_t start = i;
      while (is_word(at(i)) || (number && at(i) == '\'' && is_word(at(i + 1)))) out += text[i++];
      const std::string_view word = text.substr(start, i - start);
      if (at(i) == '"' && (word == "R" || word == "u8R" || word == "uR" || word == "UR" || word == "LR")) {
        const std::size_t open = text.find('(', i);
        if (open == std::string_view::npos) continue;
        const std::string close = ")" + std::string(text.substr(i + 1, open - i - 1)) + "\"";
        const std::size_t end = text.find(close, open);
        blank_to(end == std::string_view::npos ? end : end + close.size());
      }
    } else if ((at(i) == '"' || at(i) == '\'') && !on_include_line()) {
      std::size_t end = i + 1;
      while (end < text.size() && text[end] != text[i] && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
      blank_to(end + 1);
    } else {
      out += text[i++];
    }
  }
  return out;
}

inline std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// The project's own files: the top folders and what stands in the root. Not by git, which a source archive lacks.
inline const std::vector<SourceFile>& project_files() {
  static const std::vector<SourceFile> files = [] {
    const fs::path root = FLEXSPLINE_SOURCE_DIR;
    std::vector<SourceFile> all;
    const auto add = [&](const fs::path& path) {
      all.push_back({path.lexically_relative(root).generic_string(), read(path)});
    };
    for (const char* name : {"dev", "README.md", "CMakeLists.txt", "CMakePresets.json", ".clang-tidy", ".ci/run"}) {
      if (fs::is_regular_file(root / name)) add(root / name);
    }
    for (const std::string_view folder : kTopFolders) {
      if (!fs::is_directory(root / folder)) continue;
      for (auto entry = fs::recursive_directory_iterator(root / folder); entry != fs::recursive_directory_iterator();
           ++entry) {
        if (entry->path().filename() == "node_modules") entry.disable_recursion_pending();
        if (entry->is_regular_file()) add(entry->path());
      }
    }
    return all;
  }();
  return files;
}

}  // namespace architecture
