#include "host/common/signals/interpolate.hpp"

// Before pchip.hpp, which looks for isnan outside of std.
#include <math.h>

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/interpolators/pchip.hpp>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace flexspline::signals {

std::vector<double> fractional_delay(std::span<const double> signal, double delay_samples) {
  if (!std::isfinite(delay_samples))
    throw std::invalid_argument(fmt::format("delay: {} samples is not a finite number", delay_samples));
  const auto n = static_cast<std::ptrdiff_t>(signal.size());
  std::vector<double> delayed(signal.size());
  if (n == 0) return delayed;
  const double length = static_cast<double>(n);
  const double advance = std::clamp(-delay_samples, -length, length);
  const double whole = std::floor(advance);
  const auto shift = static_cast<std::ptrdiff_t>(whole);
  const double f = advance - whole;

  const auto lagrange = [&signal](std::ptrdiff_t first, double u) {  // samples first .. first+3, u from the second
    const double* x = signal.data() + first;
    return -u * (u - 1.0) * (u - 2.0) / 6.0 * x[0] + (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0 * x[1] -
           (u + 1.0) * u * (u - 2.0) / 2.0 * x[2] + (u + 1.0) * u * (u - 1.0) / 6.0 * x[3];
  };
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const std::ptrdiff_t at = i + shift;  // wanted: signal at at + f
    double& out = delayed[static_cast<std::size_t>(i)];
    if (at < 0) {
      out = signal.front();
    } else if (at >= n - 1) {
      out = signal.back();
    } else if (f == 0.0) {
      out = signal[static_cast<std::size_t>(at)];
    } else if (n < 4) {
      const double low = signal[static_cast<std::size_t>(at)], high = signal[static_cast<std::size_t>(at + 1)];
      out = low + f * (high - low);
    } else {
      // In the first and last interval the cubic through the nearest four samples serves.
      const std::ptrdiff_t first = std::clamp<std::ptrdiff_t>(at - 1, 0, n - 4);
      out = lagrange(first, static_cast<double>(at - first - 1) + f);
    }
  }
  return delayed;
}

std::vector<double> resample_uniform(std::span<const double> time_s, std::span<const double> values,
                                     std::span<const double> new_times_s, Interpolation interpolation) {
  if (time_s.empty() || time_s.size() != values.size())
    throw std::invalid_argument(
        fmt::format("resampling: {} times for {} values; each value needs its time", time_s.size(), values.size()));
  for (std::size_t i = 1; i < time_s.size(); ++i)
    if (!(time_s[i] > time_s[i - 1]))
      throw std::invalid_argument(
          fmt::format("resampling: time {} s after {} s (row {}); sort or cut the data", time_s[i], time_s[i - 1], i));

  std::vector<double> result(new_times_s.size());
  const auto fill = [&](auto&& inside) {
    for (std::size_t i = 0; i < result.size(); ++i) {
      const double t = new_times_s[i];
      if (t <= time_s.front())
        result[i] = values.front();
      else if (t >= time_s.back())
        result[i] = values.back();
      else
        result[i] = inside(t);
    }
  };
  if (interpolation == Interpolation::kMonotoneCubic && time_s.size() >= 4) {
    const boost::math::interpolators::pchip<std::vector<double>> curve({time_s.begin(), time_s.end()},
                                                                       {values.begin(), values.end()});
    fill([&curve](double t) { return curve(t); });
  } else {
    fill([&](double t) {
      const auto next = static_cast<std::size_t>(std::upper_bound(time_s.begin(), time_s.end(), t) - time_s.begin());
      const double share = (t - time_s[next - 1]) / (time_s[next] - time_s[next - 1]);
      return values[next - 1] + share * (values[next] - values[next - 1]);
    });
  }
  return result;
}

}  // namespace flexspline::signals
