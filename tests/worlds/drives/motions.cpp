#include "tests/worlds/drives/motions.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace flexspline::worlds::drives {
namespace {

using Positions = std::vector<double>;

std::size_t samples_of(const MotionRequest& request) {
  return static_cast<std::size_t>(std::lround(request.duration_s / request.period_s));
}

Positions of_time(const MotionRequest& request, const std::function<double(double)>& position) {
  Positions out(samples_of(request));
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = position(static_cast<double>(k) * request.period_s);
  return out;
}

/// Velocities (in any unit of size) that change no faster than `acceleration` a second, summed to positions.
Positions summed(const MotionRequest& request, const std::function<double(std::size_t)>& wanted, double acceleration) {
  Positions out(samples_of(request));
  double position = 0.0;
  double velocity = 0.0;
  for (std::size_t k = 0; k < out.size(); ++k) {
    const double most = acceleration * request.period_s;
    velocity += std::clamp(wanted(k) - velocity, -most, most);
    position += velocity * request.period_s;
    out[k] = position;
  }
  return out;
}

/// Trapezoids of velocity between random targets, with a stop at each; rounded by a moving average (S-curve).
Positions point_to_point(const MotionRequest& request, Random& random) {
  const MotionLimits& limits = request.limits;
  const double dwell_s = random.uniform(0.05, 0.4);
  const double speed_share = random.uniform(0.5, 1.0);
  Positions out;
  double at = 0.0;
  while (out.size() < samples_of(request)) {
    const double target = limits.range_rad * random.uniform(-0.5, 0.5);
    const double way = std::abs(target - at);
    if (way < 0.15 * limits.range_rad) continue;
    const double acceleration = limits.acceleration_rad_s2 * random.uniform(0.6, 1.0);
    const double speed =
        std::min(limits.velocity_rad_s * speed_share * random.uniform(0.3, 1.0), std::sqrt(way * acceleration));
    const double ramp_s = speed / acceleration;
    const double total_s = way / speed + ramp_s;
    const double direction = target > at ? 1.0 : -1.0;
    for (double t = 0.0; t < total_s + dwell_s; t += request.period_s) {
      double done = way;
      if (t < ramp_s) {
        done = 0.5 * acceleration * t * t;
      } else if (t < total_s - ramp_s) {
        done = speed * (t - 0.5 * ramp_s);
      } else if (t < total_s) {
        done = way - 0.5 * acceleration * (total_s - t) * (total_s - t);
      }
      out.push_back(at + direction * done);
    }
    at = target;
  }
  out.resize(samples_of(request));
  return out;
}

/// Strokes between random targets with the least jerk (Flash and Hogan, J. Neuroscience 5, 1985).
Positions minimum_jerk(const MotionRequest& request, Random& random) {
  Positions out;
  double at = 0.0;
  while (out.size() < samples_of(request)) {
    const double target = random.uniform(-0.5, 0.5);
    const double stroke_s = random.log_uniform(0.5 / request.high_hz, 0.5 / request.low_hz);
    for (double t = 0.0; t < stroke_s; t += request.period_s) {
      const double x = t / stroke_s;
      out.push_back(at + (target - at) * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x));
    }
    const auto pause = static_cast<std::size_t>(random.uniform(0.0, 0.2) / request.period_s);
    out.insert(out.end(), pause, target);
    at = target;
  }
  out.resize(samples_of(request));
  return out;
}

struct Wave {
  double hz, amplitude, phase;
};

Positions waves(const MotionRequest& request, const std::vector<Wave>& all) {
  return of_time(request, [&](double t) {
    double sum = 0.0;
    for (const Wave& wave : all) sum += wave.amplitude * std::sin(kTurn * wave.hz * t + wave.phase);
    return sum;
  });
}

Positions sine(const MotionRequest& request, Random& random) {
  return waves(request, {{random.log_uniform(request.low_hz, request.high_hz), 1.0, 0.0}});
}

/// Lines of one fundamental with random phases, weaker towards high frequencies (Pintelon and Schoukens, System
/// Identification, ch. 5).
Positions multisine(const MotionRequest& request, Random& random) {
  const double fundamental = std::max(request.low_hz, 2.0 / request.duration_s);
  const int lines = std::clamp(static_cast<int>(request.high_hz / fundamental), 3, 12);
  std::vector<Wave> all;
  for (int k = 1; k <= lines; ++k) all.push_back({k * fundamental, 1.0 / std::pow(k, 1.3), random.uniform(0.0, kTurn)});
  return waves(request, all);
}

/// Hip or knee over the stride: two harmonics and a third, near those of walking (Winter, Biomechanics and Motor
/// Control, ch. 5).
Positions walking(const MotionRequest& request, Random& random) {
  const double stride_hz = random.log_uniform(request.low_hz, request.high_hz);
  const bool is_knee = random.chance(0.5);
  return waves(request,
               {{stride_hz, 1.0, random.uniform(0.0, kTurn)},
                {2.0 * stride_hz, (is_knee ? 0.55 : 0.2) * random.uniform(0.8, 1.2), random.uniform(0.0, kTurn)},
                {3.0 * stride_hz, (is_knee ? 0.12 : 0.05) * random.uniform(0.5, 1.5), random.uniform(0.0, kTurn)}});
}

Positions chirp(const MotionRequest& request, Random&) {
  const double growth = std::log(request.high_hz / request.low_hz) / request.duration_s;
  return of_time(request, [&](double t) {
    const double hz = request.low_hz * std::exp(growth * t);
    // The amplitude falls so that the acceleration rises only by the root of the frequency.
    return std::pow(request.low_hz / hz, 1.5) *
           std::sin(kTurn * request.low_hz * (std::exp(growth * t) - 1.0) / growth);
  });
}

/// Slow constant speeds in both directions, as a telescope follows stars.
Positions tracking(const MotionRequest& request, Random& random) {
  const int legs = random.integer(3, 6);
  std::vector<double> speeds;
  double direction = random.sign();
  for (int leg = 0; leg < legs; ++leg, direction = -direction)
    speeds.push_back(direction * random.log_uniform(0.06, 1.0));
  return summed(
      request,
      [&](std::size_t k) { return speeds[std::min(speeds.size() - 1, k * speeds.size() / samples_of(request))]; },
      random.uniform(1.0, 4.0));
}

/// Lines of a scan, to and fro, at one speed, with turns of constant acceleration.
Positions raster(const MotionRequest& request, Random& random) {
  const double line_s = 0.5 / random.log_uniform(request.low_hz, request.high_hz);
  return summed(
      request,
      [&](std::size_t k) {
        return static_cast<long>(static_cast<double>(k) * request.period_s / line_s) % 2 == 0 ? 1.0 : -1.0;
      },
      2.0 / (line_s * random.uniform(0.15, 0.4)));
}

/// Stairs of constant speeds through both directions, as on a bench.
Positions speed_steps(const MotionRequest& request, Random& random) {
  const int steps = random.integer(5, 10);
  std::vector<double> speeds;
  for (int k = 0; k < steps; ++k) speeds.push_back((k % 2 == 0 ? 1.0 : -1.0) * random.uniform(0.08, 1.0));
  const double step_s = request.duration_s / steps;
  return summed(
      request,
      [&](std::size_t k) {
        return speeds[std::min(speeds.size() - 1,
                               static_cast<std::size_t>(static_cast<double>(k) * request.period_s / step_s))];
      },
      random.uniform(5.0, 15.0) / step_s);
}

/// A vehicle's speeds: stop and go, mostly forward, some backward.
Positions drive_cycle(const MotionRequest& request, Random& random) {
  std::vector<double> wanted(samples_of(request));
  for (std::size_t k = 0; k < wanted.size();) {
    const double speed = random.chance(0.15) ? 0.0 : (random.chance(0.35) ? -0.6 : 1.0) * random.uniform(0.15, 1.0);
    const auto until =
        std::min(wanted.size(), k + static_cast<std::size_t>(random.uniform(0.6, 2.0) / request.period_s));
    for (; k < until; ++k) wanted[k] = speed;
  }
  return summed(
      request, [&](std::size_t k) { return wanted[k]; }, random.uniform(1.5, 5.0));
}

/// What a gimbal does under a hand or a ship: many waves of a band that are no multiples of each other.
Positions wander(const MotionRequest& request, Random& random) {
  std::vector<Wave> all;
  for (int k = 0; k < 16; ++k) {
    const double hz = random.log_uniform(request.low_hz, request.high_hz);
    all.push_back({hz, random.uniform(0.5, 1.5) * std::pow(hz / request.low_hz, -1.2), random.uniform(0.0, kTurn)});
  }
  return waves(request, all);
}

/// Begins at rest at angle 0 and keeps the limits.
void fit_into(const MotionRequest& request, Positions& positions) {
  const double fade_s = std::min(0.5, 0.1 * request.duration_s);
  const double start = positions.front();
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const double x = std::min(1.0, static_cast<double>(k) * request.period_s / fade_s);
    positions[k] = (positions[k] - start) * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
  }
  double most_velocity = 1e-12;
  double most_acceleration = 1e-12;
  const double period = request.period_s;
  for (std::size_t k = 2; k < positions.size(); ++k) {
    const double velocity = (positions[k] - positions[k - 1]) / period;
    most_velocity = std::max(most_velocity, std::abs(velocity));
    most_acceleration =
        std::max(most_acceleration, std::abs(velocity - (positions[k - 1] - positions[k - 2]) / period) / period);
  }
  const auto [low, high] = std::minmax_element(positions.begin(), positions.end());
  const double scale =
      std::min({request.limits.velocity_rad_s / most_velocity, request.limits.acceleration_rad_s2 / most_acceleration,
                request.limits.range_rad / std::max(*high - *low, 1e-12)});
  for (double& position : positions) position *= scale;
}

/// Moving average over `width_s`, twice: bounds the jerk.
void round_off(Positions& positions, double width_s, double period_s) {
  const auto width = static_cast<std::size_t>(std::max(1.0, width_s / period_s));
  for (int pass = 0; pass < 2; ++pass) {
    Positions averaged(positions.size());
    double sum = static_cast<double>(width) * positions.front();
    for (std::size_t k = 0; k < positions.size(); ++k) {
      sum += positions[k] - (k >= width ? positions[k - width] : positions.front());
      averaged[k] = sum / static_cast<double>(width);
    }
    positions = averaged;
  }
}

}  // namespace

Motion make_motion(const MotionRequest& request, Random& random) {
  struct Named {
    const char* name;
    Positions (*make)(const MotionRequest&, Random&);
    bool has_corners;
  };
  static constexpr Named kMotions[] = {{"point_to_point", point_to_point, true},
                                       {"minimum_jerk", minimum_jerk, false},
                                       {"sine", sine, false},
                                       {"chirp", chirp, false},
                                       {"multisine", multisine, false},
                                       {"walking", walking, false},
                                       {"tracking", tracking, true},
                                       {"raster", raster, true},
                                       {"speed_steps", speed_steps, true},
                                       {"drive_cycle", drive_cycle, true},
                                       {"wander", wander, false}};
  for (const Named& named : kMotions) {
    if (request.name != named.name) continue;
    Positions positions = named.make(request, random);
    if (named.has_corners) round_off(positions, random.uniform(0.01, 0.05), request.period_s);
    fit_into(request, positions);
    return {request.name, request.period_s, std::move(positions)};
  }
  throw std::invalid_argument("motion '" + request.name + "' is not known");
}

}  // namespace flexspline::worlds::drives
