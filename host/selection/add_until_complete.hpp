// Effects added one after the other until nothing is missing.
#pragma once

#include <string>
#include <vector>

#include "host/selection/diagnosis.hpp"

namespace flexspline::selection {

struct Completion {
  // Each as diagnose() says it of the model as it was then. The effect that a round names is in the model of the next;
  // the last round names what is not worth adding, or nothing.
  std::vector<Diagnosis> rounds;
  std::vector<std::string> removed;  // as named: effects that were added and became needless
  model::Model model;                // with what was added, refitted
};

// Adds what diagnose() names until it names nothing or a group that cannot be distinguished, the next fall of
// chi-square is under 0.3 % of the first one with the error at the noise floor, or `most_rounds` are over. After each
// addition those made before are tried without: what is needless then is removed. Throws what diagnose() and add()
// throw. `said`, where it is not empty, is called with each round as it ends.
Completion add_until_complete(const data::Dataset& dataset, const model::Model& model, const Options& options,
                              std::size_t most_rounds, const std::function<void(const Diagnosis&)>& said = {});

// Of effects of the model, by their ids, the one whose left-out rows miss it least, where that is too little to have
// been named for: empty where all are needed. Effects that took the place of others are not tried.
std::string needless(const data::Dataset& dataset, const model::Model& model, const std::vector<std::string>& ids,
                     const Options& options);

}  // namespace flexspline::selection
