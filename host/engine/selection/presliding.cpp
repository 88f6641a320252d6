#include "host/engine/selection/presliding.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/regression_problem.hpp"
#include "host/engine/estimation/strokes.hpp"
#include "host/engine/selection/bandwidth.hpp"

namespace flexspline::selection {

using estimation::Balance;
using estimation::PreparedData;
using estimation::Record;
using estimation::RegressionProblem;
using estimation::Terms;

std::vector<double> presliding_state(const Record& record, double travel) {
  const std::size_t n = record.inputs.size();
  std::vector<double> state(n, 0.0);
  for (const data::Segment& s : record.segments) {
    // The motion before the record is unknown: the state starts in the direction of the first motion.
    double z = 0.0;
    for (std::size_t k = s.first; k < s.last; ++k)
      if (std::abs(record.inputs.velocity_at(k)) > 3.0 * record.velocity_noise[0]) {
        z = record.inputs.velocity_at(k) > 0.0 ? 1.0 : -1.0;
        break;
      }
    state[s.first] = z;
    for (std::size_t k = s.first + 1; k < s.last; ++k) {
      const double step = record.inputs.angle_at(k) - record.inputs.angle_at(k - 1);
      const double end = step > 0.0 ? 1.0 : step < 0.0 ? -1.0 : z;
      z = end + (z - end) * std::exp(-std::abs(step) / travel);
      state[k] = z;
    }
  }
  return state;
}

std::vector<double> presliding_travels(const PreparedData& prepared, const SelectionPolicy& policy) {
  std::vector<double> strokes;
  double noise = 0.0, reversals = 0.0;
  for (const Record& r : prepared.records) {
    if (r.at_rest || !r.has_motor_motion || r.inputs.angle.empty()) continue;
    noise = std::max({noise, r.motor_quantum.value_or(0.0), noise_by_fourth_differences(r.inputs.angle, r.segments)});
  }
  for (const Record& r : prepared.records) {
    std::vector<double> own = estimation::strokes(r);
    std::erase_if(own, [&](double stroke) { return stroke < policy.least_travel_noise * noise; });
    reversals += std::max(0.0, static_cast<double>(own.size()) - 1.0);
    strokes.insert(strokes.end(), own.begin(), own.end());
  }
  if (reversals < policy.fewest_reversals) return {};
  const double high = std::min(policy.longest_presliding,
                               policy.presliding_of_stroke * estimation::stroke_quantile(std::move(strokes), 0.5));
  const double low = std::max(policy.least_travel_noise * noise, 1e-4 * high);
  std::vector<double> travels;
  constexpr int kTravels = 9;
  for (int i = 0; i < kTravels && high > low; ++i)
    travels.push_back(low * std::pow(high / low, static_cast<double>(i) / (kTravels - 1)));
  return travels;
}

std::vector<double> squares_by_travel(const PreparedData& original, const Terms& terms,
                                      const std::vector<double>& travels) {
  std::vector<double> squares(travels.size());
  estimation::in_parallel(travels.size(), [&](std::size_t i) {
    PreparedData prepared = original;
    for (Record& r : prepared.records) r.inputs.directions[0] = presliding_state(r, travels[i]);
    RegressionProblem data(prepared, Balance::motor);
    const auto on_balance = estimation::terms_on(terms, Balance::motor, prepared.output_signals);
    const Eigen::MatrixXd X = data.columns(terms, estimation::free_linear_parameters(terms, on_balance));
    const Eigen::VectorXd y = data.target() - data.known_torque(terms, on_balance);
    squares[i] = (y - X * algebra::PivotedQr(X).solve(y)).squaredNorm();
  });
  return squares;
}

}  // namespace flexspline::selection
