#include "host/drive_link/deployment/fold.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "host/physics/catalogue/user_defined_effect.hpp"
#include "shared/effects/variables.hpp"

namespace flexspline::deployment {
namespace {

constexpr std::array<const char*, 3> kBalanceNames = {"motor", "transmission", "load"};
// An odd number of points has one at zero, where most laws bend.
constexpr std::size_t kPoints = 255, kPointsOfTurn = 256;
constexpr std::size_t kChecked = 16;  // places between two points at which the error is measured
constexpr double kFoldedRange = 2.0;  // bases

const effects::VariableInfo& info_of(effects::Variable variable) {
  return *std::find_if(std::begin(effects::kVariables), std::end(effects::kVariables),
                       [&](const auto& info) { return info.variable == variable; });
}

const catalogue::Entry& table_entry() {
  return *catalogue::find_user_defined(catalogue::kTableEffect);
}

}  // namespace

std::size_t table_number() {
  return table_entry().id;
}

std::optional<FoldedTable> folded(const catalogue::ResolvedEffect& resolved,
                                  const effects::DriveConstants<double>& constants,
                                  const effects::DriveConstants<double>& bases) {
  const catalogue::Entry& entry = *resolved.entry;
  const std::vector<double>& parameters = resolved.values;
  const auto single = catalogue::single_variable(entry, parameters, constants);
  if (!single) return {};
  const effects::VariableInfo& variable = info_of(single->variable);
  const bool magnitude =
      single->variable == effects::Variable::speed || single->variable == effects::Variable::torque_magnitude;
  const double most = kFoldedRange * effects::base_of(single->variable, bases);
  const std::vector<double> at = variable.periodic ? catalogue::points_of_turn(kPointsOfTurn)
                                                   : catalogue::even_points(magnitude ? 0.0 : -most, most, kPoints);
  const auto torque = [&](std::span<const double> x) {
    return catalogue::torque_over(entry, parameters, constants, single->variable, x);
  };
  FoldedTable result;
  model::Definition d;
  d.balance = catalogue::balance_name(entry.info->balance);
  if (resolved.effect->definition) d.balance = resolved.effect->definition->balance;
  d.variable = std::string(variable.name);
  d.times_direction = single->times_direction;
  d.table.at = at;
  d.table.value = torque(at);
  d.table.fixed = true;
  // The error of linear interpolation, in addition to that of the points.
  const std::size_t steps = variable.periodic ? at.size() : at.size() - 1;
  for (std::size_t k = 0; k < steps; ++k) {
    const double step = at[1] - at[0];
    const double left = d.table.value[k], right = d.table.value[(k + 1) % at.size()];
    std::vector<double> x;
    for (std::size_t i = 1; i < kChecked; ++i)
      x.push_back(at[k] + step * static_cast<double>(i) / static_cast<double>(kChecked));
    const std::vector<double> exact = torque(x);
    for (std::size_t i = 1; i < kChecked; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(kChecked);
      result.error = std::max(result.error, std::abs(exact[i - 1] - (left + (right - left) * share)));
    }
  }
  result.parameters = catalogue::table_parameters(d);
  return result;
}

model::Definition definition_of(const std::vector<double>& p) {
  const catalogue::Entry& entry = table_entry();
  const auto stated = [&](const char* name, double least, double most) {
    const std::size_t at = entry.index_of(name);
    if (p.size() != entry.parameters.size() || !(p[at] >= least && p[at] <= most))
      throw std::invalid_argument("these are no parameters of a table");
    return static_cast<std::size_t>(p[at]);
  };
  model::Definition d;
  const effects::VariableInfo& variable = info_of(
      static_cast<effects::Variable>(stated("variable", 0.0, static_cast<double>(effects::Variable::temperature))));
  const std::size_t points = stated("points", 2.0, static_cast<double>(catalogue::kMostPoints));
  d.variable = std::string(variable.name);
  d.balance = kBalanceNames.at(stated("balance", 0.0, 2.0));
  d.times_direction = stated("times_direction", 0.0, 1.0) != 0;
  d.table.at = variable.periodic ? catalogue::points_of_turn(points)
                                 : catalogue::even_points(p[entry.index_of("from")], p[entry.index_of("to")], points);
  const auto first = p.begin() + static_cast<std::ptrdiff_t>(entry.index_of("value"));
  d.table.value.assign(first, first + static_cast<std::ptrdiff_t>(points));
  d.table.fixed = true;
  return d;
}

}  // namespace flexspline::deployment
