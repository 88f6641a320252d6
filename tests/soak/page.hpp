// What a campaign found, as a page and as the limit that the diagnosis takes from it.
#pragma once

#include <string>
#include <vector>

#include "tests/soak/diagnose_case.hpp"

namespace flexspline::soak {

// Markdown: false alarms, named by size, confusion, errors, coverage, and what was missed of the targets.
std::string page_of(const std::vector<Outcome>& outcomes, const std::string& version);

// The header host/selection/named_score.hpp from the scores of calibration sets.
std::string threshold_header(const std::vector<Outcome>& outcomes, const std::string& version);

}  // namespace flexspline::soak
