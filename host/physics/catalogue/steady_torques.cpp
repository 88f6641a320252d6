#include "host/physics/catalogue/steady_torques.hpp"

#include <cmath>
#include <numbers>

namespace flexspline::catalogue {

effects::Torques<Real> steady_torques(Instance& effect, bool has_state, effects::Inputs<Real> in) {
  constexpr int kStepsATurn = 4096;  // short compared with presliding
  if (has_state) {
    const double turn = std::copysign(2.0 * std::numbers::pi, in.velocity);
    in.elapsed = turn / kStepsATurn / in.velocity;
    effects::Inputs<Real> before = in, now = in;
    for (int k = 1; k <= kStepsATurn; ++k) {
      now.angle = in.angle + turn * k / kStepsATurn;
      now.output_angle = in.output_angle + in.output_velocity * k * in.elapsed;
      effect.advance(now, before);
      before = now;
    }
  }
  effects::Torques<Real> torques{};
  effect.evaluate(in, torques);
  return torques;
}

}  // namespace flexspline::catalogue
