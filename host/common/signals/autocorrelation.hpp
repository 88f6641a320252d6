#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace flexspline::signals {

/// rho[k] for k = 0 .. max_lag, the mean removed, each sum divided by the number of samples (the biased estimate, whose
/// 99 % band for white noise is 2.58 / sqrt(n)). Zero beyond the signal; a constant signal gives rho[0] = 1 alone.
std::vector<double> autocorrelation(std::span<const double> signal, std::size_t max_lag);

/// How many samples count as one independent one: tau = 1 + 2 sum_k rho[k], summed up to the smallest lag M >= 5 tau(M)
/// (A. D. Sokal's automatic window), or max_lag if there is none. At least 1. Divide the number of samples by it.
double integrated_autocorrelation_time(std::span<const double> residual, std::size_t max_lag);

/// The same of several segments that follow one law: common mean, products within segments only, each lag divided by
/// the number of its pairs. Offsets between the segments therefore count as correlation.
double integrated_autocorrelation_time(const std::vector<std::span<const double>>& segments, std::size_t max_lag);

}  // namespace flexspline::signals
