#include "host/input/data/period.hpp"

#include <algorithm>
#include <span>

#include "host/common/signals/spectrum.hpp"

namespace flexspline::data {

std::optional<double> period_samples(const Experiment& e, double mismatch_limit) {
  const auto longest = std::max_element(e.segments.begin(), e.segments.end(), [](const auto& a, const auto& b) {
    return a.last - a.first < b.last - b.first;
  });
  if (longest == e.segments.end()) return std::nullopt;
  const std::size_t n = longest->last - longest->first;
  for (const Column column : {Column::position_command, Column::motor_position, Column::velocity_command,
                              Column::output_position, Column::motor_velocity}) {
    if (!e.has(column)) continue;
    for (const std::size_t skip : {std::size_t{0}, n / 10, n / 4}) {
      const std::span<const double> part(e[column].data() + longest->first + skip, n - skip);
      if (const auto repetition = signals::find_repetition(part, mismatch_limit)) return repetition->exact_samples;
    }
  }
  return std::nullopt;
}

}  // namespace flexspline::data
