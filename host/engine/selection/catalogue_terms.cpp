// Terms of a regressor table: the effects of the catalogue that the model lacks, and placebo orders.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/table_builder.hpp"

namespace flexspline::selection {
namespace {

using effects::Kind;
using effects::Phase;
using estimation::ParameterRef;
using estimation::Terms;

// Placebo orders: none is within a fifth of a whole number or of a half.
constexpr double kPlacebos[] = {1.27, 2.73, 3.29, 4.71, 5.31, 6.73, 8.27, 9.71, 11.29, 13.73, 16.27, 19.71};
constexpr double kFewestCycles = 2.0;

// An effect with the model that has it, last.
struct Extension {
  const catalogue::Entry& entry;
  std::optional<double> order;
  Terms terms;
  double highest_hz = 0.0;  // of its order
  std::size_t added() const { return terms.size() - 1; }
};

// Not proportional to the other, and not constant.
bool is_curved(const Eigen::VectorXd& column, const Eigen::VectorXd& other) {
  const Eigen::VectorXd rest = column - other * (column.dot(other) / std::max(other.squaredNorm(), 1e-300));
  const Eigen::VectorXd spread = column.array() - column.mean();
  return rest.squaredNorm() > 1e-6 * column.squaredNorm() && spread.squaredNorm() > 1e-6 * column.squaredNorm();
}

CandidateTerm term_of(const catalogue::Entry& entry, std::optional<double> order) {
  CandidateTerm term;
  term.entry = &entry;
  term.order = order;
  term.name = !entry.info->family.empty() ? std::string(entry.info->family)
              : order                     ? fmt::format("{}:{:g}", entry.name(), *order)
                                          : std::string(entry.name());
  return term;
}

// Orders of which the data hold whole cycles; nothing where the effect has none.
std::vector<std::optional<double>> orders_of(const catalogue::Entry& entry, const model::Drive& drive,
                                             const Motion& motion) {
  if (entry.count(Kind::given) == 0) return {std::nullopt};
  std::vector<std::optional<double>> orders;
  for (const double order : possible_orders(entry, drive))
    if (motion.travel * order / motion.turn >= kFewestCycles) orders.emplace_back(order);
  for (const double order : kPlacebos)
    if (motion.travel * order / motion.turn >= kFewestCycles) orders.emplace_back(order);
  return orders;
}

// The column of a parameter over the current that the model's effort is.
Eigen::VectorXd from_model_current(const TableBuilder& builder, const catalogue::Entry& entry, std::size_t parameter) {
  const auto& constants = builder.prepared().constants;
  const Eigen::VectorXd& effort = builder.effort;
  std::vector<effects::Inputs<catalogue::Real>> in(static_cast<std::size_t>(effort.size()));
  for (std::size_t k = 0; k < in.size(); ++k)
    in[k].current = effort[static_cast<Eigen::Index>(k)] / constants.torque_constant;
  std::vector<double> unit(entry.parameters.size(), 0.0);
  unit[parameter] = 1.0;
  Eigen::VectorXd column = Eigen::VectorXd::Zero(effort.size());
  entry.real.torque(unit.data(), constants, builder.data.balance(), in, column.data());
  return column;
}

// What scales another effect: slopes by its nonlinear parameters.
void add_modulation(TableBuilder& builder, const Extension& e) {
  CandidateTerm term = term_of(e.entry, e.order);
  const estimation::Term& added = e.terms.back();
  const auto on = estimation::terms_on(e.terms, builder.data.balance(), builder.prepared().output_signals);
  for (std::size_t p = 0; p < added.values.size(); ++p)
    if (added.free_nonlinear(p)) {
      term.columns.push_back(builder.add(builder.data.nonlinear_column(e.terms, on, {e.added(), p})));
      term.low.push_back(e.entry.parameters[p].low);
    }
  term.values = added.values;
  builder.table.terms.push_back(std::move(term));
}

// Bounds the coefficient of a term that corrects the effort by what is plausible at its peaks; false where the effort
// has no peaks that would show it.
bool bound_at_peaks(const TableBuilder& builder, CandidateTerm& term) {
  const Eigen::VectorXd& effort = builder.effort;
  const Eigen::VectorXd& column = builder.columns[static_cast<std::size_t>(term.columns.front())];
  std::vector<double> efforts, ratios;
  for (Eigen::Index k = 0; k < effort.size(); ++k) efforts.push_back(std::abs(effort[k]));
  const double peak = quantile(efforts, 0.99);
  if (peak < builder.policy.least_effort_range * quantile(efforts, 0.5)) return false;
  for (Eigen::Index k = 0; k < effort.size(); ++k)
    if (std::abs(effort[k]) >= peak) ratios.push_back(std::abs(column[k] / effort[k]));
  term.most_at_peak = builder.policy.most_of_effort / std::max(quantile(ratios, 0.5), 1e-300);
  return true;
}

// A term at the values that its nonlinear parameters have.
void add_source(TableBuilder& builder, const Extension& e, std::size_t nonlinear) {
  const effects::Description& info = *e.entry.info;
  const estimation::Term& added = e.terms.back();
  CandidateTerm term = term_of(e.entry, e.order);
  term.nonlinear = nonlinear;
  term.values = added.values;
  term.highest_hz = e.highest_hz;
  // No drive has such an order. It competes with the others and is never named.
  term.is_placebo = e.order && *e.order != std::round(*e.order);
  if (term.is_placebo) {
    term.entry = nullptr;
    term.name = "placebo " + term.name;
  }
  term.sum_is_positive = info.replaces.empty() && nonlinear > 0 && e.entry.count(Kind::linear) == 2;
  std::vector<ParameterRef> refs;
  for (std::size_t p = 0; p < added.values.size(); ++p)
    if (added.free_linear(p)) refs.push_back({e.added(), p});
  bool corrects_effort = false;
  const Eigen::MatrixXd own = builder.data.columns(e.terms, refs);
  for (std::size_t j = 0; j < refs.size(); ++j) {
    Eigen::VectorXd column = own.col(static_cast<Eigen::Index>(j));
    if ((info.reads & effects::kCurrent) != 0 && !e.entry.has_state) {
      column = from_model_current(builder, e.entry, refs[j].parameter);
      corrects_effort = info.reads == effects::kCurrent && is_curved(column, builder.effort);
    }
    term.columns.push_back(builder.add(std::move(column)));
    term.low.push_back(e.entry.parameters[refs[j].parameter].low);
    term.high.push_back(e.entry.parameters[refs[j].parameter].high);
  }
  if (term.columns.empty()) return;
  if (corrects_effort && !bound_at_peaks(builder, term)) {
    builder.table.not_visible.push_back(&e.entry);
    return;
  }
  builder.table.terms.push_back(std::move(term));
}

void add_effect(TableBuilder& builder, Extension e) {
  if (e.entry.info->phase == Phase::modulate) return add_modulation(builder, e);
  if (e.entry.info->reads & effects::kCurrent && e.entry.count(Kind::linear) == 0) return;  // delay, saturation
  estimation::Term& added = e.terms.back();
  std::vector<std::size_t> free_nonlinear;
  for (std::size_t p = 0; p < added.values.size(); ++p)
    if (added.free_nonlinear(p)) free_nonlinear.push_back(p);
  if (free_nonlinear.size() > 1) return;
  if (free_nonlinear.empty()) return add_source(builder, e, 0);
  const estimation::ParameterRange range = estimation::parameter_range(builder.data, added, free_nonlinear[0]);
  for (const double value : estimation::parameter_grid(range, kGridPoints)) {
    added.values[free_nonlinear[0]] = value;
    add_source(builder, e, 1);
  }
}

}  // namespace

void add_catalogue_terms(TableBuilder& builder, const Motion& motion) {
  const Balance balance = builder.data.balance();
  const bool collapsed = !builder.prepared().output_signals.torque && balance == Balance::motor;
  for (const catalogue::Entry& entry : catalogue::all()) {
    const effects::Description& info = *entry.info;
    if (entry.identified_on() != balance && !(collapsed && info.balance == Balance::load)) continue;
    if (info.phase == Phase::shift || entry.has_state || entry.definition) continue;  // states: see presliding
    // Where several effects are missing, the phases of waves among them leave such a wave.
    if (!info.phase_error_of.empty()) continue;
    if (!may_be_seen(builder.data, builder.terms, entry)) continue;
    for (const std::optional<double>& order : orders_of(entry, builder.prepared().drive, motion)) {
      Extension e{entry, order, {}, order ? *order * motion.typical_speed / motion.turn : 0.0};
      try {
        e.terms = extend(builder.terms, entry, order);
      } catch (const model::ModelError&) {
        continue;
      }
      add_effect(builder, std::move(e));
    }
  }
}

}  // namespace flexspline::selection
