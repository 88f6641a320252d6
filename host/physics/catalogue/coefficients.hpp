// From the parameters of an effect to its coefficients, in any number system of the host.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "shared/effects/effect.hpp"

namespace flexspline::catalogue {

inline constexpr std::size_t position_of(std::span<const effects::ParameterInfo> parameters, std::string_view name) {
  std::size_t at = 0;
  while (at < parameters.size() && parameters[at].name != name) ++at;
  return at;
}

// Coefficients divide by lengths and by what others are stated per. A parameter of zero that has none of these (an
// effect that is switched off, a search that has not begun) gets the smallest value that leaves the others finite.
template <class E, class N>
typename E::template Coefficients<N> coefficients_of(const typename N::Parameter* parameters,
                                                     const effects::DriveConstants<typename N::Parameter>& drive) {
  using P = typename N::Parameter;
  constexpr std::span<const effects::ParameterInfo> kInfos = E::kParameters;
  std::array<P, kInfos.size()> values;
  std::copy(parameters, parameters + kInfos.size(), values.begin());
  for (const auto& info : kInfos) {
    if (info.per.empty()) continue;
    P& per = values[position_of(kInfos, info.per)];
    if (per == P(0.0)) per = P(1e-30);
  }
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (!(kInfos[p].low > 0.0) || values[p] != P(0.0)) continue;
    values[p] = P(kInfos[p].low);
    if (!kInfos[p].per.empty()) values[p] = values[p] * values[position_of(kInfos, kInfos[p].per)];
  }
  return E::template derive<N>(values.data(), drive);
}

}  // namespace flexspline::catalogue
