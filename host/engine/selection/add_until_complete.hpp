// Effects added one after the other until nothing is missing.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

struct Completion {
  // The result of diagnose() for the model of that round. The effect that a round names is in the model of the next;
  // the last round names what is not worth adding, or nothing.
  std::vector<Diagnosis> rounds;
  std::vector<std::string> removed;  // as named: effects that were added and became needless
  model::Model model;                // with what was added, refitted
};

// Adds the effects that diagnose() names. Stops where it names none, or a group that cannot be distinguished; where the
// next decrease of chi-square is under 0.3 % of the first one and the error is at the noise floor; or after
// `most_rounds`. After each addition the earlier ones are tested, and removed where they are needless. Throws what
// diagnose() and add() throw. `progress`, where it is not empty, is called after each round.
Completion add_until_complete(const data::Dataset& dataset, const model::Model& model, const Options& options,
                              std::size_t most_rounds, const std::function<void(const Diagnosis&)>& progress = {});

// The effect among `ids` whose removal increases the error on left-out samples least, if by too little to be named;
// empty where all are needed. Effects that replaced others are not tried.
std::string needless(const data::Dataset& dataset, const model::Model& model, const std::vector<std::string>& ids,
                     const Options& options);

}  // namespace flexspline::selection
