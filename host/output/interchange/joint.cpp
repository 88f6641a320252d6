#include <algorithm>
#include <cmath>
#include <functional>

#include "host/output/interchange/export.hpp"
#include "host/output/interchange/sweeps.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::interchange {
namespace {

constexpr int kSpeeds = 60;

// Linear law friction + damping w through points, by least squares; neither below zero.
void fit_line(const std::vector<double>& speed, const std::vector<double>& torque, Joint& joint) {
  const double n = static_cast<double>(speed.size());
  double w = 0.0, t = 0.0, ww = 0.0, wt = 0.0;
  for (std::size_t k = 0; k < speed.size(); ++k) {
    w += speed[k];
    t += torque[k];
    ww += speed[k] * speed[k];
    wt += speed[k] * torque[k];
  }
  joint.damping = (n * wt - w * t) / (n * ww - w * w);
  joint.friction = (t - joint.damping * w) / n;
  if (joint.damping < 0.0) {
    joint.damping = 0.0;
    joint.friction = t / n;
  } else if (joint.friction < 0.0) {
    joint.friction = 0.0;
    joint.damping = wt / ww;
  }
  joint.damping = std::max(joint.damping, 0.0);
  joint.friction = std::max(joint.friction, 0.0);
  double left = 0.0;
  for (std::size_t k = 0; k < speed.size(); ++k) {
    const double e = torque[k] - joint.friction - joint.damping * speed[k];
    left += e * e / n;
  }
  joint.friction_error = std::sqrt(left);
}

Joint numbers_of(const model::Model& model, const catalogue::DriveConstants<double>& constants, double fastest,
                 double rated_torque) {
  Joint joint;
  const Sweeps sweeps(model, constants);
  const double ratio = constants.gear_ratio;
  joint.gear_ratio = ratio;
  joint.armature = ratio * ratio * sweeps.motor_inertia();
  joint.output_inertia = sweeps.output_inertia();
  std::vector<double> speed, torque;
  for (int k = 0; k < kSpeeds; ++k) {
    // Even in the logarithm: slow motion is where friction bends.
    const double w = fastest * std::pow(10.0, -2.0 + 2.0 * k / (kSpeeds - 1));
    speed.push_back(w / ratio);
    const SteadyTorque forward = sweeps.at_speed(w), backward = sweeps.at_speed(-w);
    torque.push_back(0.5 * (ratio * (forward.motor - backward.motor) + forward.load - backward.load));
  }
  fit_line(speed, torque, joint);
  if (sweeps.has_transmission()) {
    const auto secant = [&](double load) {
      const double torsion = sweeps.torsion_at(load);
      return torsion > 0.0 ? load / torsion : 0.0;
    };
    // Without a rated torque, one for a linear stiffness, which joint_of() demands then.
    const double load = rated_torque > 0.0 ? rated_torque : 1.0;
    joint.stiffness = secant(0.5 * load);
    if (joint.stiffness > 0.0) joint.stiffness_error = std::abs(secant(load) / joint.stiffness - 1.0);
    const double rate = 0.01 * fastest / ratio;
    joint.link_damping = std::max(0.0, sweeps.torque_at_rate(rate) / rate);
  }
  return joint;
}

// Over four decades of torque: wind-up is soft at small torques, and stiffness grows at large ones.
void require_linear_stiffness(const model::Model& model, const catalogue::DriveConstants<double>& constants) {
  const Sweeps sweeps(model, constants);
  if (!sweeps.has_transmission()) return;
  constexpr double kLowest = 0.1, kHighest = 1000.0, kSame = 0.01;
  double first = 0.0;
  for (double load = kLowest; load <= kHighest; load *= 10.0) {
    const double torsion = sweeps.torsion_at(load);
    if (!(torsion > 0.0)) continue;
    if (first == 0.0) first = load / torsion;
    if (std::abs(load / torsion / first - 1.0) > kSame)
      throw ExportError(
          "the stiffness of a joint is the secant at half the rated torque, which the model does not state, and its "
          "stiffness depends on the torque; add rated_torque_nm to its [drive]");
  }
}

bool differs(double a, double b) {
  return std::abs(a - b) > 1e-9 * (std::abs(a) + std::abs(b));
}

}  // namespace

Joint joint_of(const model::Model& model) {
  if (!model.drive.rated_velocity_rad_s.value)
    throw ExportError(
        "the friction of a joint is fitted up to the rated velocity, which the model does not state; add "
        "rated_velocity_rad_s to its [drive]");
  const auto constants = catalogue::constants_of(model.drive);
  const double fastest = *model.drive.rated_velocity_rad_s.value;
  const double rated = model.drive.rated_torque_nm.value.value_or(0.0);
  if (!(rated > 0.0)) require_linear_stiffness(model, constants);
  Joint joint = numbers_of(model, constants, fastest, rated);
  joint.torque_limit = rated;
  joint.velocity_limit = fastest / constants.gear_ratio;
  // What changes no number when it is taken out.
  for (const model::Effect& effect : model.effects) {
    model::Model without = model;
    std::erase_if(without.effects, [&](const model::Effect& e) {
      return e.id == effect.id || catalogue::entry_of(e).info->modulates == effect.type;
    });
    Joint other;
    try {
      other = numbers_of(without, constants, fastest, rated);
    } catch (const std::exception&) {
      continue;
    }
    if (!differs(other.armature, joint.armature) && !differs(other.damping, joint.damping) &&
        !differs(other.friction, joint.friction) && !differs(other.stiffness, joint.stiffness) &&
        !differs(other.link_damping, joint.link_damping) && !differs(other.output_inertia, joint.output_inertia))
      joint.left_out.push_back(effect.id);
  }
  return joint;
}

}  // namespace flexspline::interchange
