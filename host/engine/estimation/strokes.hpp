// Strokes of the motor: travels in one direction.
#pragma once

#include <vector>

#include "host/engine/estimation/record.hpp"

namespace flexspline::estimation {

// Travels of a record, rad of the motor (m on a linear axis), in their order: from the first sample or a reversal to
// the next reversal or the last sample. A velocity below three times its noise has no direction.
std::vector<double> strokes(const Record& record);

// The quantile of strokes by the travel that they make, not by their number: dither, and noise near standstill, make
// many strokes and little travel. `share` from 0 to 1; zero where there are no strokes.
double stroke_quantile(std::vector<double> strokes, double share);

}  // namespace flexspline::estimation
