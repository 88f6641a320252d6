// Foreign text in a message, at a length that can be read.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace flexspline::text {

// The first and the last characters of UTF-8 that fit into `most` bytes; what is no UTF-8 is cut anywhere.
std::string_view beginning_of(std::string_view text, std::size_t most);
std::string_view ending_of(std::string_view text, std::size_t most);

// At most `most` bytes of it, cut between characters of UTF-8; what is left out is counted: "abc... (20971517 more
// characters)".
std::string shortened(std::string_view text, std::size_t most);

}  // namespace flexspline::text
