// Lag of the effort's time base against that of the motion. It shifts the phase of a wave over the motor's angle with
// the speed, so that a ripple found at one speed does not hold at another.
#pragma once

#include <optional>
#include <vector>

#include "host/engine/selection/regressor_table.hpp"

namespace flexspline::selection {

struct TimeLag {
  double lag_s = 0.0;  // positive: the effort comes later than the motion that it belongs to
  double std_s = 0.0;
  double reduction_share = 0.0;  // of the squares above the noise, where the lag is corrected
};

enum class LagRange { usual, longest };

// By least squares over all lags of up to policy.usual_lag_rows (profile likelihood), with the model's columns and
// those of `terms` (places in table.terms), at the highest bandwidth of the motion and away from reversals; where the
// best one is at the end and `range` is the longest, up to policy.longest_lag_s. Nothing where the data have too few
// samples or the best lag is at the end of the range.
std::optional<TimeLag> estimate_time_lag(const RegressorTable& table, const std::vector<int>& terms, LagRange range,
                                         const SelectionPolicy& policy);

// Shifts the target by a lag.
void correct_time_lag(RegressorTable& table, double lag_s);

}  // namespace flexspline::selection
