#include "host/engine/selection/modelled_torque.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include "host/common/algebra/decompositions.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

using estimation::PreparedData;
using estimation::Record;

std::size_t take_noise_off_torque(PreparedData& prepared) {
  constexpr Eigen::Index kRowsPerColumn = 20;
  std::size_t replaced = 0;
  for (Record& r : prepared.records) {
    if (r.torque.empty() || r.inputs.torque.empty()) continue;
    const auto n = static_cast<Eigen::Index>(r.inputs.size());
    std::vector<effects::Inputs<catalogue::Real>> in(r.inputs.size());
    r.inputs.copy(0, in);
    Eigen::MatrixXd X(n, 10);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto& x = in[static_cast<std::size_t>(k)];
      X.row(k) << 1.0, x.output_acceleration, x.output_velocity, x.output_direction, std::sin(x.output_angle),
          std::cos(x.output_angle), x.torsion, x.torsion * x.torsion * x.torsion, x.torsion_direction,
          r.load_torque.empty() ? 0.0 : r.load_torque[static_cast<std::size_t>(k)];
    }
    if (n < kRowsPerColumn * X.cols()) continue;
    const Eigen::VectorXd size = X.colwise().norm().transpose().array().max(1e-300);
    X *= size.cwiseInverse().asDiagonal();
    const Eigen::Map<const Eigen::VectorXd> measured(r.torque.data(), n);
    const Eigen::VectorXd fitted = X * algebra::PivotedQr(X, 1e-7).solve(measured);
    const Eigen::VectorXd rest = measured - fitted;
    double steps = 0.0;
    for (Eigen::Index k = 1; k < n; ++k) steps += 0.5 * (rest[k] - rest[k - 1]) * (rest[k] - rest[k - 1]);
    if (!(steps > kPolicy.torque_noise_share * rest.squaredNorm())) continue;
    r.inputs.torque.assign(fitted.data(), fitted.data() + n);
    ++replaced;
  }
  return replaced;
}

}  // namespace flexspline::selection
