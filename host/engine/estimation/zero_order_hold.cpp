#include "host/engine/estimation/zero_order_hold.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/estimation/in_parallel.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;
using Signals = std::vector<std::vector<double>>;

constexpr double kCertainErrors = 3.0;  // standard errors
// Samples that count as one: the filter keeps half of their band (filtered_signals.cpp), and the errors are coloured
// noise as well.
constexpr double kRowsPerSample = 4.0;
constexpr double kFewestHeldRows = 100.0;

bool steps_with_effort(const Record& r) {
  const data::Experiment& e = *r.experiment;
  return !r.locked && !r.at_rest && r.has_motor_motion && !r.torque.empty() && !r.effort.empty() &&
         e.current_hold == data::CurrentHold::zoh && (e.has(Column::output_position) || e.has(Column::output_velocity));
}

// Half of the change of the effort at each sample, N m (N).
std::vector<double> half_steps(const Record& r, double torque_constant) {
  const data::Experiment& e = *r.experiment;
  const bool current = e.has(Column::current);
  const std::vector<double>& held = current ? e[Column::current] : e[Column::motor_torque];
  std::vector<double> steps(held.size(), 0.0);
  for (const data::Segment& s : r.segments)
    for (std::size_t k = s.first + 1; k < s.last; ++k)
      steps[k] = 0.5 * (current ? torque_constant : 1.0) * (held[k] - held[k - 1]);
  return steps;
}

template <class Value>
std::vector<double> along(const Record& r, Value value) {
  std::vector<double> signal(r.inputs.size());
  r.inputs.all().each_block([&](std::size_t first, auto block) {
    std::transform(block.begin(), block.end(), signal.begin() + static_cast<std::ptrdiff_t>(first), value);
  });
  return signal;
}

// Least squares over the samples of many records, by normal equations: few columns, none collinear.
class Fit {
 public:
  explicit Fit(Eigen::Index columns)
      : products_(Eigen::MatrixXd::Zero(columns, columns)), along_(Eigen::VectorXd::Zero(columns)) {}

  // Adds samples of filtered signals; the last one is what the others are to explain.
  void add(const Record& r, const signals::ZeroPhaseFilter& filter, Signals signals, Balance balance) {
    for (std::vector<double>& signal : signals)
      for (const data::Segment& s : r.segments)
        filter.apply_in_place(std::span<double>(signal.data() + s.first, s.last - s.first));
    const std::vector<std::size_t>& samples = r.rows[index(balance)].samples;
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(samples.size()), along_.size() + 1);
    for (Eigen::Index j = 0; j < rows.cols(); ++j)
      for (std::size_t k = 0; k < samples.size(); ++k)
        rows(static_cast<Eigen::Index>(k), j) = signals[static_cast<std::size_t>(j)][samples[k]];
    const auto left = rows.leftCols(along_.size());
    products_.noalias() += left.transpose() * left;
    along_.noalias() += left.transpose() * rows.rightCols(1);
    squares_ += rows.rightCols(1).squaredNorm();
    rows_ += static_cast<double>(samples.size());
  }
  void add(const Fit& other) {
    products_ += other.products_;
    along_ += other.along_;
    squares_ += other.squares_;
    rows_ += other.rows_;
  }

  struct Result {
    Eigen::VectorXd value, std;
  };
  // Nothing where the samples do not identify all of them.
  std::optional<Result> solve() const {
    const Eigen::VectorXd size = products_.diagonal().cwiseSqrt();
    if (rows_ < kFewestHeldRows || !(size.minCoeff() > 0.0)) return std::nullopt;
    const Eigen::VectorXd one_over = size.cwiseInverse();
    const Eigen::LLT<Eigen::MatrixXd> factor(one_over.asDiagonal() * products_ * one_over.asDiagonal());
    if (factor.info() != Eigen::Success) return std::nullopt;
    const Eigen::Index n = size.size();
    const Eigen::MatrixXd inverse =
        one_over.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(n, n)) * one_over.asDiagonal();
    Result result;
    result.value = inverse * along_;
    const double left = std::max(squares_ - along_.dot(result.value), 0.0);
    result.std = (inverse.diagonal() * (kRowsPerSample * left / rows_)).cwiseSqrt();
    return result;
  }

 private:
  Eigen::MatrixXd products_;
  Eigen::VectorXd along_;
  double squares_ = 0.0, rows_ = 0.0;
};

}  // namespace

HeldStep held_step(const PreparedData& prepared) {
  // In addition to the inertias: friction, an offset, and what a weight on the output would do, which looks like an
  // inertia where the motion is a sine.
  struct Fits {
    Fit all{6}, output{7};
  };
  std::vector<Fits> of_records(prepared.records.size());
  in_parallel(prepared.records.size(), [&](std::size_t i) {
    const Record& r = prepared.records[i];
    auto& [all, output] = of_records[i];
    if (!steps_with_effort(r)) return;
    const double sample_hz = 1.0 / r.sample_s;
    const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                          std::min(prepared.pipeline.row_cutoff_hz, 0.45 * sample_hz), sample_hz);
    const Signals others = {std::vector<double>(r.inputs.size(), 1.0),
                            along(r, [](const auto& in) { return std::sin(in.output_angle); }),
                            along(r, [](const auto& in) { return std::cos(in.output_angle); })};
    Signals motor = {along(r, [](const auto& in) { return in.acceleration; }),
                     along(r, [](const auto& in) { return in.velocity; }),
                     along(r, [](const auto& in) { return in.direction; })};
    Signals load = {along(r, [](const auto& in) { return in.output_acceleration; }),
                    along(r, [](const auto& in) { return in.output_velocity; }),
                    along(r, [](const auto& in) { return in.output_direction; })};
    for (const std::vector<double>& signal : others) {
      motor.push_back(signal);
      load.push_back(signal);
    }
    motor.push_back(r.effort.values());
    load.push_back(half_steps(r, prepared.constants.torque_constant));
    load.push_back(r.torque);
    for (std::size_t k = 0; k < r.load_torque.size(); ++k) load.back()[k] -= r.load_torque[k];
    all.add(r, filter, std::move(motor), Balance::motor);
    output.add(r, filter, std::move(load), Balance::load);
  });
  Fits together;
  for (const Fits& one : of_records) {
    together.all.add(one.all);
    together.output.add(one.output);
  }
  const auto motor = together.all.solve(), load = together.output.solve();
  if (!motor || !load) return {};
  const double inertia_of_all = motor->value[0], output_inertia = load->value[0];
  const bool known = inertia_of_all > kCertainErrors * motor->std[0] && output_inertia > kCertainErrors * load->std[0];
  if (!known) return {};
  const double per_step = output_inertia / (prepared.constants.gear_ratio * inertia_of_all);
  // The share of the half step that readings lack.
  const double lacking = -load->value[6] / per_step, doubt = load->std[6] / per_step;
  return {per_step, lacking - kCertainErrors * doubt > 0.5, lacking + kCertainErrors * doubt > 0.5};
}

void correct_zero_order_hold(Record& r, const catalogue::DriveConstants<double>& constants, double torque_per_step) {
  if (!steps_with_effort(r)) return;
  const std::vector<double> steps = half_steps(r, constants.torque_constant);
  for (std::size_t k = 0; k < steps.size(); ++k) r.torque[k] += torque_per_step * steps[k];
}

}  // namespace flexspline::estimation
