// Terms of a regressor table: the effects of the catalogue that the model lacks, and placebo orders.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "host/common/algebra/decompositions.hpp"
#include "host/common/numbers/quantile.hpp"
#include "host/common/signals/butterworth.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/table_builder.hpp"

namespace flexspline::selection {
namespace {

using effects::Kind;
using effects::Phase;
using estimation::ParameterRef;
using estimation::RegressionProblem;
using estimation::Terms;

// An effect at one value of its nonlinear parameters, with the model that has it, last.
struct Extension {
  const catalogue::Entry& entry;
  std::optional<double> order;
  Terms terms;
  double highest_hz = 0.0;    // of its order
  bool is_placebo = false;    // no drive has such an order: it competes with the others and is never named
  std::size_t nonlinear = 0;  // parameters that are searched over
  std::size_t searched = 0;   // place of that parameter, where there is one, and its range
  estimation::ParameterRange range = {};

  const estimation::Term& added() const { return terms.back(); }
  bool modulates() const { return entry.info->phase == Phase::modulate; }
  bool is_of_effort() const { return (entry.info->reads & effects::kCurrent) != 0 && !entry.has_state; }
  bool reads_direction() const {
    return modulates() || is_of_effort() || (entry.info->reads & effects::kDirection) != 0;
  }
  // Parameters that its columns belong to: those of what scales another effect are nonlinear.
  std::vector<ParameterRef> parameters() const {
    std::vector<ParameterRef> refs;
    for (std::size_t p = 0; p < added().values.size(); ++p)
      if (modulates() ? added().free_nonlinear(p) : added().free_linear(p)) refs.push_back({terms.size() - 1, p});
    return refs;
  }
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

struct TriedOrder {
  std::optional<double> order;
  bool is_placebo = false;
};

// Orders of which the data hold whole cycles, and placebos; one without a value where the effect has none. Those of the
// output's turn have placebos of their own.
std::vector<TriedOrder> orders_of(const catalogue::Entry& entry, const estimation::PreparedData& prepared,
                                  const Motion& motion, const SelectionPolicy& policy) {
  if (entry.count(Kind::given) == 0) return {{}};
  std::vector<TriedOrder> orders;
  const auto add_visible = [&](double order, bool is_placebo) {
    if (motion.travel * order / motion.turn >= policy.fewest_cycles) orders.push_back({order, is_placebo});
  };
  const std::vector<double> possible = possible_orders(entry, prepared);
  for (const double order : possible) add_visible(order, false);
  for (const double order : policy.placebo_orders_resampled) add_visible(order, true);
  if (!possible.empty() && possible.front() < 1.0)
    for (const double factor : policy.placebos_of_output_turn) add_visible(factor * possible.front(), true);
  return orders;
}

// Columns of parameters over the current that the model's effort is.
Eigen::MatrixXd from_model_current(const DirectedData& from, const catalogue::Entry& entry,
                                   const std::vector<ParameterRef>& parameters) {
  const auto& constants = from.prepared.constants;
  std::vector<effects::Inputs<catalogue::Real>> in(static_cast<std::size_t>(from.effort.size()));
  for (std::size_t k = 0; k < in.size(); ++k)
    in[k].current = from.effort[static_cast<Eigen::Index>(k)] / constants.torque_constant;
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(from.effort.size(), std::ssize(parameters));
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    std::vector<double> unit(entry.parameters.size(), 0.0);
    unit[parameters[j].parameter] = 1.0;
    entry.real.torque(unit.data(), constants, from.data.balance(), in,
                      columns.col(static_cast<Eigen::Index>(j)).data());
  }
  return columns;
}

// Extensions [first, last) whose columns are made together: sources of torque that read what is measured do not change
// each other's columns, and read the signals once.
struct Group {
  std::size_t first = 0, last = 0;
};

std::vector<Group> groups_of(const std::vector<Extension>& extensions) {
  constexpr std::size_t kTogether = 8;  // columns: as many as are filtered at once
  std::vector<Group> groups;
  std::size_t columns = kTogether;
  for (std::size_t i = 0; i < extensions.size(); ++i) {
    const Extension& e = extensions[i];
    const bool alone = e.entry.info->phase != Phase::source || e.is_of_effort();
    const std::size_t own = e.parameters().size();
    if (alone || groups.empty() || columns + own > kTogether) {
      groups.push_back({i, i});
      columns = 0;
    }
    groups.back().last = i + 1;
    columns = alone ? kTogether : columns + own;
  }
  return groups;
}

// One block of columns for each of some sources of torque, from what `make` gives for all their parameters.
template <class Make>
std::vector<Eigen::MatrixXd> made_together(std::span<const Extension> group, const Make& make) {
  Terms terms = group.front().terms;
  std::vector<ParameterRef> refs;
  for (std::size_t i = 0; i < group.size(); ++i) {
    if (i > 0) terms.push_back(group[i].added());
    for (const ParameterRef& ref : group[i].parameters()) refs.push_back({terms.size() - 1, ref.parameter});
  }
  const Eigen::MatrixXd all = make(terms, refs);
  std::vector<Eigen::MatrixXd> made;
  Eigen::Index at = 0;
  for (const Extension& one : group) {
    made.emplace_back(all.middleCols(at, std::ssize(one.parameters())));
    at += made.back().cols();
  }
  return made;
}

// One block of columns for each extension of a group.
std::vector<Eigen::MatrixXd> columns_of(std::span<const Extension> group, const DirectedData& from) {
  const Extension& e = group.front();
  if (e.modulates()) {
    const auto on = estimation::terms_on(e.terms, from.data.balance(), from.prepared.output_signals);
    return {from.data.nonlinear_columns(e.terms, on, e.parameters())};
  }
  if (e.is_of_effort()) return {from_model_current(from, e.entry, e.parameters())};
  return made_together(group, [&](const Terms& terms, const std::vector<ParameterRef>& refs) {
    return from.data.evaluator().unit_columns(terms, refs);
  });
}

// The columns of extensions, made on all cores.
std::vector<Eigen::MatrixXd> columns_of_all(const std::vector<Extension>& extensions, const DirectedData& from) {
  std::vector<Eigen::MatrixXd> made(extensions.size());
  const std::vector<Group> groups = groups_of(extensions);
  estimation::in_parallel(groups.size(), [&](std::size_t g) {
    const auto& [first, last] = groups[g];
    std::vector<Eigen::MatrixXd> own = columns_of(std::span(extensions).subspan(first, last - first), from);
    std::move(own.begin(), own.end(), made.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return made;
}

// The largest coefficient that is plausible at the peaks of the effort, of a column that corrects it; nothing where the
// effort has no peaks that would show it.
std::optional<double> most_at_peaks(const TableBuilder& builder, const Eigen::VectorXd& column) {
  const Eigen::VectorXd& effort = builder.sign.effort;
  std::vector<double> efforts, ratios;
  for (Eigen::Index k = 0; k < effort.size(); ++k) efforts.push_back(std::abs(effort[k]));
  const double peak = numbers::quantile(efforts, 0.99);
  if (peak < builder.policy.least_effort_range * numbers::quantile(efforts, 0.5)) return std::nullopt;
  for (Eigen::Index k = 0; k < effort.size(); ++k)
    if (std::abs(effort[k]) >= peak) ratios.push_back(std::abs(column[k] / effort[k]));
  return builder.policy.most_of_effort / std::max(numbers::quantile(ratios, 0.5), 1e-300);
}

void add_term(TableBuilder& builder, const Extension& e, TableBuilder::DirectedColumns columns) {
  const effects::Description& info = *e.entry.info;
  CandidateTerm term = term_of(e.entry, e.order);
  term.nonlinear = e.nonlinear;
  term.values = e.added().values;
  term.highest_hz = e.highest_hz;
  term.is_placebo = e.is_placebo;
  if (term.is_placebo) {
    term.entry = nullptr;
    term.name = fmt::format("{} that repeats {:.3g} times a turn of the motor, an order that no drive has",
                            info.reads & effects::kDirection ? "friction" : "a torque", *e.order);
  }
  term.sum_is_positive = info.replaces.empty() && e.nonlinear > 0 && e.entry.count(Kind::linear) == 2;
  if (info.reads == effects::kCurrent && is_curved(columns.sign.rightCols(1), builder.sign.effort)) {
    const std::optional<double> most = most_at_peaks(builder, columns.sign.col(0));
    if (!most) return builder.table.not_visible.push_back(&e.entry);
    term.most_at_peak = *most;
  }
  term.columns = builder.add(std::move(columns));
  for (const ParameterRef& ref : e.parameters()) {
    term.low.push_back(e.entry.parameters[ref.parameter].low);
    if (!e.modulates()) term.high.push_back(e.entry.parameters[ref.parameter].high);
  }
  builder.table.terms.push_back(std::move(term));
}

// An effect at each value of its nonlinear parameter, if it has one; nothing where it has several, or no column.
void append_values(Extension e, const RegressionProblem& data, const SelectionPolicy& policy,
                   std::vector<Extension>& all) {
  if (e.parameters().empty()) return;
  if (e.modulates()) return all.push_back(std::move(e));
  estimation::Term& added = e.terms.back();
  std::vector<std::size_t> free_nonlinear;
  for (std::size_t p = 0; p < added.values.size(); ++p)
    if (added.free_nonlinear(p)) free_nonlinear.push_back(p);
  if (free_nonlinear.size() > 1) return;
  if (free_nonlinear.empty()) return all.push_back(std::move(e));
  e.nonlinear = 1;
  e.searched = free_nonlinear[0];
  e.range = estimation::parameter_range(data, added, e.searched);
  for (const double value : estimation::parameter_grid(e.range, policy.grid_points)) {
    added.values[e.searched] = value;
    all.push_back(e);
  }
}

std::vector<Extension> extensions_of(const TableBuilder& builder, const Motion& motion) {
  const RegressionProblem& data = builder.sign.data;
  const bool collapsed = !builder.sign.prepared.output_signals.torque && data.balance() == Balance::motor;
  std::vector<Extension> all;
  for (const catalogue::Entry& entry : catalogue::all()) {
    const effects::Description& info = *entry.info;
    if (entry.identified_on() != data.balance() && !(collapsed && info.balance == Balance::load)) continue;
    if (info.phase == Phase::shift || entry.has_state || entry.definition) continue;  // states: see presliding
    if (!may_be_seen(data, builder.terms, entry)) continue;
    for (const auto& [order, is_placebo] : orders_of(entry, builder.sign.prepared, motion, builder.policy)) {
      if (has_phase_error(builder.terms, entry, order)) continue;
      Extension e{entry, order, {}, order ? *order * motion.typical_speed / motion.turn : 0.0, is_placebo};
      try {
        e.terms = extend(builder.terms, entry, order);
      } catch (const model::ModelError&) {
        continue;
      }
      leave_out_unseen_direction(data, e.terms);
      append_values(std::move(e), data, builder.policy, all);
    }
  }
  return all;
}

// The columns of the model that are fitted on, with either direction of friction: an orthonormal basis, zero on samples
// that are held out.
Eigen::MatrixXd basis_of_model(const TableBuilder& builder, const Eigen::VectorXd& fitted_on) {
  const Eigen::Index rows = builder.table.target.size();
  const std::size_t own = builder.columns.size(), presliding = builder.presliding_columns.size();
  Eigen::MatrixXd all(rows, static_cast<Eigen::Index>(own + presliding));
  for (std::size_t j = 0; j < own; ++j) all.col(static_cast<Eigen::Index>(j)) = builder.columns[j];
  for (std::size_t j = 0; j < presliding; ++j)
    all.col(static_cast<Eigen::Index>(own + j)) = builder.presliding_columns[j];
  all = fitted_on.asDiagonal() * all;
  for (auto column : all.colwise()) column /= std::max(column.norm(), 1e-300);
  return algebra::PivotedQr(all, 1e-7).span();
}

// What the model leaves of all data that are fitted, in motion: while an axis sticks its friction takes any value, and
// a wave over the angle, which is constant there, would take that off.
class LeftByModel {
 public:
  explicit LeftByModel(const TableBuilder& builder) {
    const RegressorTable& table = builder.table;
    fitted_on_ = Eigen::VectorXd::Zero(table.target.size());
    for (const Run& run : table.runs)
      if (table.held_out[run.record] == 0)
        for (Eigen::Index k = run.first; k < run.last; ++k)
          fitted_on_[k] = std::abs(table.velocity_over_noise[k]) > builder.policy.visible_velocity ? 1.0 : 0.0;
    basis_ = basis_of_model(builder, fitted_on_);
    residual_ = orthogonal(table.target);
  }
  // The squares that columns take off.
  double taken_by(const Eigen::MatrixXd& columns) const {
    const Eigen::MatrixXd own = orthogonal(columns);
    return (own * algebra::PivotedQr(own, 1e-7).solve(residual_)).squaredNorm();
  }

 private:
  Eigen::MatrixXd orthogonal(Eigen::MatrixXd x) const {
    x = fitted_on_.asDiagonal() * x;
    return x - basis_ * (basis_.transpose() * x);
  }

  Eigen::VectorXd fitted_on_, residual_;
  Eigen::MatrixXd basis_;
};

// The two highest of the local maxima, by their places.
std::vector<std::size_t> highest_peaks(const std::vector<double>& values) {
  std::vector<std::size_t> peaks;
  for (std::size_t k = 0; k < values.size(); ++k)
    if ((k == 0 || values[k] >= values[k - 1]) && (k + 1 == values.size() || values[k] > values[k + 1]))
      peaks.push_back(k);
  std::ranges::sort(peaks, [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
  peaks.resize(std::min<std::size_t>(peaks.size(), 2));
  return peaks;
}

// Adds values of nonlinear parameters between the neighbours of those that take off most: of two, as a very narrow law
// may follow a few samples about standstill.
void add_values_near_best(const TableBuilder& builder, const LeftByModel& left, std::vector<Extension>& extensions,
                          std::vector<Eigen::MatrixXd>& columns) {
  const std::size_t points = builder.policy.grid_points;
  std::vector<Extension> finer;
  for (std::size_t first = 0; first < extensions.size();) {
    const Extension& e = extensions[first];
    if (e.nonlinear != 1) {
      ++first;
      continue;
    }
    std::vector<double> taken;
    for (std::size_t k = 0; k < points; ++k) taken.push_back(left.taken_by(columns[first + k]));
    const auto at = [&](double place) { return e.range.at(std::clamp(place / static_cast<double>(points), 0.0, 1.0)); };
    for (const std::size_t peak : highest_peaks(taken)) {
      const auto place = static_cast<double>(peak);
      const estimation::ParameterRange near{at(place - 0.5), at(place + 1.5), e.range.logarithmic};
      for (const double value : estimation::parameter_grid(near, builder.policy.finer_grid_points)) {
        finer.push_back(e);
        finer.back().terms.back().values[e.searched] = value;
      }
    }
    first += points;
  }
  std::vector<Eigen::MatrixXd> more = columns_of_all(finer, builder.sign);
  for (std::size_t k = 0; k < finer.size(); ++k) {
    extensions.push_back(std::move(finer[k]));
    columns.push_back(std::move(more[k]));
  }
}

// The squares that each of some waves takes off what the model leaves. The waves are not filtered, which costs most of
// the time of their columns: the filter's gain at the frequency that they have at each sample takes its place.
std::vector<double> taken_by_waves(std::span<const Extension> waves, const TableBuilder& builder, const Motion& motion,
                                   const LeftByModel& left) {
  const DirectedData& from = builder.sign;
  const Eigen::VectorXd turns_per_s = from.at_rows([&](const estimation::Record& r, std::size_t k) {
    return r.inputs.velocity.empty() ? 0.0 : std::abs(r.inputs.velocity_at(k)) / motion.turn;
  });
  const std::vector<Eigen::MatrixXd> columns =
      made_together(waves, [&](const Terms& terms, const std::vector<ParameterRef>& refs) {
        return from.data.evaluator().unfiltered_columns(terms, refs);
      });
  std::vector<double> taken;
  for (std::size_t i = 0; i < waves.size(); ++i) {
    const Eigen::ArrayXd over_cutoff = turns_per_s.array() * (*waves[i].order / builder.table.highest_hz);
    // Of a Butterworth filter of this order, forwards and backwards.
    const Eigen::ArrayXd gain = 1.0 / (1.0 + over_cutoff.pow(2 * signals::ZeroPhaseFilter::kDefaultOrder));
    taken.push_back(left.taken_by(gain.matrix().asDiagonal() * columns[i]));
  }
  return taken;
}

// Where a wave is kept, so are those whose error of the phase it may be: they compete with it.
void keep_waves_of_phase_errors(const std::vector<Extension>& extensions, std::vector<std::uint8_t>& is_kept) {
  const std::vector<std::uint8_t> largest = is_kept;
  for (std::size_t i = 0; i < extensions.size(); ++i) {
    if (largest[i] == 0 || !extensions[i].order || extensions[i].is_placebo) continue;
    for (std::size_t k = 0; k < extensions.size(); ++k)
      if (extensions[k].order == extensions[i].order &&
          catalogue::names_contain(extensions[i].entry.info->phase_error_of, extensions[k].entry.name()))
        is_kept[k] = 1;
  }
}

// Leaves out, of waves over the angle, all but those that take most off what the model leaves of all data, of each
// effect and of placebos likewise: the others would cost most of the time. Those of effects are listed in the table.
std::vector<Extension> with_largest_waves(const std::vector<Extension>& extensions, const TableBuilder& builder,
                                          const Motion& motion, const LeftByModel& left) {
  std::map<std::pair<const catalogue::Entry*, bool>, std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < extensions.size(); ++i)
    if (extensions[i].order) places[{&extensions[i].entry, extensions[i].is_placebo}].push_back(i);
  std::vector<std::vector<std::size_t>> lists;
  for (auto& [effect, list] : places) lists.push_back(std::move(list));
  std::vector<double> taken(extensions.size(), 0.0);
  estimation::in_parallel(lists.size(), [&](std::size_t l) {
    std::vector<Extension> waves;
    for (const std::size_t i : lists[l]) waves.push_back(extensions[i]);
    const std::vector<double> squares = taken_by_waves(waves, builder, motion, left);
    for (std::size_t k = 0; k < squares.size(); ++k) taken[lists[l][k]] = squares[k];
  });
  std::vector<std::uint8_t> is_kept(extensions.size(), 1);
  for (std::vector<std::size_t>& list : lists) {
    std::ranges::stable_sort(list, std::greater{}, [&](std::size_t i) { return taken[i]; });
    for (std::size_t k = builder.policy.orders_resampled; k < list.size(); ++k) is_kept[list[k]] = 0;
  }
  keep_waves_of_phase_errors(extensions, is_kept);
  std::vector<Extension> kept;
  for (std::size_t i = 0; i < extensions.size(); ++i)
    if (is_kept[i] != 0)
      kept.push_back(extensions[i]);
    else if (!extensions[i].is_placebo)
      builder.table.smaller_waves.emplace_back(&extensions[i].entry, *extensions[i].order);
  return kept;
}

bool is_phase_error_of(const CandidateTerm& left, const CandidateTerm& wave) {
  return left.entry && wave.entry && left.order && left.order == wave.order &&
         catalogue::names_contain(left.entry->info->phase_error_of, wave.entry->name());
}

// A wave over the angle with a delay between effort and motion: to first order, with its slope in time. A delay gives
// it a part that turns with the direction, which a friction over the angle would take for its own.
void add_delayed_waves(TableBuilder& builder, std::size_t first) {
  std::vector<CandidateTerm>& terms = builder.table.terms;
  const std::size_t count = terms.size();
  for (std::size_t w = first; w < count; ++w) {
    if (!terms[w].entry || (terms[w].entry->info->reads & effects::kTorque) != 0) continue;
    const auto mistaken = [&](const CandidateTerm& left) { return is_phase_error_of(left, terms[w]); };
    if (std::none_of(terms.begin() + static_cast<std::ptrdiff_t>(first), terms.end(), mistaken)) continue;
    CandidateTerm delayed = terms[w];
    delayed.is_delayed = true;
    Eigen::MatrixXd slopes(builder.table.target.size(), std::ssize(terms[w].columns));
    for (Eigen::Index j = 0; j < slopes.cols(); ++j)
      slopes.col(j) = slope_of(builder.columns[static_cast<std::size_t>(terms[w].columns[static_cast<std::size_t>(j)])],
                               builder.table.runs);
    const std::vector<Eigen::Index> places = builder.add({std::move(slopes), {}});
    for (const Eigen::Index column : places) {
      delayed.columns.push_back(column);
      delayed.low.push_back(-effects::kUnbounded);
      delayed.high.push_back(effects::kUnbounded);
    }
    terms.push_back(std::move(delayed));
  }
}

// Terms from `first` on that are what an error of another one's phase leaves.
void exclude_phase_errors(RegressorTable& table, std::size_t first) {
  for (std::size_t a = first; a < table.terms.size(); ++a)
    for (std::size_t b = first; b < table.terms.size(); ++b) {
      CandidateTerm &left = table.terms[a], &wave = table.terms[b];
      if (!is_phase_error_of(left, wave)) continue;
      left.excludes.push_back(wave.name);
      wave.excludes.push_back(left.name);
    }
}

}  // namespace

void add_catalogue_terms(TableBuilder& builder, const Motion& motion) {
  const LeftByModel left(builder);
  std::vector<Extension> extensions = with_largest_waves(extensions_of(builder, motion), builder, motion, left);
  std::vector<Eigen::MatrixXd> sign = columns_of_all(extensions, builder.sign);
  add_values_near_best(builder, left, extensions, sign);
  std::vector<Extension> directed;
  for (const Extension& e : extensions)
    if (builder.presliding && e.reads_direction()) directed.push_back(e);
  std::vector<Eigen::MatrixXd> presliding;
  if (builder.presliding) presliding = columns_of_all(directed, *builder.presliding);
  auto next = presliding.begin();
  const std::size_t first = builder.table.terms.size();
  for (std::size_t i = 0; i < extensions.size(); ++i)
    add_term(builder, extensions[i],
             {std::move(sign[i]),
              builder.presliding && extensions[i].reads_direction() ? std::move(*next++) : Eigen::MatrixXd()});
  add_delayed_waves(builder, first);
  exclude_phase_errors(builder.table, first);
}

}  // namespace flexspline::selection
