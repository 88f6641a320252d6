// Stepwise selection: forward steps by diagnose(), after each of them one backward elimination (Efroymson 1960).
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::selection {

struct StepwiseSelection {
  // The result of diagnose() for the model of that round. The effect that a round names is in the model of the next;
  // the last round names what is not worth adding, or nothing.
  std::vector<Diagnosis> rounds;
  std::vector<NamedEffect> kept;     // in the model: added, and not removed since
  std::vector<std::string> removed;  // as named: effects that were added, no longer reduce the error, and are not kept
  model::Model model;                // with what was added, refitted

  void note_added(const NamedEffect& effect);
  // Returns whether it was removed before: naming it again would be an endless loop.
  bool note_removed(const std::string& label);

 private:
  std::vector<std::string> ever_removed_;
};

// Adds the effects that diagnose() names. Stops where it names none, or a group that cannot be distinguished; where the
// next decrease of chi-square is under 0.3 % of the first one and the error is at the noise floor; or after
// `most_rounds`. After each addition the earlier ones are tested, and removed where they no longer reduce the error
// significantly. Throws what diagnose() and add() throw. `progress`, where it is not empty, is called after each round.
StepwiseSelection add_until_complete(const data::Dataset& dataset, const model::Model& model, const Options& options,
                                     std::size_t most_rounds,
                                     const std::function<void(const Diagnosis&)>& progress = {});

// Id of the effect among `ids` whose removal lowers the score least, if by less than SelectionPolicy::named_score;
// empty where every removal costs more. Effects that replaced others are not tried.
std::string least_significant_effect(const data::Dataset& dataset, const model::Model& model,
                                     const std::vector<std::string>& ids, const Options& options);

}  // namespace flexspline::selection
