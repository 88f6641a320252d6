#include "hil/thesis_models/friction_block.hpp"

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace flexspline::report {
namespace {

// The largest dry friction in one direction (a bound where several curves add up). Stribeck terms are monotonic, so
// each curve's is at rest or at speed.
double largest_dry(const Shaft& shaft, int direction) {
  double sum = 0.0;
  for (const FrictionCurve& curve : shaft.frictions)
    sum += std::max(curve.dry(0.0, direction), curve.dry(HUGE_VAL, direction));
  return sum;
}

}  // namespace

double Shaft::friction(double velocity_rad_s) const {
  double sum = 0.0;
  for (const FrictionCurve& curve : frictions) sum += curve.torque(velocity_rad_s);
  return sum;
}

double Shaft::dry(double speed_rad_s, int direction) const {
  double sum = 0.0;
  for (const FrictionCurve& curve : frictions) sum += curve.dry(speed_rad_s, direction);
  return sum;
}

FrictionBlock::FrictionBlock(Shaft shaft, double step_s) : shaft_(std::move(shaft)), step_s_(step_s) {
  if (!(shaft_.inertia > 0.0) || !(step_s_ > 0.0))
    throw std::invalid_argument("a friction block needs a positive inertia and a positive integration step");
  for (const FrictionCurve& curve : shaft_.frictions)
    for (const DirectionalFriction* f : {&curve.positive, &curve.negative})
      if (!(f->viscous >= 0.0 && f->coulomb >= 0.0 && f->coulomb + f->stribeck >= 0.0 && f->stribeck_velocity > 0.0))
        throw std::invalid_argument(
            "friction that drives: viscous, Coulomb and Coulomb + Stribeck coefficients must not be negative, and the "
            "Stribeck velocity must be positive");
}

double FrictionBlock::next_velocity(double velocity_rad_s, double driving_nm) const {
  return velocity_rad_s + step_s_ / shaft_.inertia * (driving_nm - torque(velocity_rad_s, driving_nm));
}

ThresholdFriction::ThresholdFriction(Shaft shaft, double step_s, double threshold_rad_s)
    : FrictionBlock(std::move(shaft), step_s), threshold_(threshold_rad_s) {}

double ThresholdFriction::torque(double velocity_rad_s, double driving_nm) const {
  if (std::abs(velocity_rad_s) > threshold_) return shaft().friction(velocity_rad_s);
  return std::clamp(driving_nm, -shaft().break_away(-1), shaft().break_away(1));
}

BoundaryLayerFriction::BoundaryLayerFriction(Shaft shaft_of, double step)
    : FrictionBlock(std::move(shaft_of), step),
      positive_width_(largest_dry(shaft(), 1) / shaft().inertia * step_s()),
      negative_width_(largest_dry(shaft(), -1) / shaft().inertia * step_s()) {}

double BoundaryLayerFriction::torque(double velocity_rad_s, double /*driving_nm*/) const {
  const int direction = velocity_rad_s < 0.0 ? -1 : 1;
  const double speed = std::abs(velocity_rad_s);
  const double layer = width(direction);
  const double outside = shaft().friction(velocity_rad_s);
  if (speed >= layer) return outside;
  // Viscous friction is continuous; only the part that jumps at rest is smoothed.
  const double viscous = outside - direction * shaft().dry(speed, direction);
  return (speed > 0.0 ? viscous : 0.0) + shaft().dry(layer, direction) * velocity_rad_s / layer;
}

double ImplicitFriction::next_velocity(double velocity_rad_s, double driving_nm) const {
  const double per_velocity = shaft().inertia / step_s();
  // The friction torque for which the shaft is at rest at the end of the step.
  const double momentum = driving_nm + per_velocity * velocity_rad_s;
  const int direction = momentum > shaft().break_away(1) ? 1 : momentum < -shaft().break_away(-1) ? -1 : 0;
  if (direction == 0) return 0.0;
  const auto left_over = [&](double speed) {
    const double resisting =
        speed > 0.0 ? direction * shaft().friction(direction * speed) : shaft().dry(0.0, direction);
    return per_velocity * speed + resisting - direction * momentum;
  };
  const double fastest = direction * momentum / per_velocity;
  const double at_fastest = left_over(fastest);
  if (at_fastest <= 0.0) return direction * fastest;
  std::uintmax_t evaluations = 100;
  const auto bracket = boost::math::tools::toms748_solve(left_over, 0.0, fastest, left_over(0.0), at_fastest,
                                                         boost::math::tools::eps_tolerance<double>(52), evaluations);
  return direction * 0.5 * (bracket.first + bracket.second);
}

double ImplicitFriction::torque(double velocity_rad_s, double driving_nm) const {
  return driving_nm - shaft().inertia / step_s() * (next_velocity(velocity_rad_s, driving_nm) - velocity_rad_s);
}

std::unique_ptr<FrictionBlock> make_friction_block(FrictionMethod method, Shaft shaft, double step_s) {
  switch (method) {
    case FrictionMethod::threshold_1e_8:
      return std::make_unique<ThresholdFriction>(std::move(shaft), step_s, 1e-8);
    case FrictionMethod::threshold_1e_4:
      return std::make_unique<ThresholdFriction>(std::move(shaft), step_s, 1e-4);
    case FrictionMethod::boundary_layer:
      return std::make_unique<BoundaryLayerFriction>(std::move(shaft), step_s);
    case FrictionMethod::implicit:
      return std::make_unique<ImplicitFriction>(std::move(shaft), step_s);
  }
  throw std::invalid_argument("unknown friction method");
}

}  // namespace flexspline::report
