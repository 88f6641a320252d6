#pragma once

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <utility>

namespace flexspline::plant {

/// The text of a file, written line by line.
using Text = fmt::memory_buffer;

template <class... Args>
void line(Text& text, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
  text.push_back('\n');
}

/// A TOML float, which needs a point with digits on both sides, or an exponent.
inline std::string real(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

}  // namespace flexspline::plant
