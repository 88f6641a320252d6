// Which drives a campaign looks at, and what is kept of each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/soak/diagnose_case.hpp"

namespace flexspline::soak {

// Sizes of hidden effects, over their usual ones.
inline constexpr double kScales[] = {1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01};

// Seeds below kFirstJudgingSeed were looked at while the diagnosis was written and set its limits; the others judge it.
inline constexpr std::uint64_t kFirstTuningSeed = 1;
inline constexpr std::uint64_t kLastTuningSeed = 1099;
// 7001 to 7999 and 20001 to 21999 judged versions before, and what went wrong there was looked at since.
inline constexpr std::uint64_t kFirstJudgingSeed = 30001;

// Round `round` of the campaign that judges: every effect once, its size and the friction's variation going round from
// round to round, pairs, truths that no effect of the catalogue describes, and sets with nothing hidden.
std::vector<Case> judging_round(std::uint64_t round);
// Sets with nothing hidden on tuning seeds; none once those are used up.
std::vector<Case> calibration_round(std::uint64_t round);

// Results as they come, one a line, so that a campaign that was stopped goes on where it was. A file of another version
// of the program is put aside.
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
