// Signals of a record within a window of time, few enough points for a screen.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::workbench {

// A signal along the samples of a record. `valid` may be empty: then all are shown.
struct Curve {
  std::string name;
  std::span<const double> values;
  std::span<const std::uint8_t> valid{};
};

// The parts of `segments` within [from_s, to_s], with the sample before and behind, so that lines reach the edges.
std::vector<data::Segment> clipped(const std::vector<data::Segment>& segments, std::span<const double> time_s,
                                   double from_s, double to_s);

// {"from_s", "to_s", "whole": nothing was left out, "time": packed, CURVE: packed, ...}; at most about `points` points
// of each curve. Where samples are more, each bucket of neighbours shows its least and its largest value
// (report::Thinning), so that no peak is lost at any zoom.
nlohmann::json window(const std::vector<data::Segment>& segments, std::span<const double> time_s, double from_s,
                      double to_s, std::size_t points, const std::vector<Curve>& curves);

// Samples as intervals of time: neighbours at most `join_s` apart become one. [[from, to], ...].
// `times` rise.
std::vector<std::pair<double, double>> intervals(std::span<const double> times, double join_s);

}  // namespace flexspline::workbench
