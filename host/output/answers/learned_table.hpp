// A table that was learnt from data, as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/engine/estimation/learned_table.hpp"
#include "host/output/answers/effect_curve.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::output {

// What was learnt in a paragraph and a picture; `torque_unit` as "N*m".
std::string learned_table_text(const std::string& id, const std::string& variable,
                               const estimation::LearnedTable& learned, const std::string& torque_unit);

// {"id","effect","variable","variable_unit","times_direction","balance","unit","points":[{"at","value","std","interval",
// "visited"}],"chi2_decrease_percent","rmse_cv_before","rmse_cv_after","score","left_to":[]}
nlohmann::json learned_table_json(const std::string& id, const model::Definition& definition,
                                  const estimation::LearnedTable& learned, const std::string& torque_unit);

// A table as a line.
EffectCurve curve_of_table(const model::Definition& definition, const model::Table& table,
                           const std::string& torque_unit);

}  // namespace flexspline::output
