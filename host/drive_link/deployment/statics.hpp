// What a model's effects carry where nothing, or next to nothing, moves: what the bases and limits of a drive follow
// from.
#pragma once

#include <memory>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/catalogue/resolved_model.hpp"

namespace flexspline::deployment {

// The transmission's effects without memory.
class Springs {
 public:
  // Effects need their values.
  explicit Springs(const catalogue::ResolvedModel& model);
  // N m at the output, torsion in rad of the output.
  double torque_at(double torsion) const;

 private:
  std::vector<std::unique_ptr<catalogue::Instance>> effects_;
};

// By how much the motor's torque may change while friction holds the shaft, N m: the most by which torque of creeping
// forward exceeds that of creeping back, unloaded and at rated load. What is the same both ways, as gravity, ripple
// and offsets, is not in it. Friction at the reference temperature. Effects need their values.
double torque_held_by_friction(const catalogue::ResolvedModel& model);

}  // namespace flexspline::deployment
