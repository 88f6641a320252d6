#include "host/app/workbench/window.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/output/report/trace.hpp"

namespace flexspline::workbench {

std::vector<data::Segment> clipped(const std::vector<data::Segment>& segments, std::span<const double> time_s,
                                   double from_s, double to_s) {
  std::vector<data::Segment> parts;
  for (const data::Segment& s : segments) {
    const auto begin = time_s.begin() + static_cast<std::ptrdiff_t>(s.first);
    const auto end = time_s.begin() + static_cast<std::ptrdiff_t>(s.last);
    auto first = std::lower_bound(begin, end, from_s);
    auto last = std::upper_bound(begin, end, to_s);
    if (first != begin) --first;
    if (last != end) ++last;
    // A window outside of the segment finds one neighbour of it, which is outside.
    if (last - first < 2 && (first == end || *first < from_s || *first > to_s)) continue;
    parts.push_back(
        {static_cast<std::size_t>(first - time_s.begin()), static_cast<std::size_t>(last - time_s.begin())});
  }
  return parts;
}

nlohmann::json window(const std::vector<data::Segment>& segments, std::span<const double> time_s, double from_s,
                      double to_s, std::size_t points, const std::vector<Curve>& curves) {
  const std::vector<data::Segment> parts = clipped(segments, time_s, from_s, to_s);
  std::size_t samples = 0;
  for (const data::Segment& s : parts) samples += s.last - s.first;
  const report::Thinning thinning(parts, points);
  nlohmann::json answer{{"from_s", from_s},
                        {"to_s", to_s},
                        {"whole", samples <= points},
                        {"time", report::packed(thinning.times(time_s))}};
  for (const Curve& curve : curves) answer[curve.name] = report::packed(thinning.values(curve.values, curve.valid));
  return answer;
}

std::vector<std::pair<double, double>> intervals(std::span<const double> times, double join_s) {
  std::vector<std::pair<double, double>> list;
  for (const double t : times) {
    if (!list.empty() && t - list.back().second <= join_s)
      list.back().second = t;
    else
      list.emplace_back(t, t);
  }
  return list;
}

}  // namespace flexspline::workbench
