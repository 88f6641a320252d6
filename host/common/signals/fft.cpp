#include "host/common/signals/fft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <unsupported/Eigen/FFT>

namespace flexspline::signals {

std::size_t fast_fft_size(std::size_t at_least) {
  for (std::size_t size = std::max<std::size_t>(4, (at_least + 3) / 4 * 4);; size += 4) {
    std::size_t rest = size;
    for (const std::size_t factor : {2u, 3u, 5u})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return size;
  }
}

struct RealFft::Plan {
  Eigen::FFT<double> fft;
  std::vector<double> padded;
};

RealFft::RealFft(std::size_t size) : size_(size), plan_(std::make_unique<Plan>()) {
  if (size < 2 || size % 2 != 0)
    throw std::invalid_argument(fmt::format("FFT: size {} is not even and positive; round it up", size));
  plan_->fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
}

RealFft::~RealFft() = default;

std::vector<std::complex<double>> RealFft::forward(std::span<const double> signal) {
  if (signal.size() > size_)
    throw std::invalid_argument(
        fmt::format("FFT: a signal of {} samples does not fit the size {}", signal.size(), size_));
  plan_->padded.assign(size_, 0.0);
  std::copy(signal.begin(), signal.end(), plan_->padded.begin());
  std::vector<std::complex<double>> spectrum(size_ / 2 + 1);
  plan_->fft.fwd(spectrum.data(), plan_->padded.data(), static_cast<Eigen::Index>(size_));
  return spectrum;
}

std::vector<double> RealFft::inverse(const std::vector<std::complex<double>>& half_spectrum) {
  if (half_spectrum.size() != size_ / 2 + 1)
    throw std::invalid_argument(
        fmt::format("FFT: a half spectrum of {} lines does not belong to the size {}", half_spectrum.size(), size_));
  std::vector<double> signal(size_);
  plan_->fft.inv(signal.data(), half_spectrum.data(), static_cast<Eigen::Index>(size_));
  return signal;
}

std::vector<double> lagged_products(std::span<const double> signal, std::size_t max_lag) {
  std::vector<double> products(max_lag + 1, 0.0);
  if (signal.empty()) return products;
  const std::size_t lags = std::min(max_lag, signal.size() - 1);
  RealFft fft(fast_fft_size(signal.size() + lags));
  auto spectrum = fft.forward(signal);
  for (auto& line : spectrum) line = std::norm(line);
  const std::vector<double> circular = fft.inverse(spectrum);
  std::copy_n(circular.begin(), lags + 1, products.begin());
  return products;
}

}  // namespace flexspline::signals
