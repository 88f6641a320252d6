#include "host/engine/estimation/friction_groups.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace flexspline::estimation {
namespace {

// Friction of the two directions varies by itself: a group more for each friction whose asymmetry the model has.
void add_asymmetries(const Terms& terms, const std::vector<ParameterRef>& linear, std::vector<FrictionGroup>& groups) {
  std::vector<FrictionGroup> by_direction;
  for (const FrictionGroup& group : groups) {
    FrictionGroup own{group.name + " by direction", {}, {}, {}};
    for (std::size_t j = 0; j < linear.size(); ++j) {
      const std::string_view asymmetry_of = terms[linear[j].term].entry->info->asymmetry_of;
      for (const Eigen::Index of : group.columns)
        if (!asymmetry_of.empty() && terms[linear[static_cast<std::size_t>(of)].term].entry->name() == asymmetry_of)
          own.asymmetries.push_back({static_cast<Eigen::Index>(j), of});
    }
    if (!own.asymmetries.empty()) by_direction.push_back(std::move(own));
  }
  for (FrictionGroup& group : by_direction) groups.push_back(std::move(group));
}

}  // namespace

std::vector<FrictionGroup> friction_groups(const Terms& terms, const std::vector<ParameterRef>& linear,
                                           const std::vector<ParameterRef>& nonlinear) {
  std::vector<FrictionGroup> groups;
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const std::string_view surface = terms[linear[j].term].entry->info->surface;
    if (surface.empty()) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const FrictionGroup& g) { return g.name == surface; });
    if (group == groups.end()) group = groups.insert(groups.end(), {std::string(surface), {}, {}, {}});
    group->columns.push_back(static_cast<Eigen::Index>(j));
    const Term& term = terms[linear[j].term];
    const auto& varies = term.entry->parameters[linear[j].parameter];
    for (std::size_t k = 0; k < nonlinear.size(); ++k) {
      const auto& nonlinear_ref = term.entry->parameters[nonlinear[k].parameter];
      // A parameter in the same unit is a part of the friction, and varies with it.
      if (nonlinear[k].term == linear[j].term && nonlinear_ref.per == varies.name &&
          nonlinear_ref.unit.rotary != varies.unit.rotary)
        group->ratio_parameters.push_back({static_cast<Eigen::Index>(k), term.values[nonlinear[k].parameter]});
    }
  }
  add_asymmetries(terms, linear, groups);
  return groups;
}

Eigen::MatrixXd random_effect_directions(const std::vector<FrictionGroup>& groups, const Eigen::VectorXd& theta,
                                         const Eigen::VectorXd& size, Eigen::Index first_nonlinear) {
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(theta.size(), static_cast<Eigen::Index>(groups.size()));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto column = static_cast<Eigen::Index>(g);
    for (const Eigen::Index j : groups[g].columns) u(j, column) = theta[j];
    for (const FrictionGroup::RatioParameter& s : groups[g].ratio_parameters)
      if (const Eigen::Index j = first_nonlinear + s.nonlinear_ref; j < theta.size()) u(j, column) = -s.ratio * size[j];
    for (const auto& [j, of] : groups[g].asymmetries) u(j, column) = theta[of] * size[j] / size[of];
  }
  return u;
}

Eigen::MatrixXd friction_torques(const Eigen::MatrixXd& slopes, const Eigen::VectorXd& theta, const Terms& terms,
                                 const std::vector<ParameterRef>& linear, const std::vector<ParameterRef>& nonlinear) {
  return slopes * random_effect_directions(friction_groups(terms, linear, nonlinear), theta,
                                           Eigen::VectorXd::Ones(slopes.cols()),
                                           static_cast<Eigen::Index>(linear.size()));
}

}  // namespace flexspline::estimation
