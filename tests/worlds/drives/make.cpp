#include "tests/worlds/drives/make.hpp"

#include <stdexcept>
#include <string>

namespace flexspline::worlds::drives {
namespace {

constexpr double kLeastExcess = 0.03;
constexpr int kMostAttempts = 200;

/// Adds the records that are fitted, or held out; false where the controller does not hold a motion.
bool add_held(const Case& drive, bool is_holdout, std::vector<Measured>& records) {
  Trace trace;
  for (const RecordPlan& plan : drive.records) {
    if (plan.is_holdout != is_holdout) continue;
    simulate(drive, plan, trace);
    if (!is_held(plan, trace)) return false;
    records.push_back(measure(drive, plan, trace));
  }
  return true;
}

}  // namespace

Made make_case(const Kind& kind, std::uint64_t seed) {
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    Made made{draw(kind, seed, attempt), {}, {}};
    if (!add_held(made.drive, false, made.records)) continue;
    if (!made.drive.hidden.effect.empty()) {
      made.truth.excess = hidden_excess(made.drive, made.records);
      if (made.truth.excess < kLeastExcess) continue;
    }
    const std::vector<Measured> fitted = made.records;
    if (!add_held(made.drive, true, made.records)) continue;
    complete(made.truth, made.drive, fitted);
    return made;
  }
  throw std::runtime_error("no " + std::string(kind.name) + " of seed " + std::to_string(seed) +
                           " can be held by its controller");
}

}  // namespace flexspline::worlds::drives
