#include "host/output/answers/learned_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::output {
namespace {

using nlohmann::json;

constexpr double kNinetyFive = 1.96;

std::string unit_of(const std::string& variable, const std::string& torque_unit) {
  const effects::VariableInfo* info = catalogue::find_variable(variable);
  return info ? std::string(torque_unit == "N" ? info->unit.linear : info->unit.rotary) : "";
}

}  // namespace

EffectCurve curve_of_table(const model::Definition& definition, const model::Table& table,
                           const std::string& torque_unit) {
  EffectCurve curve;
  curve.x = table.at;
  curve.y = table.value;
  curve.x_label = fmt::format("{} ({})", definition.variable, unit_of(definition.variable, torque_unit));
  curve.y_label = fmt::format("torque on the {} balance ({})", definition.balance, torque_unit);
  if (definition.times_direction) curve.caption = "times the direction of motion";
  return curve;
}

std::string learned_table_text(const std::string& id, const std::string& variable,
                               const estimation::LearnedTable& learned, const std::string& torque_unit) {
  const model::Table& table = learned.table;
  const auto [low, high] = std::minmax_element(table.value.begin(), table.value.end());
  double error = 0.0;
  for (const double std : table.std) error = std::max(error, std);
  const auto unseen = std::count(learned.visited.begin(), learned.visited.end(), std::uint8_t{0});
  const std::string unit = unit_of(variable, torque_unit);
  std::string text = wrapped(fmt::format(
      "{}: {} points over {} from {} to {}, values from {} to {}, standard errors up to {}; {:.1f} effective "
      "degrees of freedom.",
      id, table.at.size(), variable, number(table.at.front()), with_unit(table.at.back(), unit), number(*low),
      with_unit(*high, torque_unit), with_unit(error, torque_unit), learned.effective_degrees_of_freedom));
  text += "\n" +
          wrapped(fmt::format("On samples left out of its fit the squared error decreases by {:.1f} % (score {:.0f}).",
                              learned.decrease_percent, learned.score));
  if (!learned.left_to.empty())
    text += "\n" + wrapped(fmt::format("What {} can draw as well was left to {}: the table holds what they cannot.",
                                       listed(learned.left_to), learned.left_to.size() > 1 ? "them" : "it"));
  if (unseen > 0)
    text +=
        "\n" + wrapped(fmt::format("{} of the points are where these data have no samples: do not use them.", unseen));
  model::Definition definition;
  definition.variable = variable;
  EffectCurve curve = curve_of_table(definition, table, torque_unit);
  curve.y_label = fmt::format("torque ({})", torque_unit);
  return text + "\n" + curve_text(curve, takes_braille());
}

json learned_table_json(const std::string& id, const model::Definition& definition,
                        const estimation::LearnedTable& learned, const std::string& torque_unit) {
  json points = json::array();
  const model::Table& table = learned.table;
  for (std::size_t k = 0; k < table.at.size(); ++k) {
    const double std = k < table.std.size() ? table.std[k] : std::nan("");
    points.push_back(
        {{"at", json_number(table.at[k])},
         {"value", json_number(table.value[k])},
         {"std", json_number(std)},
         {"interval",
          {json_number(table.value[k] - kNinetyFive * std), json_number(table.value[k] + kNinetyFive * std)}},
         {"visited", k < learned.visited.size() && learned.visited[k] != 0}});
  }
  return {{"id", id},
          {"effect", std::string(catalogue::kTableEffect)},
          {"variable", definition.variable},
          {"variable_unit", unit_of(definition.variable, torque_unit)},
          {"times_direction", definition.times_direction},
          {"balance", definition.balance},
          {"unit", torque_unit},
          {"points", std::move(points)},
          {"chi2_fall_percent", json_number(learned.decrease_percent)},
          {"rmse_cv_before", json_number(learned.rmse_cv_before)},
          {"rmse_cv_after", json_number(learned.rmse_cv_after)},
          {"score", json_number(learned.score)},
          {"left_to", learned.left_to}};
}

}  // namespace flexspline::output
