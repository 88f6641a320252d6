// The results of a campaign as a page, and the limit that the diagnosis takes from them.
#pragma once

#include <string>
#include <vector>

#include "tests/soak/diagnose_case.hpp"

namespace flexspline::soak {

// Markdown: false alarms, names by size, errors, coverage, wrong names, targets.
std::string page_of(const std::vector<Outcome>& outcomes, const std::string& version);

// The header host/engine/selection/named_score.hpp from the scores of calibration sets.
std::string threshold_header(const std::vector<Outcome>& outcomes, const std::string& version);

}  // namespace flexspline::soak
