#include "host/common/text/unit_signs.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace flexspline::text {
namespace {

constexpr auto kSigns = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"\u00B0", "deg"},
    {"\u00B5", "u"},  // micro sign
    {"\u03BC", "u"},  // Greek mu
    {"\u00B7", "*"},  // middle dot
    {"\u22C5", "*"},  // dot operator
    {"\u00D7", "*"},
    {"\u00B9", "1"},
    {"\u00B2", "^2"},
    {"\u00B3", "^3"},
    {"\u207B", "-"},
});

}  // namespace

std::string unit_in_ascii(std::string_view unit) {
  std::string ascii;
  while (!unit.empty()) {
    const auto sign = std::ranges::find_if(kSigns, [&](const auto& s) { return unit.starts_with(s.first); });
    ascii += sign == kSigns.end() ? unit.substr(0, 1) : sign->second;
    unit.remove_prefix(sign == kSigns.end() ? 1 : sign->first.size());
  }
  return ascii;
}

}  // namespace flexspline::text
