#include "host/common/text/build_identity.hpp"

#include <fmt/format.h>

#include "host/common/text/flexspline_revision.hpp"

namespace flexspline::text {

std::string_view version() {
  return kVersion;
}

std::string_view revision() {
  return kRevision;
}

std::string_view compiler() {
#if defined(__clang__)
  return "clang++ " __clang_version__;
#elif defined(__GNUC__)
  return "g++ " __VERSION__;
#else
  return "unknown compiler";
#endif
}

const std::string& tool_name() {
  static const std::string name = fmt::format("flexspline {} ({}, {})", version(), revision(), compiler());
  return name;
}

}  // namespace flexspline::text
