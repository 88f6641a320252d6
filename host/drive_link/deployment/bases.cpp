#include "host/drive_link/deployment/bases.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/deployment/statics.hpp"
#include "shared/fixed/coefficients.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::deployment {
namespace {

using effects::DriveConstants;

constexpr double kFullSpeedAfterS = 0.05;
constexpr double kTemperatureBase = 50.0;

double needed(const model::Quantity& q, const char* key) {
  if (!q.value) throw PackError(fmt::format("the model does not state {}; add it to [drive] of the model file", key));
  if (!(*q.value > 0.0)) throw PackError(fmt::format("{} of the model is {:g}; it has to be positive", key, *q.value));
  return *q.value;
}

// The torsion at which the transmission carries rated torque: how far effects without memory have to be twisted.
double rated_torsion(const catalogue::ResolvedModel& model, double rated_torque) {
  const Springs springs(model);
  const auto torque_at = [&](double torsion) { return std::abs(springs.torque_at(torsion)); };
  constexpr double kLeast = 1e-7, kMost = 1.0;
  double high = kLeast;
  while (high < kMost && torque_at(high) < rated_torque) high *= 2.0;
  if (high >= kMost) return 0.01;
  double low = high / 2.0;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (torque_at(middle) < rated_torque ? low : high) = middle;
  }
  return high;
}

template <class Visit>
void for_each_pair(model::Bases& b, DriveConstants<double>& d, Visit&& visit) {
  visit(b.gear_ratio, d.gear_ratio);
  visit(b.torque_constant, d.torque_constant);
  visit(b.rated_velocity, d.rated_velocity);
  visit(b.reference_temperature, d.reference_temperature);
  visit(b.turn_angle_scale, d.turn_angle_scale);
  visit(b.torque, d.torque_base);
  visit(b.output_torque, d.output_torque_base);
  visit(b.velocity, d.velocity_base);
  visit(b.output_velocity, d.output_velocity_base);
  visit(b.acceleration, d.acceleration_base);
  visit(b.output_acceleration, d.output_acceleration_base);
  visit(b.angle, d.angle_base);
  visit(b.torsion, d.torsion_base);
  visit(b.torsion_rate, d.torsion_rate_base);
  visit(b.others[0], d.temperature_base);
  visit(b.others[1], d.current_base);
  visit(b.others[2], d.time_base);
}

}  // namespace

double rated_output_torque(const model::Drive& drive) {
  if (drive.rated_torque_nm.value) return needed(drive.rated_torque_nm, "rated_torque_nm");
  return needed(drive.rated_current_a, "rated_torque_nm or rated_current_a") *
         drive.torque_constant_nm_a.value.value_or(1.0) * needed(drive.gear_ratio, "gear_ratio");
}

DriveConstants<double> bases_of(const catalogue::ResolvedModel& model, double tick_s) {
  const model::Drive& drive = model.model->drive;
  DriveConstants<double> d = model.constants;
  needed(drive.gear_ratio, "gear_ratio");
  d.velocity_base = needed(drive.rated_velocity_rad_s, "rated_velocity_rad_s");
  const double rated = rated_output_torque(drive);
  d.output_torque_base = rated;
  const double of_current = drive.rated_current_a.value.value_or(0.0) * d.torque_constant;
  d.torque_base = std::max(rated / d.gear_ratio, of_current);
  d.output_velocity_base = d.velocity_base / d.gear_ratio;
  d.acceleration_base = d.velocity_base / kFullSpeedAfterS;
  d.output_acceleration_base = d.acceleration_base / d.gear_ratio;
  d.angle_base = kTurn / d.turn_angle_scale;
  d.torsion_base = rated_torsion(model, rated);
  d.torsion_rate_base = d.output_velocity_base;
  d.temperature_base = std::max(kTemperatureBase, std::abs(d.reference_temperature));
  d.current_base = drive.rated_current_a.value.value_or(rated / d.gear_ratio / d.torque_constant);
  d.time_base = tick_s;
  return from_block(in_block(d));
}

DriveConstants<double> widened(DriveConstants<double> bases, double torque_scale) {
  bases.torque_base *= torque_scale;
  bases.output_torque_base *= torque_scale;
  return from_block(in_block(bases));
}

model::Number number_of(double x) {
  model::Number n;
  if (x == 0.0) return n;
  n.mantissa = static_cast<std::int32_t>(std::lround(std::ldexp(std::frexp(x, &n.exponent), fixed::kMantissaBits)));
  return n;
}
double value_of(const model::Number& n) {
  return std::ldexp(n.mantissa, n.exponent - fixed::kMantissaBits);
}
model::Bases in_block(const DriveConstants<double>& d) {
  model::Bases bases;
  DriveConstants<double> copy = d;
  for_each_pair(bases, copy, [](model::Number& n, double x) { n = number_of(x); });
  return bases;
}
DriveConstants<double> from_block(const model::Bases& bases) {
  DriveConstants<double> d;
  model::Bases copy = bases;
  for_each_pair(copy, d, [](const model::Number& n, double& x) { x = value_of(n); });
  return d;
}

}  // namespace flexspline::deployment
