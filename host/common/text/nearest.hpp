// The name that is likely meant by one that is not known.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace flexspline::text {

// The entry of `known` with the fewest edits to `word` (letters inserted, deleted, substituted, or two neighbours
// transposed), the first of several; empty where more than a third of the word, and more than `always_allowed` letters,
// would change.
std::string nearest(std::string_view word, std::span<const std::string_view> known, std::size_t always_allowed = 1);
std::string nearest(std::string_view word, std::initializer_list<std::string_view> known,
                    std::size_t always_allowed = 1);

// The same; where none is near as a whole, one whose first words are: "stribek" is near "stribeck_gaussian".
std::string nearest_or_first_words(std::string_view word, std::span<const std::string_view> known,
                                   std::size_t always_allowed = 1);

// `known` by the number of such edits to `word`, the fewest first.
std::vector<std::string> nearest_first(std::string_view word, std::vector<std::string> known);

}  // namespace flexspline::text
