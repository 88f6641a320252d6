// Which build of the tool this is: printed by --version and written into its files.
#pragma once

#include <string>
#include <string_view>

namespace flexspline::text {

// Of the project: "0.1.0".
std::string_view version();

// The output of `git describe` for the source when it was built, with "+changes" where files differed from that;
// "unknown" where the source came without git.
std::string_view revision();

// Name and version of the compiler: "g++ 12.2.0".
std::string_view compiler();

// "flexspline 0.1.0 (c7aee04, g++ 12.2.0)": of one build always the same, so two runs write the same files.
const std::string& tool_name();

}  // namespace flexspline::text
