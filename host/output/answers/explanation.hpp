// What a named effect is, where it shows, what it does, and what to do about it: for a person at the machine.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/engine/selection/diagnosis.hpp"
#include "host/output/answers/console.hpp"

namespace flexspline::output {

// `unit` of the balance's errors. `drive`, where it is known, has what the effect's law refers to.
void print_explanation(Console& console, const selection::Candidate& candidate, const std::string& unit,
                       const model::Drive* drive = nullptr);

// "torque_ripple (2 per turn): 0.00077 N*m (RMS), 0.16 % of the rated torque, small"; empty where the effect has no
// size.
std::string size_in_words(const selection::Candidate& candidate, const std::string& unit);

// "coefficient 8.2e-4"; empty where there is none. A size that no such drive has is not visible in these data.
std::string detectable_in_words(const selection::Candidate& candidate, const model::Drive* drive = nullptr);

// P with "at_most" and "at", a list of P; null where there is none.
nlohmann::json detectable_json(const selection::Candidate& candidate);
nlohmann::json confounding_reasons_json(const selection::Candidate& candidate);
// List of {"from", "cause", "check", "cure", "reference"}; null where the effect has no order.
nlohmann::json order_causes_json(const selection::Candidate& candidate);
nlohmann::json evidence_json(const selection::Candidate& candidate, const std::string& unit);
// {"rms", "peak", "unit", "percent_of_rated"}; null where the effect is not named.
nlohmann::json size_json(const selection::Candidate& candidate, const std::string& unit);

}  // namespace flexspline::output
