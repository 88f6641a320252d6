#include "host/estimation/friction_groups.hpp"

#include <algorithm>
#include <string_view>

namespace flexspline::estimation {

std::vector<FrictionGroup> friction_groups(const Terms& terms, const std::vector<ParameterRef>& linear,
                                           const std::vector<ParameterRef>& nonlinear) {
  std::vector<FrictionGroup> groups;
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const std::string_view surface = terms[linear[j].term].entry->info->surface;
    if (surface.empty()) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const FrictionGroup& g) { return g.name == surface; });
    if (group == groups.end()) group = groups.insert(groups.end(), {std::string(surface), {}, {}});
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
  }
  return u;
}

}  // namespace flexspline::estimation
