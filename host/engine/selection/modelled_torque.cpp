#include "host/engine/selection/modelled_torque.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::selection {

using effects::Phase;
using estimation::Balance;
using estimation::PreparedData;
using estimation::Record;
using estimation::Terms;

std::size_t take_noise_off_torque(PreparedData& prepared) {
  constexpr double kWhite =
      0.5;  // semivariance of neighbours over the variance: 1 for white noise, 0 for a slow signal
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
    if (!(steps > kWhite * rest.squaredNorm())) continue;
    r.inputs.torque.assign(fitted.data(), fitted.data() + n);
    ++replaced;
  }
  return replaced;
}

void take_torque_from_load(PreparedData& prepared, const Terms& terms) {
  // Weight on the output and inertia: most of both is behind the gear.
  const auto torque_of = [&](const estimation::Term& t, const std::vector<double>& values, double acceleration) {
    effects::Inputs<catalogue::Real> in;
    in.acceleration = acceleration;
    double torque = 0.0;
    t.entry->real.torque(values.data(), prepared.constants, Balance::motor, std::span(&in, 1), &torque);
    return torque;
  };
  const auto has_weight = [](const estimation::Term& t) {
    return t.entry->info->balance == Balance::load && (t.entry->info->reads & effects::kOutputAngle) != 0;
  };
  if (std::none_of(terms.begin(), terms.end(), has_weight)) return;
  for (const estimation::Term& t : terms) {
    if (t.entry->has_state || t.entry->info->phase != Phase::source || !t.entry->adds_torque()) continue;
    const std::vector<double> values = catalogue::natural(*t.entry, t.values);
    const bool inertia = t.entry->info->balance == Balance::motor && torque_of(t, values, 1.0) != 0.0;
    if (!has_weight(t) && !inertia) continue;
    const double ratio = inertia ? prepared.constants.gear_ratio : 1.0;
    for (Record& r : prepared.records) {
      if (r.locked || r.inputs.size() == 0) continue;
      std::vector<double> torque(r.inputs.size(), 0.0);
      t.entry->real.torque_of_plain(values.data(), prepared.constants, inertia ? Balance::motor : Balance::load,
                                    r.inputs.all(), torque.data());
      r.inputs.torque.resize(r.inputs.size(), 0.0);
      for (std::size_t k = 0; k < torque.size(); ++k) r.inputs.torque[k] += ratio * torque[k];
    }
  }
}

}  // namespace flexspline::selection
