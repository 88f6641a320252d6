#include "host/common/text/nearest.hpp"

#include <algorithm>
#include <numeric>

namespace flexspline::text {
namespace {

// Damerau's restricted edit distance (optimal string alignment): letters inserted, deleted, substituted, or two
// neighbours transposed, none of them twice. Three rows of its table at a time.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, above, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(above);
    above = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({row[j - 1] + 1, above[j] + 1, above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest(std::string_view word, std::span<const std::string_view> known, std::size_t always_allowed) {
  std::string best;
  std::size_t fewest = std::max(always_allowed, word.size() / 3) + 1;
  for (const std::string_view candidate : known) {
    const std::size_t count = edits(word, candidate);
    if (count >= fewest) continue;
    fewest = count;
    best = candidate;
  }
  return best;
}

std::string nearest_or_first_words(std::string_view word, std::span<const std::string_view> known,
                                   std::size_t always_allowed) {
  std::string best = nearest(word, known, always_allowed);
  if (!best.empty() || word.size() < 3) return best;
  std::size_t fewest = std::max(always_allowed, word.size() / 3) + 1;
  for (const std::string_view candidate : known)
    for (std::size_t at = candidate.find('_'); at != std::string_view::npos; at = candidate.find('_', at + 1)) {
      const std::size_t count = edits(word, candidate.substr(0, at));
      if (count >= fewest) continue;
      fewest = count;
      best = candidate;
    }
  return best;
}

std::vector<std::string> nearest_first(std::string_view word, std::vector<std::string> known) {
  std::stable_sort(known.begin(), known.end(),
                   [&](const std::string& a, const std::string& b) { return edits(word, a) < edits(word, b); });
  return known;
}

std::string nearest(std::string_view word, std::initializer_list<std::string_view> known, std::size_t always_allowed) {
  return nearest(word, std::span<const std::string_view>(known.begin(), known.size()), always_allowed);
}

}  // namespace flexspline::text
