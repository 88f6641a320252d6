// C in all but the file's name: no classes, no templates, nothing called through a pointer, nothing allocated.
//
// Scheme, step, event location and tolerances are those of host/physics/simulation/dynamics.cpp; only what a fixed
// model allows is different: with straight friction on either shaft a velocity follows from the torque by one division.
#include "tests/bench/plain_c_loop.hpp"

#include <math.h>

static const double kGamma = 0.29289321881345247560;  // 1 - 1/sqrt(2)
static const double kVelocityTolerance = 1e-10;
static const double kUsualStage = 2e-5;

struct Stage {
  double theta;
  PlainState base;
  double effort;
  int held_motor;
  int held_output;
};

struct Solution {
  PlainState state;
  double motor_acceleration;
  double output_acceleration;
  double torque;
  int motor_direction;
  int output_direction;
};

struct Run {
  const PlainDrive* drive;
  double power;
  PlainState state;
  double torque;
  Solution last;
  double rate_root;
  double rate_slope;
};

static int sign_of(double x) {
  return x > 0.0 ? 1 : x < 0.0 ? -1 : 0;
}

static double tolerance_of(double theta) {
  double scale = theta / kUsualStage;
  if (scale > 1.0) scale = 1.0;
  if (scale < 1e-5) scale = 1e-5;
  return kVelocityTolerance * scale;
}

static double signed_power(double x, double power) {
  if (power <= 1.0) return x;
  if (power == 2.0) return x * fabs(x);
  return copysign(pow(fabs(x), power), x);
}

static double spring_and_damping(const PlainDrive* d, double torsion, double rate) {
  return d->stiffness * torsion + d->damping * pow(fabs(rate), d->exponent) * sign_of(rate);
}

// Velocity and direction of a shaft of which `slope` v + coulomb s(v) = driving, driving including the momentum.
static double shaft_velocity(double slope, double coulomb, double driving, double limit, double guess, int held,
                             int last, int* direction) {
  if (held != 0) {
    *direction = held;
    return (driving - coulomb * held) / slope;
  }
  const int expected = sign_of(guess);
  if (expected != 0) {
    const double velocity = (driving - coulomb * expected) / slope;
    if (sign_of(velocity) == expected) {
      *direction = expected;
      return velocity;
    }
  }
  const int starts_forward = coulomb - driving < -limit;
  const int starts_backward = -coulomb - driving > limit;
  *direction = starts_forward && !(starts_backward && last < 0) ? 1 : starts_backward ? -1 : 0;
  return *direction == 0 ? 0.0 : (driving - coulomb * *direction) / slope;
}

static Solution solve(Run* run, const Stage* stage) {
  const PlainDrive* d = run->drive;
  const double theta = stage->theta;
  const double tolerance = tolerance_of(theta);
  const double motor_mass = d->inertia / theta;
  const double output_mass = d->output_inertia / theta;
  const double base = stage->base.motor_position / d->gear_ratio - stage->base.output_position;
  const double motor_guess = stage->base.motor_velocity + theta * run->last.motor_acceleration;
  const double output_guess = stage->base.output_velocity + theta * run->last.output_acceleration;
  Solution s = {};
  s.motor_direction = run->last.motor_direction;
  s.output_direction = run->last.output_direction;

  // Root of an increasing function: secant steps, bisection where they leave the bracket or shrink it slowly.
  double x = run->rate_root;
  double slope = run->rate_slope;
  double low = -INFINITY, high = INFINITY, width = INFINITY;
  double x_before = 0.0, y_before = 0.0;
  int slow = 0;
  double motor_near = motor_guess;
  double output_near = output_guess;
  double torque_near = run->last.torque;
  for (int n = 0; n < 120; ++n) {
    const double rate = signed_power(x, run->power);
    s.torque = spring_and_damping(d, base + theta * rate, rate);
    const double shift = s.torque - torque_near;
    s.state.motor_velocity =
        shaft_velocity(motor_mass + d->viscous, d->coulomb,
                       stage->effort - s.torque / d->gear_ratio + motor_mass * stage->base.motor_velocity,
                       0.1 * d->gear_ratio * tolerance * motor_mass, motor_near - shift / (d->gear_ratio * motor_mass),
                       stage->held_motor, run->last.motor_direction, &s.motor_direction);
    if (!d->locked)
      s.state.output_velocity = shaft_velocity(output_mass + d->output_viscous, d->output_coulomb,
                                               s.torque + output_mass * stage->base.output_velocity,
                                               0.1 * tolerance * output_mass, output_near + shift / output_mass,
                                               stage->held_output, run->last.output_direction, &s.output_direction);
    torque_near = s.torque;
    motor_near = s.state.motor_velocity;
    output_near = s.state.output_velocity;
    const double y = rate - s.state.motor_velocity / d->gear_ratio + s.state.output_velocity;
    if (fabs(y) <= tolerance) {
      x -= y / slope;
      break;
    }
    if (y < 0.0)
      low = x;
    else
      high = x;
    if (n > 0) {
      const double secant = (y - y_before) / (x - x_before);
      if (secant > 0.0 && isfinite(secant)) slope = secant;
    }
    x_before = x;
    y_before = y;
    double step = -y / slope;
    if (isfinite(low) && isfinite(high)) {
      slow = high - low > 0.5 * width ? slow + 1 : 0;
      width = high - low;
      if (width <= 1e-15 * fmax(fabs(low), fabs(high))) break;
      double next = x + step;
      if (slow >= 3 || !(next > low && next < high)) {
        next = 0.5 * (low + high);
        slow = 0;
      }
      x = next;
    } else {
      if (n >= 6) step *= ldexp(1.0, 2 * (n - 5));
      x += step;
    }
  }
  run->rate_root = x;
  run->rate_slope = slope;

  s.state.motor_position = stage->base.motor_position + theta * s.state.motor_velocity;
  s.state.output_position = stage->base.output_position + theta * s.state.output_velocity;
  s.motor_acceleration = (s.state.motor_velocity - stage->base.motor_velocity) / theta;
  s.output_acceleration = (s.state.output_velocity - stage->base.output_velocity) / theta;
  run->last = s;
  return s;
}

// Both stages; `middle` is the first of them. Returns the second, which is the end of the step.
static Solution attempt(Run* run, double from, double to, double duration, int held_motor, int held_output,
                        Solution* middle) {
  const double theta = kGamma * duration;
  const double rest = duration - theta;
  Stage stage = {theta, run->state, from + (to - from) * kGamma, held_motor, held_output};
  *middle = solve(run, &stage);
  stage.base.motor_position += rest * middle->state.motor_velocity;
  stage.base.motor_velocity += rest * middle->motor_acceleration;
  stage.base.output_position += rest * middle->state.output_velocity;
  stage.base.output_velocity += rest * middle->output_acceleration;
  stage.effort = to;
  return solve(run, &stage);
}

static double share_to_standstill(int direction, double from, double to, double share) {
  if (direction == 0 || to * direction >= 0.0) return share;
  const double at = from / (from - to);
  return at < share ? at : share;
}

static void stop(int direction, double started, double* velocity) {
  if (direction != 0 && *velocity * direction < 1e-3 * fabs(started)) *velocity = 0.0;
}

static void accept(Run* run, const Solution* end) {
  run->state = end->state;
  run->torque = end->torque;
}

// Moves on to the first standstill of a held shaft. Returns the time that took.
static double advance_to_standstill(Run* run, double from, double to, double duration, int held_motor, int held_output,
                                    Solution end) {
  double time = duration;
  for (int refinement = 0; refinement < 4; ++refinement) {
    double share = 1.0;
    share = share_to_standstill(held_motor, run->state.motor_velocity, end.state.motor_velocity, share);
    share = share_to_standstill(held_output, run->state.output_velocity, end.state.output_velocity, share);
    if (share > 1.0 - 1e-4) break;
    time *= share;
    if (time < 1e-6 * duration) break;
    Solution middle;
    end = attempt(run, from, from + (to - from) * (time / duration), time, held_motor, held_output, &middle);
  }
  const PlainState begin = run->state;
  if (time >= 1e-6 * duration) {
    accept(run, &end);
    stop(held_motor, begin.motor_velocity, &run->state.motor_velocity);
    stop(held_output, begin.output_velocity, &run->state.output_velocity);
    return time;
  }
  if (held_motor != 0 && (held_output == 0 ||
                          fabs(run->state.motor_velocity) <= run->drive->gear_ratio * fabs(run->state.output_velocity)))
    run->state.motor_velocity = 0.0;
  else
    run->state.output_velocity = 0.0;
  return 0.0;
}

static int turned(double velocity, int middle, int last) {
  const int direction = sign_of(velocity);
  return middle == direction && last == direction ? 0 : direction;
}

static void step(Run* run, double from, double to, double duration) {
  double left = duration;
  for (int piece = 0;; ++piece) {
    Solution middle;
    Solution end = attempt(run, from, to, left, 0, 0, &middle);
    const int held_motor = turned(run->state.motor_velocity, middle.motor_direction, end.motor_direction);
    int held_output = 0;
    if (!run->drive->locked)
      held_output = turned(run->state.output_velocity, middle.output_direction, end.output_direction);
    if (piece == 4 || (held_motor == 0 && held_output == 0)) {
      accept(run, &end);
      return;
    }
    end = attempt(run, from, to, left, held_motor, held_output, &middle);
    const double time = advance_to_standstill(run, from, to, left, held_motor, held_output, end);
    if (time > left * (1.0 - 1e-6)) return;
    from += (to - from) * (time / left);
    left -= time;
  }
}

void plain_c_loop(const PlainDrive* drive, PlainState start, const double* current, long count, double sample_s,
                  int steps, PlainTrace trace) {
  Run run = {};
  run.drive = drive;
  run.power = 1.0 / drive->exponent;
  run.state = start;
  const double rate = start.motor_velocity / drive->gear_ratio - start.output_velocity;
  run.torque = spring_and_damping(drive, start.motor_position / drive->gear_ratio - start.output_position, rate);
  run.last.state = start;
  run.last.torque = run.torque;
  run.last.motor_direction = sign_of(start.motor_velocity);
  run.last.output_direction = sign_of(start.output_velocity);
  run.rate_root = copysign(pow(fabs(rate), drive->exponent), rate);
  run.rate_slope = 1.0;
  const double duration = sample_s / steps;
  for (long k = 0; k < count; ++k) {
    trace.motor_position[k] = run.state.motor_position;
    trace.motor_velocity[k] = run.state.motor_velocity;
    trace.output_position[k] = run.state.output_position;
    trace.output_velocity[k] = run.state.output_velocity;
    trace.torque[k] = run.torque;
    if (k + 1 == count) return;
    const double now = drive->torque_constant * current[k];
    const double change = drive->torque_constant * (current[k + 1] - current[k]);
    for (int n = 0; n < steps; ++n) step(&run, now + change * n / steps, now + change * (n + 1) / steps, duration);
  }
}
