// Samples of one torque balance over all records: the target, and a column for any parameter of any effect. Columns are
// computed at their first use and cached, so that a search over models computes each column once.
#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <unordered_map>

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

class BalanceData {
 public:
  // Keeps a reference to `prepared`. Records that lack what the balance needs have no samples.
  BalanceData(const PreparedData& prepared, Balance balance);

  Balance balance() const { return balance_; }
  bool empty() const { return target_.size() == 0; }
  Eigen::Index rows() const { return target_.size(); }
  const PreparedData& prepared() const { return *prepared_; }
  const std::vector<RowRange>& records() const { return ranges_; }
  // Each record's samples cut into `parts` pieces of equal length: part k of all records is fold k of a
  // cross-validation.
  std::vector<std::vector<RowRange>> folds(std::size_t parts) const;
  // Index within its record, at full rate, of the sample in this row.
  std::size_t sample_of(const RowRange& range, Eigen::Index row) const;

  // Measured left side, filtered, N m: Km i - T/N (motor; Km i without a torque sensor), T, T - load torque.
  const Eigen::VectorXd& target() const { return target_; }
  // Negative slope of the target: what a delay of one second adds to it, to first order.
  const Eigen::VectorXd& delay_column() const { return delay_; }

  // Torque per unit of a linear parameter, with nonlinear parameters, shifts and modulations as in `terms`, filtered. N
  // m per unit. The reference holds until the next call.
  const Eigen::VectorXd& column(const Terms& terms, ParameterRef ref);
  // Those of many parameters side by side: what is not there yet is filtered together, which costs less than half.
  Eigen::MatrixXd columns(const Terms& terms, const std::vector<ParameterRef>& refs);
  // Slope of the model's torque by a nonlinear parameter, at the linear parameters of `terms`, filtered.
  Eigen::VectorXd nonlinear_column(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                   ParameterRef nonlinear_ref);
  Eigen::MatrixXd nonlinear_columns(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                    const std::vector<ParameterRef>& nonlinear);
  // Slopes by linear, then by nonlinear parameters: columns that let a linear fit move nonlinear parameters to first
  // order.
  Eigen::MatrixXd slopes(const Terms& terms, const std::vector<std::size_t>& on_balance,
                         const std::vector<ParameterRef>& linear, const std::vector<ParameterRef>& nonlinear);
  // Torque of terms with known linear parameters, of those that no linear parameter scales at their nonlinear
  // parameters as they stand, and of those that only reach this balance, filtered: belongs on the left side. It moves
  // with the nonlinear parameters.
  Eigen::VectorXd known_torque(const Terms& terms, const std::vector<std::size_t>& on_balance);
  // The linear regression y = X theta at the nonlinear parameters of `terms`: columns of the linear parameters, and the
  // target less what is known.
  struct Regression {
    Eigen::MatrixXd X;
    Eigen::VectorXd y;
  };
  Regression regression(const Terms& terms, const std::vector<std::size_t>& on_balance,
                        const std::vector<ParameterRef>& linear);
  // Torque of one term at its values, all parameters in, filtered.
  Eigen::VectorXd term_torque(const Terms& terms, std::size_t term);
  // The target less the torques of all terms at their values, N m.
  Eigen::VectorXd residual(const Terms& terms);

  // What one unit at each point of a table adds, one column a point: linear interpolation between even points of a
  // signal
  // (`low` to `high`, or over a turn for an angle), times the direction where `times_direction`. The signal is as the
  // shifts of `terms` leave it. Unfiltered columns cost a small part and serve to distinguish signals.
  struct Points {
    effects::Variable variable{};
    bool times_direction = false;
    Balance balance = Balance::motor;
    double low = 0.0;
    double high = 1.0;
    std::size_t count = 2;
  };
  Eigen::MatrixXd point_columns(const Terms& terms, const Points& points, bool filtered = true);
  // Values of a signal at the samples, as the shifts of `terms` leave it; angles within a turn.
  Eigen::VectorXd signal_at_rows(const Terms& terms, effects::Variable variable);

  // The same samples and target, with columns from decimated signals (eight samples a period of the cut-off): they cost
  // a part, and are near enough to choose a point on a grid and to begin a search, not to report. `few` takes the
  // samples and must live as long as the result.
  BalanceData decimated(PreparedData& few) const;

  // Samples that count as one for white noise, because the filter correlates neighbours: their rate over twice the
  // filter's noise bandwidth. A short residual underestimates this.
  double filter_autocorrelation_time() const;
  // Records with too few samples to be used, by their index, with name and reason.
  const std::map<std::size_t, std::string>& left_out() const { return left_out_; }

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
  // Slopes by a nonlinear parameter of what one parameter alone scales: kept per unit of that, as a search asks for
  // those of the model with each candidate again.
  bool is_slope_cached(const Terms& terms, ParameterRef nonlinear_ref) const;
  Eigen::VectorXd cached_slope(const Terms& terms, ParameterRef nonlinear_ref);
  // Puts columns that are not there yet among those that are.
  void make_columns(const Terms& terms, const std::vector<ParameterRef>& refs);

  const PreparedData* prepared_;
  Balance balance_;
  std::vector<RowRange> ranges_;
  std::map<std::size_t, std::string> left_out_;
  Eigen::VectorXd target_;
  Eigen::VectorXd delay_;
  std::vector<signals::ZeroPhaseFilter> filters_;  // one a range
  // How far each sample of the target is beyond the sample of the decimated signals before it, in their samples.
  std::vector<double> beyond_;
  std::unordered_map<std::string, Eigen::VectorXd> cache_;
};

}  // namespace flexspline::estimation
