// Curves of a regressor table that are in no catalogue.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/table_builder.hpp"

namespace flexspline::selection {
namespace {

constexpr int kCurveDegree = 3, kHarmonics = 5;

// Columns side by side.
Eigen::MatrixXd together(const std::vector<Eigen::VectorXd>& columns) {
  Eigen::MatrixXd all(columns.front().size(), std::ssize(columns));
  for (std::size_t j = 0; j < columns.size(); ++j) all.col(static_cast<Eigen::Index>(j)) = columns[j];
  return all;
}

using Curve = std::function<std::vector<Eigen::VectorXd>(const DirectedData&)>;

void add_generic(TableBuilder& builder, std::string name, bool reads_direction, const Curve& curve) {
  CandidateTerm term;
  term.name = std::move(name);
  term.columns = builder.add(builder.directed_columns(
      [&](const DirectedData& d) { return builder.filtered(together(curve(d))); }, reads_direction));
  term.low.assign(term.columns.size(), -effects::kUnbounded);
  builder.table.terms.push_back(std::move(term));
}

// Friction with kinks at two speeds.
void add_friction_curve(TableBuilder& builder, double top_speed) {
  const auto kinked_at = [](const DirectedData& d, double knot) {
    return d.at_rows([knot](const estimation::Record& r, std::size_t k) {
      return DirectedData::direction(r, k) * std::min(std::abs(r.inputs.velocity_at(k)), knot);
    });
  };
  add_generic(builder, "friction curve over speed", true, [&](const DirectedData& d) {
    return std::vector{kinked_at(d, 0.1 * top_speed), kinked_at(d, 0.3 * top_speed)};
  });
}

// Torque and friction over the output angle: Chebyshev polynomials, which are well conditioned.
void add_angle_curves(TableBuilder& builder) {
  double low_angle = 1e300, high_angle = -1e300;
  for (const estimation::Record& r : builder.sign.prepared.records)
    for (std::size_t k = 0; k < r.inputs.size(); k += r.decimation) {
      low_angle = std::min(low_angle, r.inputs.output_angle_at(k));
      high_angle = std::max(high_angle, r.inputs.output_angle_at(k));
    }
  const double span = high_angle - low_angle, middle = 0.5 * (high_angle + low_angle);
  if (!(span > 0.0)) return;
  const auto chebyshev = [&](const DirectedData& d, int degree, bool friction) {
    return d.at_rows([&](const estimation::Record& r, std::size_t k) {
      const double x = std::clamp(2.0 * (r.inputs.output_angle_at(k) - middle) / span, -1.0, 1.0);
      return std::cos(degree * std::acos(x)) * (friction ? DirectedData::direction(r, k) : 1.0);
    });
  };
  for (const bool friction : {false, true})
    add_generic(builder,
                fmt::format("{} over the output {}", friction ? "friction" : "torque",
                            builder.sign.prepared.rotary ? "angle" : "position"),
                friction, [&](const DirectedData& d) {
                  std::vector<Eigen::VectorXd> curve;
                  for (int degree = 1; degree <= kCurveDegree; ++degree)
                    curve.push_back(chebyshev(d, degree, friction));
                  return curve;
                });
}

// Friction over a turn of the motor, as a Fourier series: a tooth that is damaged, say, which no single order
// describes.
void add_friction_over_turn(TableBuilder& builder, const Motion& motion) {
  // In one direction it is a ripple of torque.
  if (motion.travel < builder.policy.fewest_cycles * motion.turn || !moves_both_ways(builder.sign.data)) return;
  const auto wave = [&](const DirectedData& d, int order, double phase) {
    return d.at_rows([&](const estimation::Record& r, std::size_t k) {
      return DirectedData::direction(r, k) *
             std::cos(2.0 * std::numbers::pi * order * r.inputs.angle_at(k) / motion.turn - phase);
    });
  };
  add_generic(builder, "friction over the motor angle", true, [&](const DirectedData& d) {
    std::vector<Eigen::VectorXd> series;
    for (int order = 1; order <= kHarmonics; ++order)
      for (const double phase : {0.0, 0.5 * std::numbers::pi}) series.push_back(wave(d, order, phase));
    return series;
  });
}

// A column less its first-order lag, along each run.
Eigen::VectorXd lag_of(const Eigen::VectorXd& column, const std::vector<Run>& runs, double time_constant_s) {
  Eigen::VectorXd lag = column;
  for (const Run& run : runs) {
    const double share = 1.0 - std::exp(-run.row_s / time_constant_s);
    for (Eigen::Index k = run.first + 1; k < run.last; ++k) lag[k] = lag[k - 1] + share * (column[k] - lag[k - 1]);
  }
  return column - lag;
}

// Friction that falls after each reversal.
Eigen::VectorXd since_reversal(const DirectedData& directed, double time_constant_s) {
  const estimation::RegressionProblem& data = directed.data;
  Eigen::VectorXd column(data.rows());
  for (const estimation::RowRange& range : data.records()) {
    const estimation::Record& r = directed.prepared.records[range.record];
    const auto& samples = r.rows[estimation::index(data.balance())].samples;
    double sign = 0.0;
    std::size_t since = 0, k = 0;
    for (std::size_t row = 0; row < samples.size(); ++row) {
      for (; k <= samples[row]; ++k) {
        const double v = r.inputs.velocity_at(k);
        if (v * sign > 0.0 || std::abs(v) < 3.0 * r.velocity_noise[0]) continue;
        sign = v > 0.0 ? 1.0 : -1.0;
        since = k;
      }
      const double t = static_cast<double>(samples[row] - since) * r.sample_s;
      column[range.first + static_cast<Eigen::Index>(row)] =
          DirectedData::direction(r, samples[row]) * std::exp(-t / time_constant_s);
    }
  }
  return column;
}

}  // namespace

void add_generic_curves(TableBuilder& builder, const Motion& motion) {
  add_friction_curve(builder, motion.top_speed);
  add_angle_curves(builder);
  add_friction_over_turn(builder, motion);
  const std::vector<Run>& runs = builder.table.runs;
  add_generic(builder, "creep", true, [&](const DirectedData& d) {
    return std::vector{lag_of(d.effort, runs, 0.1), lag_of(d.effort, runs, 1.0)};
  });
  add_generic(builder, "friction after a reversal", true, [](const DirectedData& d) {
    return std::vector{since_reversal(d, 0.3), since_reversal(d, 1.5)};
  });
  const auto time_of = [](const estimation::Record& r, std::size_t k) { return static_cast<double>(k) * r.sample_s; };
  add_generic(builder, "drift over time", true, [&](const DirectedData& d) {
    return std::vector{d.at_rows([&](const estimation::Record& r, std::size_t k) {
                         return DirectedData::direction(r, k) * time_of(r, k);
                       }),
                       d.at_rows(time_of)};
  });
}

}  // namespace flexspline::selection
