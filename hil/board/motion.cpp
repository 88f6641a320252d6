#include "hil/board/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "shared/fixed/turn.hpp"

namespace flexspline::board {
namespace {

Reference sine(double amplitude, double frequency_hz, double time_s) {
  const double w = kTurn * frequency_hz;
  return {amplitude * std::sin(w * time_s), amplitude * w * std::cos(w * time_s),
          -amplitude * w * w * std::sin(w * time_s)};
}
Reference faded_in(const Reference& r, double time_s) {
  if (time_s >= 1.0) return r;
  const double x = time_s, f = x * x * (3.0 - 2.0 * x), df = 6.0 * x * (1.0 - x), ddf = 6.0 - 12.0 * x;
  return {f * r.position, f * r.velocity + df * r.position,
          f * r.acceleration + 2.0 * df * r.velocity + ddf * r.position};
}
Reference sum_of(const std::vector<Motion::Sine>& sines, double time_s) {
  Reference sum;
  for (const Motion::Sine& s : sines) {
    const Reference r = sine(s.amplitude_rad, s.frequency_hz, time_s + s.ahead_s);
    sum.position += r.position;
    sum.velocity += r.velocity;
    sum.acceleration += r.acceleration;
  }
  return faded_in(sum, time_s);
}

Reference constant(double speed, double time_s) {
  constexpr double kRampS = 0.5;
  if (time_s >= kRampS) return {speed * (time_s - kRampS / 2.0), speed, 0.0};
  return {speed * time_s * time_s / (2.0 * kRampS), speed * time_s / kRampS, speed / kRampS};
}

Reference trapezoid(double acceleration, double period_s, double time_s) {
  constexpr std::array<std::pair<double, double>, 6> kParts{
      {{0.125, 1.0}, {0.25, 0.0}, {0.125, -1.0}, {0.125, -1.0}, {0.25, 0.0}, {0.125, 1.0}}};
  double left = std::fmod(time_s, period_s);
  Reference r;
  for (const auto& [share, sign] : kParts) {
    const double t = std::min(left, share * period_s);
    r.acceleration = sign * acceleration;
    r.position += r.velocity * t + r.acceleration * t * t / 2.0;
    r.velocity += r.acceleration * t;
    left -= t;
    if (left <= 0.0) break;
  }
  return r;
}

Reference through(const std::vector<Motion::Waypoint>& points, double time_s) {
  Motion::Waypoint from;
  for (const Motion::Waypoint& to : points) {
    if (time_s < to.time_s) {
      const double duration = to.time_s - from.time_s, way = to.position_rad - from.position_rad;
      const double x = (time_s - from.time_s) / duration;
      return {from.position_rad + way * x * x * x * (10.0 + x * (6.0 * x - 15.0)),
              way / duration * 30.0 * x * x * (1.0 - x) * (1.0 - x),
              way / (duration * duration) * 60.0 * x * (1.0 + x * (2.0 * x - 3.0))};
    }
    from = to;
  }
  return {from.position_rad, 0.0, 0.0};
}

}  // namespace

Reference Motion::at(double time_s) const {
  switch (kind) {
    case Kind::sines:
      return sum_of(sines, time_s);
    case Kind::constant:
      return constant(velocity_rad_s, time_s);
    case Kind::trapezoid:
      return trapezoid(acceleration_rad_s2, period_s, time_s);
    case Kind::waypoints:
      break;
  }
  return through(waypoints, time_s);
}

}  // namespace flexspline::board
