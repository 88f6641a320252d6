// Which build of the tool wrote a model file, as a comment: no reader depends on it.
#pragma once

#include <string>

namespace flexspline::model {

// `text` with "# Last written by flexspline 0.1.0 (...)." as its last line, in place of an older such line. The same
// text comes back where it is signed again by the same build.
std::string signed_by_tool(std::string text);

}  // namespace flexspline::model
