// What is embedded in the executable for the report page; embed.cmake makes the definitions.
#pragma once

#include <string_view>

namespace flexspline::report {

extern const std::string_view kToolVersion;
extern const std::string_view kTemplate;  // HTML with {{NAME}} where a part goes
extern const std::string_view kStyle;
extern const std::string_view kScript;
extern const std::string_view kClosedLoopScript;  // of the page of `hil`
extern const std::string_view kUplotScript;
extern const std::string_view kUplotStyle;
extern const std::string_view kUplotLicence;

}  // namespace flexspline::report
