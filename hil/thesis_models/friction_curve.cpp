#include "hil/thesis_models/friction_curve.hpp"

#include <cmath>

namespace flexspline::report {

double FrictionCurve::dry(double speed_rad_s, int direction) const {
  const DirectionalFriction& f = of(direction);
  const double ratio = speed_rad_s / f.stribeck_velocity;
  switch (shape) {
    case Stribeck::none:
      return f.coulomb;
    case Stribeck::hess_soom:
      return f.coulomb + f.stribeck / (1.0 + ratio * ratio);
    case Stribeck::tustin:
      return f.coulomb + f.stribeck * std::exp(-ratio * ratio);
  }
  return f.coulomb;
}

double FrictionCurve::torque(double velocity_rad_s) const {
  if (velocity_rad_s == 0.0) return 0.0;
  const int direction = velocity_rad_s > 0.0 ? 1 : -1;
  return viscous(direction) * velocity_rad_s + direction * dry(std::abs(velocity_rad_s), direction);
}

}  // namespace flexspline::report
