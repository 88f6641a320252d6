// What a campaign found, as a page and as the limit that the diagnosis takes from it.
#pragma once

#include <string>
#include <vector>

#include "tests/soak/diagnose_case.hpp"

namespace flexspline::soak {

// Exact two-sided 95 % interval of a share (Clopper and Pearson 1934): where `count` of `total` were seen.
struct Interval {
  double low = 0.0, high = 1.0;
};
Interval exact_interval(std::size_t count, std::size_t total);

// A score that nothing passes in `share` of the sets with nothing hidden: the largest scores, above nine tenths of
// them, follow an exponential law as tails of log likelihood ratios do; its mean excess is taken at its upper 95 %
// bound.
double threshold_from(std::vector<double> null_scores, double share);

// Markdown: false alarms, named by size, confusion, errors, coverage, and what was missed of the targets.
std::string page_of(const std::vector<Outcome>& outcomes, const std::string& version);

// The header host/diagnosis/named_score.hpp from the scores of calibration sets.
std::string threshold_header(const std::vector<Outcome>& outcomes, const std::string& version);

}  // namespace flexspline::soak
