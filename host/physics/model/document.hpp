// The TOML tree of a model file.
#pragma once

#include <string_view>

#include "host/common/text/toml.hpp"

namespace flexspline::model {

using text::Entry;
using text::Node;
using text::NodeKind;
using text::Span;

// The root table. Throws ModelError with `file_name`, line and the TOML reader's message.
Node parse_document(std::string_view text, std::string_view file_name);

}  // namespace flexspline::model
