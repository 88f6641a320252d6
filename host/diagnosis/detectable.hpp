// The smallest effect that the data at hand would have shown.
#pragma once

#include <optional>

#include "host/diagnosis/diagnosis.hpp"
#include "host/diagnosis/imitation.hpp"
#include "host/diagnosis/trials.hpp"

namespace flexspline::diagnosis {

// What the search is expected to find if an effect is there: its own score (`fall_of`), where the model that lacks the
// effect leaves, besides the noise, what it cannot imitate of the effect's torque.
class Detection {
 public:
  explicit Detection(Search& search);

  // Nothing where the effect has no single size, or none within its bounds would be named. Columns are made in `data`,
  // a copy of the search's: each thread has its own.
  std::optional<Detectable> smallest(const Trial& trial, BalanceData& data) const;

 private:
  bool named(const Trial& trial, const Eigen::VectorXd& own, double scale) const;
  std::optional<double> scale_to_name(const Trial& trial, const Eigen::VectorXd& torque) const;
  std::optional<Detectable> of_linear(const Trial& trial, regression::Terms terms, BalanceData& data) const;
  std::optional<Detectable> of_wave(const Trial& trial, regression::Terms terms, BalanceData& data) const;
  std::optional<Detectable> of_shape(const Trial& trial, regression::Terms terms, BalanceData& data) const;

  Search* search_;
  Imitation imitation_;
  Eigen::VectorXd base_torque_;
};

}  // namespace flexspline::diagnosis
