// Signals over time, thinned for a page.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::report {

// Which samples of a record are drawn. Where there are more than wanted, each bucket of neighbours gives two: its first
// and last instant, at which a signal shows its least and its largest value in the order in which they came. So nothing
// that stands out is lost, and a signal that only rises keeps its slope.
class Thinning {
 public:
  Thinning(const std::vector<data::Segment>& segments, std::size_t wanted);

  // Time of each point; a gap in time is one point without a number.
  std::vector<double> times(std::span<const double> time_s) const;
  // Values of one signal at these points; NaN where `valid` (may be empty) marks that there is none.
  std::vector<double> values(std::span<const double> signal, std::span<const std::uint8_t> valid = {}) const;

 private:
  struct Bucket {
    std::size_t first = 0, last = 0;  // samples; equal for a gap
  };
  std::vector<Bucket> buckets_;
};

// {"offset", "scale", "count", "codes"}: values as 16-bit numbers, little-endian in base 64; a value is
// offset + scale * code, and 65535 is no number.
nlohmann::json packed(std::span<const double> values);

}  // namespace flexspline::report
