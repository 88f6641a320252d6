// What errors in time of the motor's effort do to the estimates: a lag against the motion, and half a step of a held
// effort.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

// Filters of the current, buses and time stamps make the effort of a log later than the motion that it belongs to. With
// friction a lag looks like inertia: b w(t - d) is about b w - b d a.
struct EffortLag {
  double lag_s = 0.0;  // positive: the effort comes later
  double std_s = 0.0;
  // Of the parameters of each balance (linear, then nonlinear): by how much their estimates would change with the lag
  // corrected, where noise does not explain the change; zero where it does.
  std::vector<Eigen::VectorXd> change;
  Eigen::VectorXd slope;  // of the effort in time, N m/s: what a second of lag adds to the motor's balance, by sample

  bool is_certain() const;  // three standard errors
};

// The lag that the motor's balance shows, by least squares with one column more, the slope of the effort in time. A
// change of an estimate is compared with the difference of the two variances (Hausman 1978). Nothing where no record
// has an effort and a motion, or the slope is not independent of the model's columns, as beside a delay of the current.
//
// Errors of the model that look like a lag (friction that comes later than the reversal) are counted for one.
std::optional<EffortLag> effort_lag(const Identification& found);

// By how much the parameters of each balance change if readings of the torque lack half a step of a held effort (see
// zero_order_hold.hpp) where noise hides whether they do; zero where that is known.
std::vector<Eigen::VectorXd> change_by_held_step(const Identification& found);

}  // namespace flexspline::estimation
