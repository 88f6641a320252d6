#include "host/engine/selection/balance_errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/comparison/residual_map.hpp"

namespace flexspline::selection {
namespace {

// Error and noise of the records whose noise is known, where that of all is not.
std::optional<NoiseOfSome> noise_of_some(const SearchedBalance& balance) {
  if (balance.floor.rmse) return std::nullopt;
  const RegressionProblem& data = *balance.search.data;
  const Eigen::VectorXd residual = balance.search.base.residual_fixed_effects();
  NoiseOfSome some;
  std::vector<comparison::NoiseFloor> known;
  std::vector<estimation::RowRange> rows;
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < balance.floors.size(); ++i) {
    const estimation::RowRange& range = data.records()[i];
    const estimation::Record& record = data.prepared().records[range.record];
    if (!balance.floors[i].rmse || record.at_rest) continue;
    some.records.push_back(record.name);
    known.push_back(balance.floors[i]);
    rows.push_back(range);
    squares += residual.segment(range.first, range.size()).squaredNorm();
    count += static_cast<double>(range.size());
  }
  if (known.empty()) return std::nullopt;
  const comparison::NoiseFloor pooled = comparison::pooled(known, rows);
  some.rmse = std::sqrt(squares / count);
  some.noise = *pooled.rmse;
  some.from = pooled.from;
  return some;
}

}  // namespace

std::vector<LocalisedResidual> shares(const RegressionProblem& data, const CrossValidatedFit& fit,
                                      const Eigen::VectorXd& residual, double least) {
  std::vector<LocalisedResidual> list;
  const data::Axis axis = data.prepared().rotary ? data::Axis::rotary : data::Axis::linear;
  for (const auto& share : comparison::localise(data, residual, fit.autocorrelation_time, axis))
    if (share.share_percent >= least) list.push_back({share.variable, share.share_percent});
  return list;
}

void describe_base(const SearchedBalance& chosen, Diagnosis& result) {
  const RegressionProblem& data = *chosen.search.data;
  const CrossValidatedFit& fit = chosen.search.base;
  result.balance = data.balance();
  result.base_rmse = fit.rmse_fixed_effects();
  result.base_rmse_cv = fit.rmse_cv_fixed_effects();
  result.base_rmse_own_friction = fit.rmse();
  result.target_rms = rmse_of(data.target(), fit.root_weights);
  result.noise_floor = chosen.floor.rmse;
  result.noise_floor_from = chosen.floor.from;
  result.noise_of_some = noise_of_some(chosen);
  const std::vector<estimation::Record>& records = data.prepared().records;
  result.reversals_left_out = std::any_of(records.begin(), records.end(), [&](const estimation::Record& r) {
    return r.rows[estimation::index(data.balance())].masked > 0;
  });
}

void describe_motor_instead(const SearchedBalance& chosen, const SearchedBalance& motor, Diagnosis& result) {
  if (result.noise_floor)
    result.warnings.push_back(fmt::format(
        "the {} balance has an error of {:.3g} times its noise, which no effect of the catalogue explains; flexspline "
        "compare shows where",
        catalogue::balance_name(chosen.search.data->balance()), result.base_rmse / *result.noise_floor));
  describe_base(motor, result);
  const CrossValidatedFit& fit = motor.search.base;
  result.localised = shares(*motor.search.data, fit, fit.residual_fixed_effects());
  result.remaining_structure = shares(*motor.search.data, fit, fit.residual);
  result.unknown.reset();
}

}  // namespace flexspline::selection
