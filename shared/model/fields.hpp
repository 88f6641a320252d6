// The members of an aggregate, one by one, without a list of them: so that the coefficients of an effect are written
// into a parameter block and read from it with nothing but their declaration in the effect's header.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace flexspline::model {

namespace detail {
struct Anything {
  template <class T>
  constexpr operator T() const;
};
template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires {
    T{(static_cast<void>(I), Anything{})...};
  };
}
// Members of an aggregate; arrays of a number of members have to be std::array, which counts as one.
template <class T, std::size_t Count = 0>
constexpr std::size_t members_of() {
  if constexpr (takes<T>(std::make_index_sequence<Count + 1>{})) {
    return members_of<T, Count + 1>();
  } else {
    return Count;
  }
}
}  // namespace detail

// Calls visit(member) for each member in the order of their declaration; up to 16 of them.
template <class T, class Visit>
constexpr void for_each_member(T& object, Visit&& visit) {
  constexpr std::size_t kMembers = detail::members_of<std::remove_const_t<T>>();
  static_assert(kMembers <= 16, "more members than for_each_member knows: group some in a std::array");
  const auto all = [&](auto&... members) { (visit(members), ...); };
  if constexpr (kMembers == 0) {
    static_cast<void>(all);
  } else if constexpr (kMembers == 1) {
    auto& [a] = object;
    all(a);
  } else if constexpr (kMembers == 2) {
    auto& [a, b] = object;
    all(a, b);
  } else if constexpr (kMembers == 3) {
    auto& [a, b, c] = object;
    all(a, b, c);
  } else if constexpr (kMembers == 4) {
    auto& [a, b, c, d] = object;
    all(a, b, c, d);
  } else if constexpr (kMembers == 5) {
    auto& [a, b, c, d, e] = object;
    all(a, b, c, d, e);
  } else if constexpr (kMembers == 6) {
    auto& [a, b, c, d, e, f] = object;
    all(a, b, c, d, e, f);
  } else if constexpr (kMembers == 7) {
    auto& [a, b, c, d, e, f, g] = object;
    all(a, b, c, d, e, f, g);
  } else if constexpr (kMembers == 8) {
    auto& [a, b, c, d, e, f, g, h] = object;
    all(a, b, c, d, e, f, g, h);
  } else if constexpr (kMembers == 9) {
    auto& [a, b, c, d, e, f, g, h, i] = object;
    all(a, b, c, d, e, f, g, h, i);
  } else if constexpr (kMembers == 10) {
    auto& [a, b, c, d, e, f, g, h, i, j] = object;
    all(a, b, c, d, e, f, g, h, i, j);
  } else if constexpr (kMembers == 11) {
    auto& [a, b, c, d, e, f, g, h, i, j, k] = object;
    all(a, b, c, d, e, f, g, h, i, j, k);
  } else if constexpr (kMembers == 12) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l] = object;
    all(a, b, c, d, e, f, g, h, i, j, k, l);
  } else if constexpr (kMembers == 13) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m] = object;
    all(a, b, c, d, e, f, g, h, i, j, k, l, m);
  } else if constexpr (kMembers == 14) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = object;
    all(a, b, c, d, e, f, g, h, i, j, k, l, m, n);
  } else if constexpr (kMembers == 15) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = object;
    all(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o);
  } else {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = object;
    all(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p);
  }
}

}  // namespace flexspline::model
