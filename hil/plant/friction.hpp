#pragma once

#include <vector>

namespace flexspline::plant {

/// s F exp(-|w/vs|^exponent), F by direction. The exponent is 2 for the usual Gaussian form.
struct Stribeck {
  double positive = 0.0;
  double negative = 0.0;
  double velocity = 1.0;
  double exponent = 2.0;
};

/// s coefficient Tref |T/Tref|^exponent / N; with exponent 1 Tref cancels.
struct LoadFriction {
  double coefficient = 0.0;
  double exponent = 1.0;
  double reference = 1.0;
};

/// s coefficient |T| exp(-(w/vs)^2) / N
struct LoadStiction {
  double coefficient = 0.0;
  double velocity = 1.0;
};

/// |T|/N times a share that the contacts carry: at most `driving` where the motor drives the load, at most `driven`
/// where the load drives the motor. The deflection z goes to the direction of motion over a travel of some
/// `presliding`; zero: the drive has none.
struct DrivingLoss {
  double driving = 0.0;
  double driven = 0.0;
  double presliding = 0.0;
};

/// cosine cos(k q) + sine sin(k q)
struct Ripple {
  double order = 0.0;
  double cosine = 0.0;
  double sine = 0.0;
};

/// amplitude times a triangular wave of k q + phase, zero and rising where that is zero
struct TriangleRipple {
  double order = 0.0;
  double amplitude = 0.0;
  double phase = 0.0;
};

/// s height exp(-(x/width)^2), x the distance of the shaft from an angle: of the motor, within a turn, or of the gear's
/// output.
struct Bump {
  double height = 0.0;
  double angle = 0.0;
  double width = 1.0;
  bool of_output = false;
};

/// s height / (1 + exp(-(|w| - velocity)/width)): friction that sets in above a speed.
struct Onset {
  double height = 0.0;
  double velocity = 1.0;
  double width = 1.0;
};

/// s F / (1 + (w/vs)^2), F by direction.
struct HessSoom {
  double positive = 0.0;
  double negative = 0.0;
  double velocity = 1.0;
};

/// s0 z + s1 z', z' = w - s0 |w| z/g, g = Fc + (Fs - Fc) exp(-(w/vs)^2). A stiffness of zero: the drive has none.
struct LuGre {
  double coulomb = 0.0;
  double static_friction = 0.0;
  double velocity = 1.0;
  double stiffness = 0.0;
  double damping = 0.0;

  double limit(double velocity_rad_s) const;
};

/// What the laws of friction remember of the shaft's travel. A law with memory has its state here.
struct FrictionMemory {
  double bristle = 0.0;  ///< deflection of the bristle, rad
  double loss = 0.0;     ///< deflection of the loss by driving direction, -1 to 1
};

/// The state at which the friction on the motor shaft is evaluated; what it remembers is that of the anchor.
struct FrictionPoint : FrictionMemory {
  double direction = 0.0;        ///< +1 or -1: the branch of the set-valued sign
  double velocity = 0.0;         ///< motor rad/s
  double torque = 0.0;           ///< through the flexspline, output side, N m
  double angle = 0.0;            ///< motor rad
  double anchor = 0.0;           ///< motor angle at the anchor, from where it moved in one direction
  double anchor_velocity = 0.0;  ///< motor rad/s there
};

/// Torque that resists positive motion, and its partial derivatives.
struct FrictionTorque {
  double torque = 0.0;
  double by_velocity = 0.0;
  double by_torque = 0.0;
  double by_angle = 0.0;
};

/// All torques between Km i and J a + T/N on the motor shaft, except inertia.
struct MotorFriction {
  double gear_ratio = 100.0;
  double viscous = 0.0;
  double viscous_asymmetry = 0.0;
  double coulomb = 0.0;
  double coulomb_asymmetry = 0.0;
  double power_torque = 0.0;
  double power_exponent = 1.0;
  double power_reference = 1.0;
  double temperature_coefficient = 0.0;
  double coulomb_temperature_coefficient = 0.0;
  double temperature_reference = 0.0;
  double dry_share = 1.0;  ///< present factor on friction that does not depend on speed
  double quadratic = 0.0;
  std::vector<HessSoom> hess_soom;
  std::vector<Ripple> load_ripple;     ///< times the torque through the flexspline
  std::vector<Ripple> angle_friction;  ///< times the direction
  LuGre lugre;
  DrivingLoss loss;
  double dahl_torque = 0.0;
  double dahl_presliding = 0.0;
  std::vector<Stribeck> stribeck;
  std::vector<LoadFriction> load;
  std::vector<LoadStiction> load_stiction;
  std::vector<Ripple> ripple;
  std::vector<TriangleRipple> triangle_ripple;
  std::vector<Bump> bumps;
  std::vector<Onset> onsets;

  /// Factor on the viscous coefficient at a temperature, exp(-b (temp - temp0)).
  double viscous_factor(double temperature_c) const;
  /// The same for Coulomb friction and the effects that replace it.
  double coulomb_factor(double temperature_c) const;
  bool has_bristle() const { return dahl_torque > 0.0 || lugre.stiffness > 0.0; }
  /// Only viscous, quadratic and Coulomb friction.
  bool is_plain() const;
  /// evaluate() for plain friction.
  FrictionTorque evaluate_plain(double direction, double velocity, double viscous_now) const {
    // On its branch the law is smooth past w = 0, so that a solver can evaluate beyond an event before it locates it.
    const double along = direction * velocity;
    FrictionTorque sum;
    sum.torque = viscous_now * velocity + viscous_asymmetry * along + coulomb_asymmetry;
    sum.by_velocity = viscous_now + viscous_asymmetry * direction;
    sum.torque += quadratic * velocity * along;
    sum.by_velocity += 2.0 * quadratic * (along < 0.0 ? -along : along);
    sum.torque += direction * coulomb * dry_share;
    return sum;
  }
  /// `viscous_now` is the viscous coefficient at the present temperature.
  FrictionTorque evaluate(const FrictionPoint& at, double viscous_now) const;
  /// Bristle deflection after the shaft moved, in one direction, from the anchor to `angle`: the rate-independent law
  /// dz/dq = 1 - s z/presliding, solved exactly.
  double bristle(const FrictionPoint& at) const;
  /// The same of the loss.
  double loss_deflection(const FrictionPoint& at) const;
  /// All of it.
  FrictionMemory remember(const FrictionPoint& at) const { return {bristle(at), loss_deflection(at)}; }
};

}  // namespace flexspline::plant
