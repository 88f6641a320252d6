// The uniform time base of an experiment: its sample time, gaps, and resampling where the logger jittered.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::data {

// Steps within this share of a sample are rounding of the time stamps.
inline constexpr double kUniformShare = 0.02;
// Above this share (of the 99th percentile) a filter cannot treat the samples as uniform.
inline constexpr double kJitterShare = 0.20;
// A step of more samples than this is a gap; shorter ones are samples lost, which interpolation bridges.
inline constexpr double kGapSamples = 3.5;

struct TimeBase {
  // Median step, refined to the mean of the steps without gaps, lost samples counted: the median of rounded time
  // stamps is off by the rounding, which a long record adds up.
  double sample_s = 0.0;
  std::vector<Segment> segments;  // of the samples as they are in the file
  double jitter = 0.0;            // 99th percentile of a step's deviation from whole samples, in samples
  double jitter_max = 0.0;        // the largest one
  std::size_t lost_samples = 0;   // within segments
  double longest_gap_s = 0.0;
  double longest_gap_at_s = 0.0;

  bool uniform() const { return jitter_max < kUniformShare && lost_samples == 0; }
};

// `time_s` strictly increasing, at least two samples.
TimeBase time_base(std::span<const double> time_s);

// Puts all columns on the grid of `base`, each segment from its own first sample: positions and velocities by
// monotone cubics, a held command by its last value, the rest linearly. A sample is masked where a neighbour was.
void resample(Experiment& experiment, const TimeBase& base);

}  // namespace flexspline::data
