#pragma once

#include <complex>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace flexspline::signals {

/// Smallest size >= at_least (and >= 4) that is a multiple of four without a prime factor above five.
std::size_t fast_fft_size(std::size_t at_least);

/// Fourier transform of real signals of one size, with its tables. Not for use by two threads at once.
class RealFft {
 public:
  /// Any even size >= 2 (fast_fft_size gives quick ones); throws std::invalid_argument otherwise.
  explicit RealFft(std::size_t size);
  ~RealFft();

  /// sum_n x[n] exp(-2 pi j k n / size) for k = 0 .. size/2, of the signal with zeros appended up to the size. Throws
  /// std::invalid_argument if the signal is longer than that.
  std::vector<std::complex<double>> forward(std::span<const double> signal);
  /// The real signal of `size` samples with this half spectrum; inverse of `forward`.
  std::vector<double> inverse(const std::vector<std::complex<double>>& half_spectrum);

 private:
  struct Plan;
  std::size_t size_;
  std::unique_ptr<Plan> plan_;
};

/// sum_i x[i] x[i + lag] for lag = 0 .. max_lag, zero where the lag exceeds the signal. The mean is not removed.
std::vector<double> lagged_products(std::span<const double> signal, std::size_t max_lag);

}  // namespace flexspline::signals
