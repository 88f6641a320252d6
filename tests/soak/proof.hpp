// The errors that pack proves, beside the worst that is seen along directed samples of many random models.
#pragma once

#include <string>

namespace flexspline::soak {

// For so many minutes; writes a page. Returns 1 where a sample was outside what was proven.
int judge_proof(double minutes, const std::string& page, const std::string& version);

}  // namespace flexspline::soak
