#include "host/engine/estimation/linearised.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/prepared_again.hpp"

namespace flexspline::estimation {
namespace {

// Whether values of a balance rest on what the motor's has to say as well (see combine_balances in identify.cpp): its
// own samples alone may not determine them, and a step on those would be of any size.
bool rests_on_motor_balance(const Identification& found, std::size_t b) {
  if (found.data[b].balance() == Balance::motor) return false;
  const auto adds = [&](const ParameterRef& ref) { return found.terms[ref.term].entry->adds_to(Balance::motor); };
  return std::ranges::any_of(found.fits[b].linear, adds) || std::ranges::any_of(found.fits[b].nonlinear, adds);
}

}  // namespace

std::vector<std::vector<Eigen::Index>> parameters_with_errors(const Identification& found) {
  std::vector<std::vector<Eigen::Index>> parameters(found.fits.size());
  for (std::size_t b = 0; b < found.fits.size(); ++b) {
    if (rests_on_motor_balance(found, b)) continue;
    const Eigen::MatrixXd& covariance = found.fits[b].covariance;
    for (Eigen::Index j = 0; j < covariance.rows(); ++j)
      if (std::isfinite(covariance(j, j))) parameters[b].push_back(j);
  }
  return parameters;
}

Linearised linearised(const RegressionProblem& data, const BalanceFit& fit, const Terms& terms,
                      const std::vector<Eigen::Index>& parameters) {
  return {data.slopes(terms, fit.on_balance, fit.linear, fit.nonlinear)(Eigen::all, parameters), data.residual(terms)};
}

std::vector<Linearised> linearised_with(const Identification& found,
                                        const std::vector<const data::Experiment*>& experiments,
                                        const Pipeline& pipeline,
                                        const std::vector<std::vector<Eigen::Index>>& parameters) {
  PreparedData prepared = prepare_as(found.prepared, pipeline, experiments, found.terms);
  for (std::size_t i = 0; i < prepared.records.size(); ++i)
    take_decisions(prepared.records[i], found.prepared.records[i]);
  std::vector<Linearised> result;
  for (std::size_t b = 0; b < found.data.size(); ++b) {
    const RegressionProblem data(prepared, found.data[b].balance());
    result.push_back(linearised(data, found.fits[b], found.terms, parameters[b]));
  }
  return result;
}

}  // namespace flexspline::estimation
