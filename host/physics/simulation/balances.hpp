// The effects of a model, ready to be summed on the three torque balances.
#pragma once

#include <memory>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/model.hpp"
#include "host/physics/simulation/piecewise_linear.hpp"

namespace flexspline::simulation {

using catalogue::Balance;
using Inputs = effects::Inputs<numbers::Real>;
using Torques = effects::Torques<numbers::Real>;

class Balances {
 public:
  // Inner states start from rest. The parameters must have values.
  Balances(const model::Model& model, const catalogue::DriveConstants<double>& constants);

  // Each adds the torques of the effects that belong to a balance; one effect may add to the others too. Inner states
  // are moved on from `before` to `now` and left as they were.
  void add_motor(const Inputs& now, const Inputs& before, Torques& sums) const {
    sums.motor += linear_motor_.torque(now.acceleration, now.velocity, now.direction);
    add(motor_, now, before, sums);
  }
  void add_transmission(const Inputs& now, const Inputs& before, Torques& sums) const {
    sums.transmission += stiffness_ * now.torsion;
    add(transmission_, now, before, sums);
  }
  void add_load(const Inputs& now, const Inputs& before, Torques& sums) const {
    sums.load += linear_load_.torque(now.output_acceleration, now.output_velocity, now.output_direction);
    add(load_, now, before, sums);
  }

  // All of a shaft's torques where they are linear in its motion, which then has a closed form; else null.
  const PiecewiseLinear* all_of_motor() const { return motor_.empty() ? &linear_motor_ : nullptr; }
  const PiecewiseLinear* all_of_load() const { return load_.empty() ? &linear_load_ : nullptr; }

  // True where shifts or modulations change what effects see.
  bool changes_inputs() const { return !changing_.empty(); }
  void change(Inputs& inputs) const;
  bool has_state() const { return !states_.empty(); }
  void advance(const Inputs& now, const Inputs& before);

  // True where what the transmission carries depends on the torque signal itself.
  bool transmission_reads_torque() const { return transmission_reads_torque_; }
  bool has_transmission() const { return stiffness_ != 0.0 || !transmission_.empty(); }
  // What the torque grows by per unit of acceleration.
  double motor_inertia() const;
  double output_inertia() const;

 private:
  struct Source {
    catalogue::Instance* instance;
    bool has_state;
  };
  // Adds a linear effect to the sums; false where it is not linear.
  bool take_piecewise_linear(const catalogue::Instance& instance, Balance balance);
  static void add(const std::vector<Source>& sources, const Inputs& now, const Inputs& before, Torques& sums) {
    for (const Source& source : sources) {
      if (source.has_state)
        source.instance->evaluate_ahead(now, before, sums);
      else
        source.instance->evaluate(now, sums);
    }
  }

  std::vector<std::unique_ptr<catalogue::Instance>> instances_;
  // Linear effects are summed once; the others are evaluated each time.
  PiecewiseLinear linear_motor_;
  PiecewiseLinear linear_load_;
  double stiffness_ = 0.0;
  std::vector<Source> motor_;
  std::vector<Source> transmission_;
  std::vector<Source> load_;
  std::vector<catalogue::Instance*> changing_;
  std::vector<catalogue::Instance*> states_;
  bool transmission_reads_torque_ = false;
};

}  // namespace flexspline::simulation
