// A plan of motions and what is expected of it, as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/engine/planning/design.hpp"
#include "host/output/answers/console.hpp"

namespace flexspline::output {

// What is to be recorded, what the person does, what it will show. `file` is where the plan was written.
void print_plan(Console& console, const planning::Design& design, const std::string& file);

// "flexspline-plan-answer/1".
nlohmann::json plan_json(const planning::Design& design);

}  // namespace flexspline::output
