// One experiment from the rows of a table: selection, conversion, time base, checks.
#pragma once

#include <optional>

#include "host/input/data/columns.hpp"
#include "host/input/data/dataset.hpp"
#include "host/input/data/findings.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {

// Fewer samples than this identify nothing; shorter segments are masked.
inline constexpr std::size_t kMinimumSamples = 32;
inline constexpr std::size_t kMinimumSegment = 8;

// from_s <= time < to_s, in the file's time.
struct TimeBounds {
  std::optional<double> from_s;
  std::optional<double> to_s;
};

// Fills `experiment`, whose keys are set already. False if it cannot be used; the findings say why.
bool read_experiment(const Table& table, const ColumnPlan& plan, const TimeBounds& bounds, Axis axis,
                     Experiment& experiment, Findings& findings);

}  // namespace flexspline::data
