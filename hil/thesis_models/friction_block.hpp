// The friction simulation block of the report (section 2.1.1, figures 7 to 11) and its variants.
#pragma once

#include <memory>
#include <vector>

#include "hil/thesis_models/friction_curve.hpp"

namespace flexspline::report {

/// A shaft (or a block on a rough surface, with mass and force for inertia and torque). Frictions on it add up.
struct Shaft {
  double inertia = 0.0;  ///< kg m^2
  std::vector<FrictionCurve> frictions;

  double friction(double velocity_rad_s) const;
  double dry(double speed_rad_s, int direction) const;
  double break_away(int direction) const { return dry(0.0, direction); }
};

/// The friction on a shaft, from its velocity and its driving torque (all torques except friction).
class FrictionBlock {
 public:
  /// `step_s` is the longest integration step. Throws std::invalid_argument where inertia or step are not positive, or
  /// where friction would drive (negative Coulomb, viscous or break-away torque).
  FrictionBlock(Shaft shaft, double step_s);
  virtual ~FrictionBlock() = default;

  /// Friction torque (N m) that resists motion. At rest it is the torque that holds the shaft (F_fr = F_dr).
  virtual double torque(double velocity_rad_s, double driving_nm) const = 0;
  /// The shaft's velocity after one step under a constant `driving_nm`: an Euler step with `torque`, unless the variant
  /// has a better method.
  virtual double next_velocity(double velocity_rad_s, double driving_nm) const;

  const Shaft& shaft() const { return shaft_; }
  double step_s() const { return step_s_; }

 private:
  Shaft shaft_;
  double step_s_;
};

/// The first block of the report: a shaft slower than `threshold_rad_s` (1e-8 in figure 9, 1e-4 in 10) is at rest.
class ThresholdFriction final : public FrictionBlock {
 public:
  ThresholdFriction(Shaft shaft, double step_s, double threshold_rad_s);
  double torque(double velocity_rad_s, double driving_nm) const override;

 private:
  double threshold_;
};

/// The report's final block (figures 8 and 11): linear through zero within a layer that is as wide as the change of
/// velocity by full friction in one step. It does not use the driving torque, so a loaded shaft creeps.
class BoundaryLayerFriction final : public FrictionBlock {
 public:
  BoundaryLayerFriction(Shaft shaft, double step_s);
  double torque(double velocity_rad_s, double driving_nm) const override;
  /// Eq. 32, for each direction with its own friction; rad/s.
  double width(int direction) const { return direction < 0 ? negative_width_ : positive_width_; }

 private:
  double positive_width_;
  double negative_width_;
};

/// Not in the report: backward Euler on the set-valued curve; friction and the velocity at the end of the step agree. A
/// shaft that can be stopped within a step is stopped, and then held exactly.
class ImplicitFriction final : public FrictionBlock {
 public:
  using FrictionBlock::FrictionBlock;
  double torque(double velocity_rad_s, double driving_nm) const override;
  double next_velocity(double velocity_rad_s, double driving_nm) const override;
};

enum class FrictionMethod { threshold_1e_8, threshold_1e_4, boundary_layer, implicit };
std::unique_ptr<FrictionBlock> make_friction_block(FrictionMethod method, Shaft shaft, double step_s);

}  // namespace flexspline::report
