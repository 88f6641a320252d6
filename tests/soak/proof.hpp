// The errors that pack proves, compared with the worst seen along directed samples of many random models.
#pragma once

#include <string>

namespace flexspline::soak {

// For so many minutes; writes a page. Returns 1 where a sample was outside what was proven.
int run_proof_campaign(double minutes, const std::string& page, const std::string& version);

}  // namespace flexspline::soak
