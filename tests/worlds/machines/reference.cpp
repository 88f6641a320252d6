#include "tests/worlds/machines/reference.hpp"

#include <algorithm>
#include <cmath>

#include "tests/worlds/machines/plant.hpp"

namespace flexspline::worlds::machines {
namespace {

double largest(const Signal& x) {
  double out = 0.0;
  for (const double v : x) out = std::max(out, std::abs(v));
  return out;
}

// The frequency rises exponentially; the amplitude is the largest that the limits leave.
Signal sweep(std::size_t size, double duration_s, const MotionLimits& m, Dice& dice) {
  const double first = m.velocity_rad_s / (kTurn_rad * m.range_rad) * dice.between(0.5, 1.0);
  const double fastest = m.acceleration_rad_s2 / m.velocity_rad_s / kTurn_rad;
  const double last = std::max(1.5 * first, std::min(fastest, 20.0 * first) * dice.between(0.6, 1.0));
  Signal angle(size);
  double phase = 0.0;
  for (std::size_t k = 0; k < size; ++k) {
    const double rate =
        kTurn_rad * first * std::pow(last / first, static_cast<double>(k) / kControlRate_hz / duration_s);
    phase += rate / kControlRate_hz;
    const double amplitude = std::min({m.range_rad, m.velocity_rad_s / rate, m.acceleration_rad_s2 / (rate * rate)});
    angle[k] = amplitude * std::sin(phase);
  }
  return angle;
}

Signal fourier(std::size_t size, double duration_s, const MotionLimits& m, Dice& dice) {
  double first = std::max(1.0 / duration_s, m.velocity_rad_s / (kTurn_rad * m.range_rad) / 3.0);
  // Whole periods, where there is more than one.
  first = first * duration_s > 1.0 ? std::round(first * duration_s) / duration_s : 1.0 / duration_s;
  Signal angle(size, 0.0);
  for (int h = 1; h < 6; ++h) {
    const double sine = dice.normal() / h, cosine = dice.normal() / h;
    for (std::size_t k = 0; k < size; ++k) {
      const double phase = kTurn_rad * first * h * static_cast<double>(k) / kControlRate_hz;
      angle[k] += sine * std::sin(phase) + cosine * (std::cos(phase) - 1.0);
    }
  }
  const Signal velocity = derivative(angle, kControlRate_hz), acceleration = derivative(velocity, kControlRate_hz);
  const double excess = std::max({largest(velocity) / m.velocity_rad_s, largest(acceleration) / m.acceleration_rad_s2,
                                  largest(angle) / m.range_rad});
  for (double& v : angle) v /= excess;
  return angle;
}

// One stroke from rest to rest.
struct Stroke {
  double distance_rad, velocity_rad_s, acceleration_rad_s2, dwell_s;
};

// Writes it from tick `at` on; the ticks that it takes, or 0 where it does not fit.
std::size_t put_stroke(Stroke s, std::size_t at, Signal& velocity, double& position) {
  const double distance = std::abs(s.distance_rad);
  double ramp_s = s.velocity_rad_s / s.acceleration_rad_s2;
  if (distance < s.velocity_rad_s * ramp_s) {
    s.velocity_rad_s = std::sqrt(distance * s.acceleration_rad_s2);
    ramp_s = s.velocity_rad_s / s.acceleration_rad_s2;
  }
  const double total_s = distance / std::max(s.velocity_rad_s, 1e-9) + ramp_s;
  const auto ticks = static_cast<std::size_t>(total_s * kControlRate_hz);
  if (ticks < 4) return 4;
  if (at + ticks + static_cast<std::size_t>(0.2 * kControlRate_hz) >= velocity.size()) return 0;
  for (std::size_t k = 0; k < ticks; ++k) {
    const double t = static_cast<double>(k) / kControlRate_hz;
    const double part = std::min({t / ramp_s, 1.0, std::max((total_s - t) / ramp_s, 0.0)});
    velocity[at + k] = std::copysign(part * s.velocity_rad_s, s.distance_rad);
    position += velocity[at + k] / kControlRate_hz;
  }
  return ticks + static_cast<std::size_t>(s.dwell_s * kControlRate_hz);
}

// Strokes between two ends, at six speeds in turn; or to drawn points.
Signal strokes(std::size_t size, double duration_s, const MotionLimits& m, bool between_ends, Dice& dice) {
  const double end = m.range_rad * dice.between(0.5, 0.95), slowest = dice.between(0.04, 0.15);
  std::vector<double> speeds;
  for (int j = 0; j < 6; ++j) speeds.push_back(m.velocity_rad_s * std::pow(slowest, 1.0 - j / 5.0));
  dice.shuffle(speeds);
  Signal velocity(size, 0.0);
  double position = 0.0, side = 1.0;
  auto at = static_cast<std::size_t>(0.3 * kControlRate_hz);
  for (std::size_t k = 0; at + static_cast<std::size_t>(0.5 * kControlRate_hz) < size; ++k) {
    Stroke s{};
    if (between_ends) {
      s = {side * end - position, speeds[(k / 2) % 6], 0.8 * m.acceleration_rad_s2, dice.between(0.05, 0.4)};
      side = -side;
    } else {
      s.distance_rad = dice.between(-m.range_rad, m.range_rad) - position;
      s.velocity_rad_s = m.velocity_rad_s * dice.scale_between(0.1, 1.0);
      s.acceleration_rad_s2 = m.acceleration_rad_s2 * dice.between(0.3, 0.9);
      s.dwell_s = dice.between(0.0, 0.5);
    }
    // Slow strokes are shortened, so that a record has several.
    const double longest = s.velocity_rad_s * duration_s * (between_ends ? 0.12 : 0.2);
    if (std::abs(s.distance_rad) > longest) s.distance_rad = std::copysign(longest, s.distance_rad);
    const std::size_t ticks = put_stroke(s, at, velocity, position);
    if (ticks == 0) break;
    at += ticks;
  }
  return smoothed(velocity, static_cast<std::size_t>(0.4 * kControlRate_hz * m.velocity_rad_s / m.acceleration_rad_s2));
}

}  // namespace

std::string_view name_of(Motion motion) {
  switch (motion) {
    case Motion::sweep:
      return "sweep";
    case Motion::trapezoids:
      return "trapezoids";
    case Motion::point_to_point:
      return "point_to_point";
    case Motion::fourier:
      break;
  }
  return "fourier";
}

Reference draw_reference(Motion motion, double duration_s, const MotionLimits& limits, Dice& dice) {
  const auto size = static_cast<std::size_t>(duration_s * kControlRate_hz);
  Reference r;
  if (motion == Motion::sweep || motion == Motion::fourier) {
    r.angle_rad =
        motion == Motion::sweep ? sweep(size, duration_s, limits, dice) : fourier(size, duration_s, limits, dice);
    for (std::size_t k = 0; k < size; ++k) {
      const double t = std::min(1.0, static_cast<double>(k) / kControlRate_hz / (0.04 * duration_s));
      r.angle_rad[k] *= 0.5 - 0.5 * std::cos(0.5 * kTurn_rad * t);
    }
  } else {
    const Signal velocity = strokes(size, duration_s, limits, motion == Motion::trapezoids, dice);
    double angle = 0.0;
    for (const double w : velocity) r.angle_rad.push_back(angle += w / kControlRate_hz);
  }
  r.velocity_rad_s = derivative(r.angle_rad, kControlRate_hz);
  r.acceleration_rad_s2 = smoothed(derivative(r.velocity_rad_s, kControlRate_hz), 8);
  return r;
}

}  // namespace flexspline::worlds::machines
