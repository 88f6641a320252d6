// Disturbances that a diagnosis left out, as a table for a terminal.
#pragma once

#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/output/answers/console.hpp"

namespace flexspline::output {

// The largest by their peaks, in the order of time, and how many more there are. `dataset`, where it is known: times of
// a record whose column does not start near zero are those after its first sample.
void print_disturbances(Console& console, const std::vector<selection::Disturbance>& all, const data::Dataset* dataset);

}  // namespace flexspline::output
