#include "hil/motor/shunts.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::motor {

// A signed converter of `bits`: its step is 2^(16 - bits).
std::int32_t Shunts::share(double x, std::int32_t least) const {
  const double step = std::ldexp(1.0, 16 - p_.bits);
  const double rounded = std::round(x * 32768.0 / step) * step;
  return static_cast<std::int32_t>(std::clamp(rounded, static_cast<double>(least), 32768.0 - step));
}
Readings Shunts::read(const Sample& sample) {
  Readings r;
  for (std::size_t x = 0; x < 3; ++x) {
    const double noise = p_.noise_a > 0.0 ? p_.noise_a * normal_() : 0.0;
    r.current[x] = share((sample.seen_a[p_.order[x]] * p_.gain[x] + p_.offset_a[x] + noise) / p_.full_scale_a, -32768);
  }
  r.bus = share(sample.bus_v / p_.bus_full_scale_v, 0);
  return r;
}

}  // namespace flexspline::motor
