#include "host/output/answers/json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/common/text/build_identity.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::output {

using nlohmann::json;

json json_number(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}
json json_number(const std::optional<double>& value) {
  return value ? json_number(*value) : json(nullptr);
}
json json_numbers(const std::vector<double>& values) {
  json list = json::array();
  for (const double v : values) list.push_back(json_number(v));
  return list;
}

json json_parameter(const estimation::Estimate& e) {
  return {{"id", e.id},
          {"effect", e.effect},
          {"parameter", e.parameter},
          {"value", json_number(e.value)},
          {"unit", e.unit},
          {"std", json_number(e.std)},
          {"interval", json::array({json_number(e.low), json_number(e.high)})}};
}

void add_by_experiment(json& to, const estimation::ByExperiment& values) {
  to["average"] = json_number(values.average);
  to["spread_percent"] = json_number(values.spread_percent);
  to["reliable"] = values.reliable ? json(*values.reliable) : json(nullptr);
  to["counted"] = values.counted();
  to["left_out"] = values.left_out();
  json list = json::array();
  for (const estimation::ExperimentValue& v : values.per_experiment) {
    json one = {{"name", v.name}, {"value", json_number(v.value)}, {"std", json_number(v.std)}};
    if (!v.value) one["left_out"] = v.left_out;
    list.push_back(std::move(one));
  }
  to["per_experiment"] = std::move(list);
}

void save_json(const std::string& where, const json& content) {
  if (where.empty()) return;
  // Names come from the user's files and may be in any encoding.
  json answer = content;
  // The build that wrote it; an addition to the contract.
  if (answer.is_object() && !answer.contains("tool")) answer["tool"] = text::tool_name();
  const std::string text = answer.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  if (where == "-") {
    fmt::print("{}", text);
    return;
  }
  model::save(where, text);
}

}  // namespace flexspline::output
