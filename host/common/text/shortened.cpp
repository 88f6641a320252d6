#include "host/common/text/shortened.hpp"

#include <fmt/format.h>

namespace flexspline::text {

std::string shortened(std::string_view text, std::size_t most) {
  if (text.size() <= most) return std::string(text);
  std::size_t end = most;
  const auto continues = [&](std::size_t at) { return (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U; };
  // A character has at most four bytes; what is no UTF-8 is cut anywhere.
  for (std::size_t back = 0; back < 3 && end > 0 && continues(end); ++back) --end;
  return fmt::format("{}... ({} more characters)", text.substr(0, end), text.size() - end);
}

}  // namespace flexspline::text
