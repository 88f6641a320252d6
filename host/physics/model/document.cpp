#include "host/physics/model/document.hpp"

#include <fmt/format.h>

#include "host/physics/model/model.hpp"

namespace flexspline::model {

Node parse_document(std::string_view text, std::string_view file_name) {
  try {
    return text::parse_toml(text);
  } catch (const text::TomlError& error) {
    // Of a text that names no format of models, no line needs a correction.
    if (text.find("flexspline-model/") == std::string_view::npos)
      throw ModelError(
          fmt::format("{}:{}: this is not a model file, and not TOML: {}; a model file begins with format = "
                      "\"flexspline-model/1\"",
                      file_name, error.line(), error.what()));
    throw ModelError(fmt::format("{}:{}: not TOML: {}; {}", file_name, error.line(), error.what(), error.remedy()));
  }
}

}  // namespace flexspline::model
