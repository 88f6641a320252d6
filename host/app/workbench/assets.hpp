// The built page, embedded in the executable; embed.cmake makes the definitions.
#pragma once

#include <string_view>

namespace flexspline::workbench {

extern const std::string_view kPage;
extern const std::string_view kScript;
extern const std::string_view kStyle;

}  // namespace flexspline::workbench
