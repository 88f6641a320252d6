#include "host/selection/regressor_table.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "host/diagnosis/candidates.hpp"
#include "host/regression/pivoted_qr.hpp"
#include "host/regression/shapes.hpp"
#include "host/selection/presliding.hpp"
#include "host/signals/butterworth.hpp"

namespace flexspline::selection {
namespace {

using effects::Kind;
using effects::Phase;
using regression::BalanceData;
using regression::Prepared;
using regression::Record;
using regression::Slot;
using regression::Terms;

constexpr int kHighestOrder = 24;
constexpr std::size_t kGridPoints = 6;
// Placebo orders: none is within a fifth of a whole number or of a half.
constexpr double kPlacebos[] = {1.27, 2.73, 3.29, 4.71, 5.31, 6.73, 8.27, 9.71, 11.29, 13.73, 16.27, 19.71};
constexpr double kFewestCycles = 2.0;
constexpr int kCurveDegree = 3;

// E[sign v] of a velocity with normal noise: erf(v / (sqrt 2 sigma)).
std::vector<double> expected_sign(const Record& record) {
  std::vector<double> sign(record.inputs.size(), 0.0);
  const double width = std::numbers::sqrt2 * std::max(record.velocity_noise[0], 1e-12);
  for (std::size_t k = 0; k < sign.size(); ++k) sign[k] = std::erf(record.inputs.velocity_at(k) / width);
  return sign;
}

// Not proportional to the other, and not constant.
bool is_curved(const Eigen::VectorXd& column, const Eigen::VectorXd& other) {
  const Eigen::VectorXd rest = column - other * (column.dot(other) / std::max(other.squaredNorm(), 1e-300));
  const Eigen::VectorXd spread = column.array() - column.mean();
  return rest.squaredNorm() > 1e-6 * column.squaredNorm() && spread.squaredNorm() > 1e-6 * column.squaredNorm();
}

struct Builder {
  BalanceData& data;
  RegressorTable& table;
  std::vector<Eigen::VectorXd> columns;

  Eigen::Index add(Eigen::VectorXd column) {
    columns.push_back(std::move(column));
    return static_cast<Eigen::Index>(columns.size()) - 1;
  }
  // A signal of each record as a filtered column.
  template <class Value>
  Eigen::VectorXd at_rows(Value value) const {
    Eigen::VectorXd column(data.rows());
    for (const regression::RowRange& range : data.records()) {
      const Record& r = data.prepared().records[range.record];
      const auto& samples = r.rows[regression::index(data.balance())].samples;
      for (std::size_t k = 0; k < samples.size(); ++k)
        column[range.first + static_cast<Eigen::Index>(k)] = value(r, samples[k]);
    }
    return column;
  }
};

double quantile(std::vector<double> x, double share) {
  if (x.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(x.size() - 1));
  std::nth_element(x.begin(), x.begin() + at, x.end());
  return x[static_cast<std::size_t>(at)];
}

void add_runs(const BalanceData& data, RegressorTable& table) {
  for (const regression::RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    const auto& samples = r.rows[regression::index(data.balance())].samples;
    const double row_s = r.sample_s * static_cast<double>(r.decimation);
    Eigen::Index first = range.first;
    for (std::size_t k = 1; k <= samples.size(); ++k)
      if (k == samples.size() || samples[k] != samples[k - 1] + r.decimation) {
        const Eigen::Index last = range.first + static_cast<Eigen::Index>(k);
        if (last - first >= 16) table.runs.push_back({range.record, first, last, row_s});
        first = last;
      }
  }
}

// Slope in time of a column, along each run.
Eigen::VectorXd slope_of(const Eigen::VectorXd& column, const std::vector<Run>& runs) {
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(column.size());
  for (const Run& run : runs)
    for (Eigen::Index k = run.first; k < run.last; ++k) {
      const Eigen::Index a = std::max(run.first, k - 1), b = std::min(run.last - 1, k + 1);
      slope[k] = (column[b] - column[a]) / (static_cast<double>(b - a) * run.row_s);
    }
  return slope;
}

// First-order lag of a column, along each run.
Eigen::VectorXd lag_of(const Eigen::VectorXd& column, const std::vector<Run>& runs, double time_constant_s) {
  Eigen::VectorXd lag = column;
  for (const Run& run : runs) {
    const double share = 1.0 - std::exp(-run.row_s / time_constant_s);
    for (Eigen::Index k = run.first + 1; k < run.last; ++k) lag[k] = lag[k - 1] + share * (column[k] - lag[k - 1]);
  }
  return column - lag;
}

Term term_of(const catalogue::Entry& entry, std::optional<double> order) {
  Term term;
  term.entry = &entry;
  term.order = order;
  term.name = !entry.info->family.empty() ? std::string(entry.info->family)
              : order                     ? fmt::format("{}:{:g}", entry.name(), *order)
                                          : std::string(entry.name());
  return term;
}

}  // namespace

double highest_order_hz(const Prepared& prepared) {
  std::vector<double> speeds;
  for (const Record& r : prepared.records)
    for (std::size_t k = 0; k < r.inputs.size() && !r.inputs.velocity.empty(); k += r.decimation)
      speeds.push_back(std::abs(r.inputs.velocity_at(k)));
  const bool turns = prepared.rotary || prepared.constants.turn_angle_scale != 1.0;
  return turns ? kHighestOrder * quantile(speeds, 0.5) * prepared.constants.turn_angle_scale / (2.0 * std::numbers::pi)
               : 0.0;
}

RegressorTable make_regressor_table(const Prepared& original, Balance balance, const Terms& terms,
                                    Presliding presliding, double highest_law_hz, const SelectionPolicy& policy) {
  Prepared prepared = original;
  for (Record& r : prepared.records)
    r.inputs.directions[0] = presliding ? presliding_state(r, *presliding) : expected_sign(r);
  BalanceData data(prepared, balance);
  RegressorTable table;
  table.records = prepared.records.size();
  for (const Record& r : prepared.records) table.held_out.push_back(r.experiment->role == data::Role::holdout ? 1 : 0);
  table.highest_hz = prepared.pipeline.row_cutoff_hz;
  table.highest_law_hz = highest_law_hz;
  add_runs(data, table);
  Builder builder{data, table, {}};

  const auto on_balance = regression::terms_on(terms, balance, prepared.torque_measured);
  const std::vector<Slot> linear = regression::free_linear_slots(terms, on_balance);
  const std::vector<Slot> shapes = regression::free_shape_slots(terms, on_balance);
  table.target = data.target() - data.known_torque(terms, on_balance);
  if (linear.empty() || data.rows() == 0) return table;
  const Eigen::MatrixXd base = data.columns(terms, linear);
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const regression::Term& t = terms[linear[j].term];
    const auto& info = t.entry->parameters[linear[j].parameter];
    builder.add(base.col(static_cast<Eigen::Index>(j)));
    table.model_names.push_back(fmt::format("{}.{}", t.id, info.name));
    table.model_low.push_back(info.low);
  }
  if (!shapes.empty()) {
    const Eigen::MatrixXd slopes = data.shape_columns(terms, on_balance, shapes);
    for (std::size_t j = 0; j < shapes.size(); ++j) {
      builder.add(slopes.col(static_cast<Eigen::Index>(j)));
      table.model_names.push_back(fmt::format("slope by {}", terms[shapes[j].term].id));
      table.model_low.push_back(-effects::kUnbounded);
    }
  }

  // What the model makes of the effort: terms that read the current are built from that, never from the measured one,
  // whose noise stands in the target.
  const Eigen::VectorXd fitted = base * regression::PivotedQr(base).solve(table.target);
  const Eigen::VectorXd through_gear = prepared.torque_measured ? builder.at_rows([&](const Record& r, std::size_t k) {
    return r.inputs.torque_at(k) / prepared.constants.gear_ratio;
  })
                                                                : Eigen::VectorXd::Zero(data.rows());
  const Eigen::VectorXd effort = fitted + through_gear;
  // A lag between the columns is a nuisance of every model.
  builder.add(slope_of(effort, table.runs));
  table.model_names.push_back("time lag");
  table.model_low.push_back(-effects::kUnbounded);
  table.model_columns = static_cast<Eigen::Index>(builder.columns.size());

  const auto from_model_current = [&](const catalogue::Entry& entry, std::size_t parameter) {
    std::vector<effects::Inputs<catalogue::Real>> in(static_cast<std::size_t>(effort.size()));
    for (std::size_t k = 0; k < in.size(); ++k)
      in[k].current = effort[static_cast<Eigen::Index>(k)] / prepared.constants.torque_constant;
    std::vector<double> unit(entry.parameters.size(), 0.0);
    unit[parameter] = 1.0;
    Eigen::VectorXd column = Eigen::VectorXd::Zero(effort.size());
    entry.real.torque(unit.data(), prepared.constants, balance, in, column.data());
    return column;
  };

  // Cycles and frequencies of an order.
  double travel = 0.0;
  std::vector<double> speeds;
  for (const Record& r : prepared.records)
    for (std::size_t k = 1; k < r.inputs.size() && !r.inputs.angle.empty(); ++k) {
      travel += std::abs(r.inputs.angle_at(k) - r.inputs.angle_at(k - 1));
      if (k % r.decimation == 0) speeds.push_back(std::abs(r.inputs.velocity_at(k)));
    }
  const double turn = 2.0 * std::numbers::pi / prepared.constants.turn_angle_scale;
  const double typical_speed = quantile(speeds, 0.5);
  const double top_speed = quantile(speeds, 0.95);

  // Effects of the catalogue.
  const bool collapsed = !prepared.torque_measured && balance == Balance::motor;
  for (const catalogue::Entry& entry : catalogue::all()) {
    const effects::Description& info = *entry.info;
    if (entry.told_by() != balance && !(collapsed && info.balance == Balance::load)) continue;
    if (info.phase == Phase::shift || entry.has_state || entry.definition) continue;  // states: see presliding
    if (!diagnosis::may_be_seen(data, terms, entry)) continue;
    const bool ordered = entry.count(Kind::given) > 0;
    std::vector<std::optional<double>> orders{std::nullopt};
    if (ordered) {
      orders.clear();
      for (int k = 1; k <= kHighestOrder; ++k)
        if (travel * k / turn >= kFewestCycles) orders.emplace_back(k);
      for (const double order : kPlacebos)
        if (travel * order / turn >= kFewestCycles) orders.emplace_back(order);
    }
    for (const std::optional<double>& order : orders) {
      Terms extended;
      try {
        extended = diagnosis::extend(terms, entry, order);
      } catch (const model::ModelError&) {
        continue;
      }
      regression::Term& added = extended.back();
      const std::size_t at = extended.size() - 1;
      const double highest_hz = order ? *order * typical_speed / turn : 0.0;
      if (info.phase == Phase::modulate) {
        Term term = term_of(entry, order);
        const auto on = regression::terms_on(extended, balance, prepared.torque_measured);
        for (std::size_t p = 0; p < added.values.size(); ++p)
          if (added.free_shape(p)) {
            term.columns.push_back(builder.add(data.shape_column(extended, on, {at, p})));
            term.low.push_back(entry.parameters[p].low);
          }
        term.values = added.values;
        table.terms.push_back(std::move(term));
        continue;
      }
      if (info.reads & effects::kCurrent && entry.count(Kind::linear) == 0) continue;  // delay, saturation: below
      std::vector<std::size_t> free_shapes;
      for (std::size_t p = 0; p < added.values.size(); ++p)
        if (added.free_shape(p)) free_shapes.push_back(p);
      std::vector<double> grid{0.0};
      if (free_shapes.size() == 1)
        grid = regression::shape_grid(regression::shape_range(data, added, free_shapes[0]), kGridPoints);
      else if (free_shapes.size() > 1)
        continue;
      for (const double value : grid) {
        if (!free_shapes.empty()) added.values[free_shapes[0]] = value;
        Term term = term_of(entry, order);
        term.nonlinear = free_shapes.size();
        term.values = added.values;
        term.highest_hz = highest_hz;
        // No drive has such an order: it competes, and is never named.
        term.is_placebo = order && *order != std::round(*order);
        if (term.is_placebo) {
          term.entry = nullptr;
          term.name = "placebo " + term.name;
        }
        bool corrects_effort = false;
        term.sum_is_positive = info.replaces.empty() && term.nonlinear > 0 && entry.count(Kind::linear) == 2;
        std::vector<Slot> slots;
        for (std::size_t p = 0; p < added.values.size(); ++p)
          if (added.free_linear(p)) slots.push_back({at, p});
        const Eigen::MatrixXd own = data.columns(extended, slots);
        for (std::size_t j = 0; j < slots.size(); ++j) {
          Eigen::VectorXd column = own.col(static_cast<Eigen::Index>(j));
          if ((info.reads & effects::kCurrent) != 0 && !entry.has_state) {
            column = from_model_current(entry, slots[j].parameter);
            corrects_effort = info.reads == effects::kCurrent && is_curved(column, effort);
          }
          term.columns.push_back(builder.add(std::move(column)));
          term.low.push_back(entry.parameters[slots[j].parameter].low);
        }
        if (term.columns.empty()) continue;
        if (corrects_effort) {
          const Eigen::VectorXd& column = builder.columns[static_cast<std::size_t>(term.columns.front())];
          std::vector<double> efforts, ratios;
          for (Eigen::Index k = 0; k < effort.size(); ++k) efforts.push_back(std::abs(effort[k]));
          const double peak = quantile(efforts, 0.99);
          if (peak < policy.least_effort_range * quantile(efforts, 0.5)) {
            table.not_visible.push_back(&entry);
            continue;
          }
          for (Eigen::Index k = 0; k < effort.size(); ++k)
            if (std::abs(effort[k]) >= peak) ratios.push_back(std::abs(column[k] / effort[k]));
          term.most_at_peak = policy.most_of_effort / std::max(quantile(ratios, 0.5), 1e-300);
        }
        table.terms.push_back(std::move(term));
      }
    }
  }

  // Placebo orders and curves that are in no catalogue compete, and are never named.
  const auto filter_runs = [&](Eigen::VectorXd& column) {
    for (const Run& run : table.runs) {
      const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                            std::min(table.highest_hz, 0.45 / run.row_s), 1.0 / run.row_s);
      filter.apply_in_place(
          std::span<double>(column.data() + run.first, static_cast<std::size_t>(run.last - run.first)));
    }
  };
  const auto generic = [&](std::string name, std::vector<Eigen::VectorXd> columns, double highest_hz = 0.0) {
    Term term;
    term.name = std::move(name);
    term.highest_hz = highest_hz;
    for (Eigen::VectorXd& column : columns) {
      filter_runs(column);
      term.columns.push_back(builder.add(std::move(column)));
      term.low.push_back(-effects::kUnbounded);
    }
    table.terms.push_back(std::move(term));
  };
  const auto direction = [](const Record& r, std::size_t k) { return r.inputs.directions[0][k]; };
  const double knot_1 = 0.1 * top_speed, knot_2 = 0.3 * top_speed;
  generic("friction curve over speed", {builder.at_rows([&](const Record& r, std::size_t k) {
                                          return direction(r, k) * std::min(std::abs(r.inputs.velocity_at(k)), knot_1);
                                        }),
                                        builder.at_rows([&](const Record& r, std::size_t k) {
                                          return direction(r, k) * std::min(std::abs(r.inputs.velocity_at(k)), knot_2);
                                        })});
  double low_angle = 1e300, high_angle = -1e300;
  for (const Record& r : prepared.records)
    for (std::size_t k = 0; k < r.inputs.size(); k += r.decimation) {
      low_angle = std::min(low_angle, r.inputs.output_angle_at(k));
      high_angle = std::max(high_angle, r.inputs.output_angle_at(k));
    }
  const double span = high_angle - low_angle, middle = 0.5 * (high_angle + low_angle);
  if (span > 0.0) {
    const auto along = [&](const Record& r, std::size_t k) {
      return 2.0 * (r.inputs.output_angle_at(k) - middle) / span;
    };
    // Chebyshev polynomials, which are well conditioned.
    const auto chebyshev = [&](int degree, bool friction) {
      return builder.at_rows([&](const Record& r, std::size_t k) {
        const double x = std::clamp(along(r, k), -1.0, 1.0);
        return std::cos(degree * std::acos(x)) * (friction ? direction(r, k) : 1.0);
      });
    };
    for (const bool friction : {false, true}) {
      std::vector<Eigen::VectorXd> curve;
      for (int degree = 1; degree <= kCurveDegree; ++degree) curve.push_back(chebyshev(degree, friction));
      generic(fmt::format("{} over the output angle", friction ? "friction" : "torque"), std::move(curve));
    }
  }
  generic("creep", {lag_of(effort, table.runs, 0.1), lag_of(effort, table.runs, 1.0)});
  // Friction that falls after each reversal.
  const auto since_reversal = [&](double time_constant_s) {
    Eigen::VectorXd column(data.rows());
    for (const regression::RowRange& range : data.records()) {
      const Record& r = prepared.records[range.record];
      const auto& samples = r.rows[regression::index(balance)].samples;
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
            direction(r, samples[row]) * std::exp(-t / time_constant_s);
      }
    }
    return column;
  };
  generic("friction after a reversal", {since_reversal(0.3), since_reversal(1.5)});
  generic("drift over time",
          {builder.at_rows(
               [&](const Record& r, std::size_t k) { return direction(r, k) * static_cast<double>(k) * r.sample_s; }),
           builder.at_rows([&](const Record& r, std::size_t k) { return static_cast<double>(k) * r.sample_s; })});

  // Relative changes of viscous and of dry friction, in common and by direction.
  const auto friction_of = [&](std::string_view surface) {
    double sum = 0.0;
    for (const std::size_t t : on_balance)
      if (terms[t].entry->info->surface == surface && terms[t].entry->info->balance == Balance::motor)
        for (std::size_t p = 0; p < terms[t].values.size(); ++p)
          if (terms[t].entry->parameters[p].kind == Kind::linear && terms[t].entry->parameters[p].low == 0.0) {
            sum += terms[t].values[p];
            break;
          }
    return sum;
  };
  const auto difference = [&](double size, auto value) {
    if (size == 0.0) return;
    Eigen::VectorXd column = builder.at_rows([&](const Record& r, std::size_t k) { return size * value(r, k); });
    filter_runs(column);
    table.differences.push_back(builder.add(std::move(column)));
  };
  if (balance == Balance::motor) {
    const double viscous = friction_of("viscous friction"), dry = friction_of("dry friction");
    difference(viscous, [](const Record& r, std::size_t k) { return r.inputs.velocity_at(k); });
    difference(viscous, [](const Record& r, std::size_t k) { return std::abs(r.inputs.velocity_at(k)); });
    difference(dry, [&](const Record& r, std::size_t k) { return direction(r, k); });
    difference(dry, [&](const Record& r, std::size_t k) { return direction(r, k) * direction(r, k); });
  }

  // Row signals for masks.
  table.velocity_over_noise = builder.at_rows([&](const Record& r, std::size_t k) {
    return r.at_rest ? effects::kUnbounded
                     : r.direction_variable(balance, k) / std::max(r.velocity_noise[regression::index(balance)], 1e-12);
  });
  for (const Run& run : table.runs) {
    double sign = 0.0;
    for (Eigen::Index k = run.first; k < run.last; ++k) {
      const double v = table.velocity_over_noise[k];
      if (std::abs(v) < 3.0 || std::isinf(v)) continue;
      if (v * sign < 0.0) table.reversals += 1.0;
      sign = v;
    }
  }
  table.columns.resize(data.rows(), static_cast<Eigen::Index>(builder.columns.size()));
  table.scale.resize(table.columns.cols());
  for (Eigen::Index j = 0; j < table.columns.cols(); ++j) {
    const Eigen::VectorXd& column = builder.columns[static_cast<std::size_t>(j)];
    const double size = column.norm() / std::sqrt(std::max<double>(1.0, static_cast<double>(column.size())));
    table.scale[j] = size > 0.0 && std::isfinite(size) ? size : 1.0;
    table.columns.col(j) = column / table.scale[j];
  }
  for (Term& term : table.terms)
    if (term.most_at_peak > 0.0) term.most_at_peak *= table.scale[term.columns.front()];
  return table;
}

}  // namespace flexspline::selection
