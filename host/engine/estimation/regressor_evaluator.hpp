// Torque that parameters of effects add to one balance, along all records, filtered: pure, the same arguments give the
// same numbers.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"
#include "shared/effects/variables.hpp"

namespace flexspline::estimation {

// Samples [first, last) that belong to one record, or to one part of one.
struct RowRange {
  std::size_t record = 0;
  Eigen::Index first = 0;
  Eigen::Index last = 0;
  Eigen::Index size() const { return last - first; }
};

class RegressorEvaluator {
 public:
  // Keeps a reference to `prepared`. Records that lack what the balance needs have no samples.
  RegressorEvaluator(const PreparedData& prepared, Balance balance);

  Balance balance() const { return balance_; }
  const PreparedData& prepared() const { return *prepared_; }
  const std::vector<RowRange>& records() const { return ranges_; }
  Eigen::Index rows() const { return ranges_.empty() ? 0 : ranges_.back().last; }
  // Records with too few samples to be used, by their index, with name and reason.
  const std::map<std::size_t, std::string>& left_out() const { return left_out_; }
  // Of all balances, the filter's autocorrelation time; see RegressionProblem.
  double filter_autocorrelation_time() const;

  // The measured left side and its negative slope, two columns, N m and N m/s.
  Eigen::MatrixXd left_side() const;
  // Torque per unit of linear parameters, one column each, with nonlinear parameters, shifts and modulations as in
  // `terms`. N m per unit. What is asked for together is filtered together, which costs less than half.
  Eigen::MatrixXd unit_columns(const Terms& terms, const std::vector<ParameterRef>& refs) const;
  // The same, not filtered, of terms without memory whose inputs no other changes: computed at the samples alone, they
  // cost a tenth and serve to compare sizes.
  Eigen::MatrixXd unfiltered_columns(const Terms& terms, const std::vector<ParameterRef>& refs) const;
  // Slopes by nonlinear parameters of the torque of the terms `of`, at the linear parameters of `terms`.
  Eigen::MatrixXd slopes(const Terms& terms, const std::vector<std::size_t>& of,
                         const std::vector<ParameterRef>& nonlinear) const;
  // Slope by a nonlinear parameter of what one unit of a linear parameter of the same term adds.
  Eigen::VectorXd slope_per_unit(const Terms& terms, ParameterRef nonlinear, std::size_t linear) const;
  // Torque of one term at its values, all parameters in.
  Eigen::VectorXd torque(const Terms& terms, std::size_t term) const;

  // Torque of all terms at their values at each sample of a record, not filtered, N m.
  std::vector<double> torque_along(const Terms& terms, std::size_t record) const;

  // What one unit at each point of a table adds, one column a point: linear interpolation between even points of a
  // signal (`low` to `high`, or over a turn for an angle), times the direction where `times_direction`. The signal is
  // as the shifts of `terms` leave it. Unfiltered columns cost a small part and serve to distinguish signals.
  struct Points {
    effects::Variable variable{};
    bool times_direction = false;
    Balance balance = Balance::motor;
    double low = 0.0;
    double high = 1.0;
    std::size_t count = 2;
  };
  Eigen::MatrixXd point_columns(const Terms& terms, const Points& points, bool filtered = true) const;
  // Cosine and sine of a whole multiple of an angle, two columns, filtered: N m on `of`, by its share here.
  Eigen::MatrixXd wave_columns(const Terms& terms, effects::Variable angle, Balance of, int multiple) const;
  // Values of a signal at the samples, as the shifts of `terms` leave it; angles within a turn.
  Eigen::VectorXd signal_at_rows(const Terms& terms, effects::Variable variable) const;

  // The same samples from decimated signals, eight a period of the cut-off: they cost a part, and are near enough to
  // choose a point on a grid and to begin a search, not to report.
  RegressorEvaluator decimated() const;

 private:
  // Filters signals that are given along the samples of a range's record, in place.
  void filter(const RowRange& range, Eigen::Ref<Eigen::MatrixXd> signals) const;
  // Whether signals of both may be filtered side by side.
  bool have_equal_filters(const RowRange& a, const RowRange& b) const;
  bool usable(const Record& record) const;
  // How much of what adds to a balance reaches this one: its own, and by way of the gear without a torque sensor.
  double share(const Record& record, Balance of_effect) const;
  // The same of one effect. A drive at rest shows what the sensor of its effort reads, and nothing else.
  double share_of(const Term& term, const Record& record, Balance of_effect) const;
  // Samples from what `fill(range, column, signal)` writes along each record, filtered.
  template <class Fill>
  Eigen::MatrixXd filtered_columns(std::size_t columns, Fill fill) const;
  // Values of a filtered signal at the samples of a range.
  void take_rows(const RowRange& range, const double* signal, Eigen::Ref<Eigen::VectorXd> rows) const;
  // Inputs as shifts and modulations of `terms` leave them for a term; false where they change nothing of it.
  template <class N>
  bool change_inputs(const Terms& terms, const Term& term, const Record& record,
                     const std::vector<std::vector<typename N::Parameter>>& all_values,
                     std::vector<effects::Inputs<N>>& changed) const;
  template <class N>
  void add_torque(const Terms& terms, const Term& term, const std::vector<typename N::Parameter>& values,
                  const Record& record, const std::vector<std::vector<typename N::Parameter>>& all_values,
                  std::span<typename N::Value> torque) const;

  const PreparedData* prepared_;
  Balance balance_;
  std::vector<RowRange> ranges_;
  std::map<std::size_t, std::string> left_out_;
  std::vector<signals::ZeroPhaseFilter> filters_;  // one a range
  std::shared_ptr<const PreparedData> decimated_;  // own records, where the signals are decimated
  // How far each sample of the target is beyond the sample of the decimated signals before it, in their samples.
  std::vector<double> beyond_;
};

}  // namespace flexspline::estimation
