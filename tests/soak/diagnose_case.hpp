// One simulated drive with something hidden, or nothing: the answer of the diagnosis, and the truth.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace flexspline::soak {

struct Case {
  std::string hidden;  // effects of the plant that the model does not know, separated by "+"; empty: none
  double scale = 1.0;
  std::uint64_t seed = 0;
  double friction_variation = 0.0;  // relative, from record to record
  double noise_correlation = 0.0;   // AR(1) coefficient at the sample rate
  std::string with;                 // further effects that the drive has and the model knows; separated by commas

  // One line without tabs that identifies the case: the key by which a campaign continues.
  std::string key() const;
};

// One estimated parameter of a hidden effect after it was added by its true name.
struct Recovered {
  std::string name;
  bool nonlinear = false;
  double error = 0.0;  // estimate over truth, less one
  bool covered = false;
};

struct Outcome {
  Case what;
  std::string named;    // "+" between effects that could not be distinguished, "-" for none
  std::string verdict;  // as the diagnosis says it
  bool right = false;
  bool found_all = false;           // of several, by adding what is named until nothing is; of one, among those named
  double missing_over_noise = 0.0;  // RMS of what the hidden effects add to their balance, over the noise floor
  std::optional<double> holdout_over_floor;  // after the hidden effect was added
  std::vector<Recovered> recovered;
  double best_score = 0.0;  // of all candidates that are admissible, named or not
  std::string detail;       // the first candidates
  double seconds = 0.0;     // of the diagnosis alone
};

// Records the demo's drive, diagnoses it with a model that lacks what is hidden, and, for a single hidden effect of the
// catalogue, adds it. Throws what those throw.
Outcome run(const Case& what);

}  // namespace flexspline::soak
