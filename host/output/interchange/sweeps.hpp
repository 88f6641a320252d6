// A model driven through plain motions: steady rotation, slow twisting.
#pragma once

#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::interchange {

struct SteadyTorque {
  double motor = 0.0;  // motor side
  double load = 0.0;   // output side
};
struct Twist {
  double torsion = 0.0;
  double torque = 0.0;  // output side
};

class Sweeps {
 public:
  // The parameters must have values.
  Sweeps(const model::Model& model, const catalogue::DriveConstants<double>& constants)
      : model_(model), constants_(constants) {}

  // What steady motion at a motor velocity takes, without load and at the reference temperature, as the mean over a
  // turn of the motor, after presliding has passed.
  SteadyTorque at_speed(double velocity) const;
  // kg m^2, each on its own side.
  double motor_inertia() const;
  double output_inertia() const;

  bool has_transmission() const;
  // The transmission's torque from rest up to `torque`, back to its negative, and up again, in steps of torsion; empty
  // where a torsion of a radian does not reach it.
  std::vector<Twist> loop(double torque) const;
  // The torsion on the first branch of that; zero where it is not reached.
  double torsion_at(double torque) const;
  // What the transmission carries at no torsion, twisting at a rate.
  double torque_at_rate(double rate) const;

 private:
  const model::Model& model_;
  const catalogue::DriveConstants<double>& constants_;
};

}  // namespace flexspline::interchange
