#include "host/drive_link/deployment/samples.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::deployment {
namespace {

using fixed::Fixed;
constexpr std::int32_t kOne = std::int32_t{1} << fixed::kValueBits;
constexpr std::int32_t kFarthest = 2 * kOne;

Fixed::Value raw(std::int64_t x) {
  return {{static_cast<std::int32_t>(std::clamp<std::int64_t>(x, -kFarthest, kFarthest))}};
}
Fixed::Value direction(Fixed::Value x) {
  return {{x.raw > 0 ? kOne : x.raw < 0 ? -kOne : 0}};
}
double real(Fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}

}  // namespace

Samples::Samples(const effects::DriveConstants<double>& drive, std::uint64_t seed) : drive_(drive), random_(seed) {
  angle_turns_ = between(-500.0, 500.0);
}

double Samples::between(double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random_);
}

void Samples::start() {
  constexpr std::array<std::int32_t, 9> kCorners = {-kFarthest, -kOne, -1, 0, 0, 0, 1, kOne, kFarthest};
  left_ = static_cast<int>(random_() % 200) + 20;
  for (Swing& s : swings_) {
    s.rate = std::exp(between(std::log(1e-7), std::log(0.02)));
    s.at_corner = random_() % 5 == 0;
    s.corner = kCorners[random_() % kCorners.size()];
  }
}

std::int32_t Samples::step(int channel) {
  Swing& s = swings_[static_cast<std::size_t>(channel)];
  // A torsion does not jump: laws with memory take the way that it went.
  if (s.at_corner && channel == torsion) return torsion_;
  if (s.at_corner) return s.corner;
  s.phase += s.rate;
  return static_cast<std::int32_t>(std::lround(kFarthest * std::sin(s.phase)));
}

effects::Inputs<Fixed> Samples::next() {
  if (left_-- == 0) start();
  effects::Inputs<Fixed> in;
  in.velocity = raw(step(velocity));
  in.direction = direction(in.velocity);
  angle_turns_ += real(in.velocity) * drive_.velocity_base * drive_.time_base / drive_.angle_base;
  in.angle.raw = std::llround(std::ldexp(angle_turns_, fixed::kAngleBits));
  in.output_angle.raw = std::llround(std::ldexp(angle_turns_ / drive_.gear_ratio, fixed::kAngleBits));
  in.acceleration = raw(step(acceleration));
  in.output_velocity = raw(step(output_velocity));
  in.output_direction = direction(in.output_velocity);
  in.output_acceleration = raw(step(output_acceleration));
  const std::int32_t before = torsion_;
  torsion_ = step(torsion);
  in.torsion = raw(torsion_);
  const double rate =
      (static_cast<double>(torsion_) - before) * drive_.torsion_base / (drive_.time_base * drive_.torsion_rate_base);
  in.torsion_rate = raw(std::llround(std::clamp(rate, -2.0 * kFarthest, 2.0 * kFarthest)));
  in.torsion_direction = direction(in.torsion_rate);
  in.torque = raw(step(torque));
  in.current = raw(step(current));
  in.temperature = raw(step(temperature));
  return in;
}

effects::Inputs<numbers::Real> in_double(const effects::Inputs<Fixed>& in,
                                         const effects::DriveConstants<double>& drive) {
  effects::Inputs<numbers::Real> out{};
  out.angle = std::ldexp(static_cast<double>(in.angle.raw), -fixed::kAngleBits) * drive.angle_base;
  out.output_angle = std::ldexp(static_cast<double>(in.output_angle.raw), -fixed::kAngleBits) * 2.0 * std::numbers::pi;
  out.velocity = real(in.velocity);
  out.direction = real(in.direction);
  out.acceleration = real(in.acceleration);
  out.output_velocity = real(in.output_velocity);
  out.output_direction = real(in.output_direction);
  out.output_acceleration = real(in.output_acceleration);
  out.torsion = real(in.torsion);
  out.torsion_rate = real(in.torsion_rate);
  out.torsion_direction = real(in.torsion_direction);
  out.torque = real(in.torque);
  out.current = real(in.current);
  out.temperature = real(in.temperature);
  return out;
}

}  // namespace flexspline::deployment
