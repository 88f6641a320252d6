#include "tests/worlds/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace flexspline::worlds {
namespace {

constexpr double kRange = 1.6;  // rad to each side

Reference moved(const Reference& start, double time_s) {
  return {start.position + time_s * (start.velocity + 0.5 * time_s * start.acceleration),
          start.velocity + time_s * start.acceleration, start.acceleration};
}

}  // namespace

std::string_view name_of(MotionKind kind) {
  switch (kind) {
    case MotionKind::multisine:
      return "multisine";
    case MotionKind::trapezoids:
      return "trapezoids";
    case MotionKind::slow_sweep:
      return "slow_sweep";
    case MotionKind::one_direction:
      break;
  }
  return "one_direction";
}

void Trajectory::begin(double position) {
  stretches_ = {{0.0, {position, 0.0, 0.0}}};
  end_s_ = 0.0;
}

void Trajectory::accelerate(double acceleration, double duration_s) {
  Reference now = moved(stretches_.back().start, end_s_ - stretches_.back().from_s);
  now.acceleration = acceleration;
  stretches_.push_back({end_s_, now});
  end_s_ += duration_s;
}

void Trajectory::go_to(double velocity, double acceleration) {
  const Reference now = moved(stretches_.back().start, end_s_ - stretches_.back().from_s);
  const double change = velocity - now.velocity;
  if (change != 0.0) accelerate(std::copysign(acceleration, change), std::abs(change) / acceleration);
}

void Trajectory::move(double distance, double velocity, double acceleration) {
  const double way = std::abs(distance);
  const double peak = std::min(velocity, std::sqrt(acceleration * way));
  go_to(std::copysign(peak, distance), acceleration);
  accelerate(0.0, std::max(0.0, (way - peak * peak / acceleration) / peak));
  go_to(0.0, acceleration);
}

Trajectory Trajectory::draw(MotionKind kind, double duration_s, double peak_velocity, double direction,
                            Random& random) {
  Trajectory t;
  t.duration_s_ = duration_s;
  if (kind == MotionKind::multisine) {
    // Whole periods in the record, as excitations are designed.
    const double base = random.integer(1, 2) / duration_s * (duration_s > 8.0 ? 2.0 : 1.0);
    double velocity = 0.0, position = 0.0;
    for (const int harmonic : {1, 2, 3, 4, 6}) {
      const Sine s{random.uniform(0.3, 1.0) / (harmonic * base), harmonic * base, random.uniform(0.0, kTurn)};
      velocity += 0.7 * s.amplitude * kTurn * s.frequency;
      position += 0.7 * s.amplitude;
      t.sines_.push_back(s);
    }
    const double scale = std::min(peak_velocity / velocity, kRange / position);
    for (Sine& s : t.sines_) s.amplitude *= scale;
    return t;
  }
  const double acceleration = peak_velocity * random.uniform(2.0, 8.0);
  if (kind == MotionKind::one_direction) {
    // Up through some speeds, all the way without a turn.
    const int steps = random.integer(1, 4);
    t.begin(-direction * kRange);
    t.accelerate(0.0, 0.2);
    for (int k = 1; k <= steps; ++k) {
      const double speed = peak_velocity * k / steps;
      t.go_to(direction * speed, acceleration);
      t.accelerate(0.0, (duration_s - 0.6) / steps - speed / (k * acceleration));
    }
    t.go_to(0.0, acceleration);
    return t;
  }
  t.begin(random.uniform(-0.3, 0.3));
  double position = t.stretches_.front().start.position;
  while (t.end_s_ < duration_s) {
    if (kind == MotionKind::trapezoids) {
      const double target = random.uniform(-kRange, kRange);
      if (std::abs(target - position) < 0.1) continue;
      t.accelerate(0.0, random.chance(0.5) ? random.uniform(0.1, 0.8) : 0.0);
      t.move(target - position, peak_velocity * random.uniform(0.3, 1.0), acceleration);
      position = target;
    } else {
      // There and back at a constant speed, each pair at its own.
      const double speed = peak_velocity * random.uniform(0.1, 1.0);
      const double distance = std::min(kRange, speed * random.uniform(2.0, 6.0)) * (position > 0.0 ? -1.0 : 1.0);
      t.move(distance, speed, acceleration);
      t.move(-distance, speed, acceleration);
    }
  }
  return t;
}

Reference Trajectory::at(double time_s) const {
  if (!sines_.empty()) {
    Reference r;
    for (const Sine& s : sines_) {
      const double rate = kTurn * s.frequency;
      r.position += s.amplitude * std::sin(rate * time_s + s.phase);
      r.velocity += s.amplitude * rate * std::cos(rate * time_s + s.phase);
      r.acceleration -= s.amplitude * rate * rate * std::sin(rate * time_s + s.phase);
    }
    return r;
  }
  const double within = std::clamp(time_s, 0.0, end_s_);
  const auto after = std::upper_bound(stretches_.begin(), stretches_.end(), within,
                                      [](double time, const Stretch& s) { return time < s.from_s; });
  const Stretch& s = *std::prev(after);
  Reference r = moved(s.start, within - s.from_s);
  if (within < time_s || time_s < 0.0) r.velocity = r.acceleration = 0.0;
  return r;
}

}  // namespace flexspline::worlds
