// All motions, rehearsed and prepared for regression, together with the recorded data.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/planning/design.hpp"
#include "host/engine/planning/information.hpp"

namespace flexspline::planning {

class RehearsedMotions {
 public:
  // Identifies the model where there are data, rehearses all motions, drops those that break a limit. `effects` may be
  // missing in the model.
  explicit RehearsedMotions(const PlanRequest& request, const std::vector<std::string_view>& effects = {});

  const model::Model& model() const { return model_; }
  const estimation::Identification* identified() const { return identified_.get(); }
  // The model's effects, with values.
  const Terms& terms() const { return terms_; }
  const std::vector<Motion>& motions() const { return motions_; }
  Design::Peak peak(std::size_t motion, std::size_t run) const { return peaks_[motion][run]; }

  // One balance, over the rehearsed motions and over the data.
  struct BalanceData {
    std::unique_ptr<RegressionProblem> planned;
    const RegressionProblem* recorded = nullptr;  // null where there are no data
    std::vector<double> relative_noise;           // noise of each planned record over that of the recorded data
    double noise = 1.0;  // variance of the residual of a true model times its autocorrelation time, (N m)^2
  };
  std::vector<BalanceData>& balances() { return balances_; }
  // Prepared record of a motion's first run; the others follow.
  std::size_t first_record(std::size_t motion) const { return first_record_[motion]; }

 private:
  void rehearse_all(const PlanRequest& request, bool temperature);
  void prepare(const PlanRequest& request);

  model::Model model_;
  std::unique_ptr<estimation::Identification> identified_;
  Terms terms_;
  std::vector<Motion> motions_;
  std::vector<std::vector<Design::Peak>> peaks_;
  std::vector<std::size_t> first_record_;
  std::vector<data::Experiment> experiments_;
  estimation::PreparedData prepared_;
  std::vector<BalanceData> balances_;
};

}  // namespace flexspline::planning
