#include "host/physics/model/document.hpp"

#include <fmt/format.h>

#include "host/physics/model/model.hpp"

namespace flexspline::model {

Node parse_document(std::string_view text, std::string_view file_name) {
  try {
    return text::parse_toml(text);
  } catch (const text::TomlError& error) {
    throw ModelError(fmt::format("{}:{}: not TOML: {}; {}", file_name, error.line(), error.what(), error.remedy()));
  }
}

}  // namespace flexspline::model
