// Filters, differences and least squares of these machines alone.
#pragma once

#include <cstddef>
#include <vector>

#include "tests/worlds/machines/random.hpp"

namespace flexspline::worlds::machines {

using Signal = std::vector<double>;

// Convolution with a Hann window of `width` samples and unit area; the ends hold.
Signal smoothed(const Signal& x, std::size_t width);
// Central differences, one-sided at the ends.
Signal derivative(const Signal& x, double rate_hz);
// Butterworth low-pass of second order, forward and backward.
class ZeroPhaseLowPass {
 public:
  ZeroPhaseLowPass(double cutoff_hz, double rate_hz);
  Signal operator()(const Signal& x) const;

 private:
  Signal once(const Signal& x) const;
  double b0_, b1_, b2_, a1_, a2_;
};
// First-order autoregressive noise of unit variance.
Signal coloured_noise(std::size_t size, double rate_hz, double corner_hz, Dice& dice);
Signal scaled(Signal x, double factor);
double rms(const Signal& x);
double standard_deviation(const Signal& x);
// RMS of what least squares on the columns leave of the target.
double rms_after_least_squares(std::vector<Signal> columns, Signal target);

}  // namespace flexspline::worlds::machines
