// What a diagnosis found, as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/output/answers/console.hpp"

namespace flexspline::output {

// Verdict, evidence, candidates, effects that cannot be distinguished, with the experiment that separates them, where
// the error is, what to do next. `add_command`: what to type to add the named effect, with EFFECT where its name
// goes. `drive`, of the model, and `dataset`, where they are known.
void print_diagnosis(Console& console, const selection::Diagnosis& found, const std::string& add_command,
                     const model::Drive* drive = nullptr, const data::Dataset* dataset = nullptr);

// "flexspline-diagnose/1". With more than one round, `named` is `kept`: all that were added and not removed since.
nlohmann::json diagnosis_json(const selection::Diagnosis& found);
nlohmann::json rounds_json(const std::vector<selection::Diagnosis>& rounds,
                           const std::vector<selection::NamedEffect>& kept);

}  // namespace flexspline::output
