#include "host/drive_link/drive/position_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace flexspline::drive {
namespace {

constexpr double kStep_s = 1e-3;

}  // namespace

PositionMotion::PositionMotion(const planning::Run& run, const planning::Limits& limits, const Scales& scales)
    : scales_(scales), points_(planning::set_points(run, kStep_s)), velocity_limit_(limits.velocity_rad_s) {
  if (points_.empty()) points_.push_back(0.0);
  const auto [low, high] = std::minmax_element(points_.begin(), points_.end());
  const bool is_linear = scales.is_linear();
  const char* const unit = is_linear ? "m" : "rad";
  const char* const of_motor = is_linear ? "metres" : "radians of the motor";
  const double travel = (std::max(*high, 0.0) - std::min(*low, 0.0)) / scales.constants.gear_ratio;
  if (limits.travel_rad > 0.0 && travel > 1.001 * limits.travel_rad)
    throw planning::PlanError(
        fmt::format("run \"{}\": it {} the output by {:.4g} {}, beyond the plan's limit of {:g} {}; lower its "
                    "amplitude or offset ({})",
                    run.name, is_linear ? "moves" : "turns", travel, unit, limits.travel_rad, unit, of_motor));
  if (run.waveform == planning::Waveform::square || limits.velocity_rad_s <= 0.0) return;
  double fastest = 0.0;
  for (std::size_t i = 1; i < points_.size(); ++i)
    fastest = std::max(fastest, std::abs(points_[i] - points_[i - 1]) / kStep_s);
  if (fastest > 1.001 * limits.velocity_rad_s)
    throw planning::PlanError(
        fmt::format("run \"{}\": its set point moves at up to {:.4g} {}/s, beyond the plan's limit of {:g}; lower its "
                    "amplitude ({}) or frequency",
                    run.name, fastest, unit, limits.velocity_rad_s, of_motor));
}

protocol::Command PositionMotion::arm(bool compensate) const {
  protocol::Command c;
  c.kind = protocol::CommandKind::arm;
  c.mode = protocol::Mode::position;
  c.compensate = compensate;
  c.position = start_;
  return c;
}

protocol::Command PositionMotion::at(double time_s, double set_point_rad) const {
  constexpr double kHalf_s = 0.005;
  double velocity = (wanted_rad(time_s + kHalf_s) - wanted_rad(time_s - kHalf_s)) / (2.0 * kHalf_s) +
                    (wanted_rad(time_s) - set_point_rad) / kCatchUp_s;
  if (velocity_limit_ > 0.0) velocity = std::clamp(velocity, -velocity_limit_, velocity_limit_);
  const double target = set_point_rad + kAhead_s * velocity;
  protocol::Command c;
  c.kind = protocol::CommandKind::set;
  c.mode = protocol::Mode::position;
  c.position = start_ + static_cast<std::int64_t>(std::llround(target / scales_.turn() * 0x1p32));
  // Zero would mean as fast as the drive may.
  c.velocity = std::max(scales_.per_unit(std::abs(velocity), scales_.constants.velocity_base), 1);
  return c;
}

double PositionMotion::wanted_rad(double time_s) const {
  const double place = std::clamp(time_s / kStep_s, 0.0, static_cast<double>(points_.size() - 1));
  const auto i = static_cast<std::size_t>(place);
  if (i + 1 >= points_.size()) return points_.back();
  const double part = place - static_cast<double>(i);
  return (1.0 - part) * points_[i] + part * points_[i + 1];
}

}  // namespace flexspline::drive
