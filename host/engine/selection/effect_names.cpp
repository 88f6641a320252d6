#include "host/engine/selection/effect_names.hpp"

#include <fmt/format.h>

namespace flexspline::selection {

std::string label_of(const NamedEffect& name) {
  return name.order ? fmt::format("{}:{:g}", name.effect, *name.order) : name.effect;
}

bool is_of_family(const NamedEffect& a, const NamedEffect& b) {
  if (a.order != b.order) return false;
  const catalogue::Entry &one = catalogue::get(a.effect), &other = catalogue::get(b.effect);
  return &one == &other || (!one.info->family.empty() && one.info->family == other.info->family) ||
         (one.is_presliding() && other.is_presliding());
}

const CandidateFit* candidate_named(const SearchedBalance& balance, const NamedEffect& name) {
  const auto at = std::ranges::find_if(balance.candidates, [&](const CandidateFit& t) { return name_of(t) == name; });
  return at == balance.candidates.end() ? nullptr : &*at;
}

}  // namespace flexspline::selection
