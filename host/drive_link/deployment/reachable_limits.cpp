#include "host/drive_link/deployment/reachable_limits.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/drive_link/deployment/pack.hpp"
#include "shared/control/reachable.hpp"

namespace flexspline::deployment {

using effects::DriveConstants;

void require_reachable(const control::DriveSettings<fixed::Fixed>& s, const DriveConstants<double>& d,
                       const std::string& origin) {
  using control::Limit;
  const control::Limited limited = control::Limited::of(s);
  const Limit limit = control::unreachable(limited);
  if (limit == Limit::none) return;
  const auto tell = [&](const char* key, control::Shown is, double base, const char* unit, const char* remedy) {
    const double factor = std::ldexp(base, -fixed::kValueBits);
    throw PackError(
        fmt::format("{}: [faults] {} is {:.4g} {}, but no more than {:.4g} {} can be distinguished from the drive's "
                    "signals, so it would never act; {}",
                    origin, key, is.raw * factor, unit, largest(limit, limited).raw * factor, unit, remedy));
  };
  const auto& f = s.safety;
  if (limit == Limit::overspeed)
    tell("overspeed_rad_s", f.overspeed, d.velocity_base, "rad/s",
         "lower it or [limits] velocity_rad_s, or raise rated_velocity_rad_s in the model");
  if (limit == Limit::overcurrent)
    tell("overcurrent_a", f.overcurrent, d.current_base, "A", "lower it, or correct [current_sensor] full_scale_a");
  if (limit == Limit::overtemperature)
    tell("overtemperature_c", f.overtemperature, d.temperature_base, "degC",
         "lower it, or correct [temperature_sensor] full_scale_c");
  if (limit == Limit::acceleration)
    tell("acceleration_rad_s2", f.acceleration, d.acceleration_base, "rad/s^2",
         "lower it or raise [motor_encoder] corner_hz");
  if (limit == Limit::stuck_torque)
    tell("stuck_torque_nm", f.stuck_torque, d.torque_base, "N m",
         "lower it; where the model's friction asks for it, the drive is too weak for its friction");
  if (limit == Limit::current_mismatch) tell("current_mismatch_a", f.current_mismatch, d.current_base, "A", "lower it");
  if (limit == Limit::standstill) tell("standstill_rad_s", f.standstill, d.velocity_base, "rad/s", "lower it");
  const auto tell_time = [&](const char* key, std::uint32_t ticks, std::uint32_t longest) {
    throw PackError(fmt::format("{}: [faults] {} is {:.4g} s, but a drive takes at most {} s; lower it", origin, key,
                                ticks * d.time_base, longest));
  };
  if (limit == Limit::host_time) tell_time("host_s", f.host_ticks, control::kLongestHostSeconds);
  if (limit == Limit::stop_time) tell_time("stop_s", f.stop_ticks, control::kLongestStopSeconds);
  tell("following_velocity_rad_s", s.following.velocity, d.velocity_base, "rad/s", "lower it");
}

}  // namespace flexspline::deployment
