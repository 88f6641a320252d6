#include "host/common/text/shortened.hpp"

#include <fmt/format.h>

namespace flexspline::text {
namespace {

// A character has at most four bytes, of which all but the first continue it.
constexpr std::size_t kMostContinuing = 3;

bool continues(std::string_view text, std::size_t at) {
  return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U;
}

}  // namespace

std::string_view beginning_of(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  for (std::size_t back = 0; back < kMostContinuing && end > 0 && continues(text, end); ++back) --end;
  return text.substr(0, end);
}

std::string_view ending_of(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t first = text.size() - most;
  for (std::size_t on = 0; on < kMostContinuing && continues(text, first); ++on) ++first;
  return text.substr(first);
}

std::string shortened(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  const std::string_view beginning = beginning_of(text, most);
  return fmt::format("{}... ({} more characters)", beginning, text.size() - beginning.size());
}

}  // namespace flexspline::text
