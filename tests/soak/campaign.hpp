// Which drives a campaign simulates, and what is stored of each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/soak/diagnose_case.hpp"

namespace flexspline::soak {

// Sizes of hidden effects, over their usual ones.
inline constexpr double kScales[] = {1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01};

// Seeds below kFirstTestSeed were used while the diagnosis was written and set its limits; the others test it.
inline constexpr std::uint64_t kFirstTuningSeed = 1;
inline constexpr std::uint64_t kLastTuningSeed = 1099;
// 7001 to 7999 and 20001 to 21999 tested earlier versions; their failures have been examined since.
inline constexpr std::uint64_t kFirstTestSeed = 30001;

// Round `round` of the test campaign: every effect once, with sizes and variations of friction that change from round
// to round, pairs, truths that no effect of the catalogue describes, and sets with nothing hidden.
std::vector<Case> test_round(std::uint64_t round);
// Sets with nothing hidden on tuning seeds; none once those are used up.
std::vector<Case> calibration_round(std::uint64_t round);

// Results, one per line, so that a stopped campaign can continue. A file of another version of the program is renamed.
class Results {
 public:
  Results(std::filesystem::path file, const std::string& version);
  bool has(const Case& what) const;
  void add(const Outcome& outcome);
  const std::vector<Outcome>& all() const { return outcomes_; }

 private:
  std::filesystem::path file_;
  std::vector<Outcome> outcomes_;
};

}  // namespace flexspline::soak
