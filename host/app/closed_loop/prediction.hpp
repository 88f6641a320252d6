// What compensation will be worth, before anything is flashed: the motion is run on twins of which the model is true,
// each with parameters drawn from what the identification leaves open.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/app/closed_loop/plant_text.hpp"
#include "host/app/closed_loop/runs.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::closed_loop {

// What the drive would be given.
struct Candidate {
  std::string label;  // "base", "added", "active", "new"
  std::vector<std::uint8_t> block;
};

struct Question {
  model::Model identified;  // the best that is known of the drive
  TwinHardware hardware;
  std::vector<Candidate> candidates;
  std::string scenario;
  double seconds = 0.0;  // zero: what the scenario says
  int draws = 8;
  std::uint64_t seed = 1;
  std::uint32_t tick_hz = kTwinTickHz;  // of the candidates' blocks
};

// RMS error with this candidate's compensation over that without any, same loops: its expectation and the interval in
// which a measured one will be with 95 %.
struct Prediction {
  std::string label;
  double rms_none_rad = 0.0;
  double rms_error_rad = 0.0;
  double ratio = 0.0;
  double low = 0.0;
  double high = 0.0;
  int draws = 0;
  bool stable = true;  // no draw ended in a fault
};

// One for each candidate. Parameters are drawn apart from each other, normally with the standard deviations of the
// model file, as that holds no correlations: where estimates are correlated the interval is too wide. Throws
// std::runtime_error with the reason where a twin cannot be what the model says.
std::vector<Prediction> predict(const Question& question, const Runner& run);

// A model whose parameters are drawn: draw `number` of a seed is always the same.
model::Model drawn(const model::Model& model, std::uint64_t seed, std::uint64_t number);

}  // namespace flexspline::closed_loop
