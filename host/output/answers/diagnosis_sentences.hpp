// Sentences about a diagnosis, which the terminal and the report page have in common.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::output {

// "torque_ripple:2", as the command `add` takes it.
std::string effect_label(const std::string& effect, const std::optional<double>& order);
// "torque_ripple (2 per turn)", for people.
std::string effect_in_words(const std::string& effect, const std::optional<double>& order);

// The candidate that became this name; null where it is none of them.
const selection::Candidate* candidate_of(const selection::Diagnosis& found, const selection::NamedEffect& named);

// "The model lacks stribeck_gaussian."
std::string verdict_in_words(const selection::Diagnosis& found);

// "motor balance: error 0.012 N*m, 0.013 N*m in cross-validation; noise 0.004 N*m (from periods), ..."
std::string error_in_words(const selection::Diagnosis& found);

// How certain the names are, by the method that decided: in how many subsamples each was chosen, with the result on
// the experiments that are held out; or the scores. Empty where scores decided and nothing is named.
std::vector<std::string> certainty_in_words(const selection::Diagnosis& found);

// What these data neither show nor rule out, and what to record.
std::vector<std::string> possible_in_words(const selection::Diagnosis& found);

// Which parameters differ between experiments, and with what.
std::vector<std::string> trends_in_words(const selection::Diagnosis& found);

}  // namespace flexspline::output
