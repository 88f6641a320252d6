#include "host/engine/estimation/strokes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace flexspline::estimation {

std::vector<double> strokes(const Record& record) {
  constexpr double kSeen = 3.0;  // standard deviations of the velocity
  std::vector<double> all;
  if (record.at_rest || !record.has_motor_motion || record.inputs.size() == 0) return all;
  const double least = kSeen * record.velocity_noise[index(Balance::motor)];
  double start = record.inputs.angle_at(0), direction = 0.0;
  for (std::size_t k = 0; k < record.inputs.size(); ++k) {
    const double velocity = record.inputs.velocity_at(k);
    if (velocity == 0.0 || std::abs(velocity) < least) continue;
    const double now = velocity > 0.0 ? 1.0 : -1.0;
    if (now == -direction) {
      all.push_back(std::abs(record.inputs.angle_at(k) - start));
      start = record.inputs.angle_at(k);
    }
    direction = now;
  }
  if (direction != 0.0) all.push_back(std::abs(record.inputs.angle_at(record.inputs.size() - 1) - start));
  return all;
}

double stroke_quantile(std::vector<double> strokes, double share) {
  std::sort(strokes.begin(), strokes.end());
  const double travel = share * std::accumulate(strokes.begin(), strokes.end(), 0.0);
  double sum = 0.0;
  for (const double stroke : strokes)
    if ((sum += stroke) >= travel) return stroke;
  return 0.0;
}

}  // namespace flexspline::estimation
