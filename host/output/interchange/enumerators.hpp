// Names of enumerators as the compiler spells them, so that no list has to follow an enumeration.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

namespace flexspline::interchange {

namespace detail {
template <auto kValue>
constexpr std::string_view enumerator_name() {
  // "... kValue = flexspline::protocol::Kind::status; ..." or "...]"; a number without a name has a cast before it.
  const std::string_view spelt = __PRETTY_FUNCTION__;
  const std::string_view begin = "kValue = ";
  std::string_view name = spelt.substr(spelt.find(begin) + begin.size());
  name = name.substr(0, name.find_first_of(";]"));
  // Clang writes "(anonymous namespace)::" in a name, too.
  if (const std::size_t close = name.rfind(')'); close != std::string_view::npos && name[close + 1] != ':') return {};
  return name.substr(name.rfind(':') + 1);
}
template <class Enum, std::size_t kFrom, std::size_t... Is>
constexpr std::array<std::string_view, sizeof...(Is)> enumerator_names(std::index_sequence<Is...>) {
  return {enumerator_name<static_cast<Enum>(kFrom + Is)>()...};
}
}  // namespace detail

// Calls visit(name, number) for each enumerator from kFrom to before kFrom + kCount, by rising number. Of two with one
// number the compiler spells the first.
template <class Enum, std::size_t kFrom = 0, std::size_t kCount = 256, class Visit>
void for_each_enumerator(Visit&& visit) {
  // One loop over a table: `visit` in line for each of some hundred numbers would take minutes to compile.
  static constexpr auto kNames = detail::enumerator_names<Enum, kFrom>(std::make_index_sequence<kCount>{});
  for (std::size_t i = 0; i < kCount; ++i)
    if (!kNames[i].empty()) visit(kNames[i], kFrom + i);
}

}  // namespace flexspline::interchange
