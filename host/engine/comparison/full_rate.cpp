#include "host/engine/comparison/full_rate.hpp"

#include <algorithm>

#include "host/engine/estimation/balance_fit.hpp"

namespace flexspline::comparison {

std::optional<FullRate> full_rate(const estimation::PreparedData& prepared, const estimation::Record& record,
                                  estimation::Balance balance, const estimation::Terms& terms) {
  estimation::PreparedData all;
  all.pipeline = prepared.pipeline;
  all.records = {record};
  all.constants = prepared.constants;
  all.output_signals = prepared.output_signals;
  all.effort_is_current = prepared.effort_is_current;
  all.rotary = prepared.rotary;
  const std::vector<std::size_t>& rows = record.rows[estimation::index(balance)].samples;
  std::vector<std::size_t>& samples = all.records[0].rows[estimation::index(balance)].samples;
  samples.clear();
  for (const data::Segment& s : record.segments)
    for (std::size_t k = s.first; k < s.last; ++k) samples.push_back(k);
  estimation::RegressionProblem data(all, balance);
  if (data.empty()) return std::nullopt;
  const Eigen::VectorXd residual = data.residual(terms);
  const std::size_t n = record.inputs.size();
  FullRate result{std::vector<double>(n, 0.0), std::vector<double>(n, 0.0), std::vector<std::uint8_t>(n, 0)};
  for (std::size_t k = 0; k < samples.size(); ++k) {
    result.target[samples[k]] = data.target()[static_cast<Eigen::Index>(k)];
    result.residual[samples[k]] = residual[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t k = 0; k + 1 < rows.size(); ++k)
    if (rows[k + 1] - rows[k] <= record.decimation)
      std::fill(result.valid.begin() + static_cast<std::ptrdiff_t>(rows[k]),
                result.valid.begin() + static_cast<std::ptrdiff_t>(rows[k + 1]) + 1, std::uint8_t{1});
  return result;
}

}  // namespace flexspline::comparison
