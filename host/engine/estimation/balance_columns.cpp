// Columns of a balance: what the parameters of effects add to it.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "host/engine/estimation/balance_data.hpp"
#include "host/engine/estimation/cancellation.hpp"
#include "host/engine/estimation/filtered_columns.hpp"

namespace flexspline::estimation {
namespace {

using catalogue::DriveConstants;
using effects::Kind;
using effects::Phase;
using numbers::Dual;
using numbers::Jet;

constexpr std::size_t kCachedNumbers = 40'000'000;

// Whether a shift or modulation changes the torque of a term.
bool changes(const Term& changer, const Term& term) {
  const effects::Description& what = *changer.entry->info;
  // The torque of a kinematic error follows from the measured torque.
  if (what.phase == Phase::shift)
    return (term.entry->info->reads & effects::kTorsion) != 0 && term.entry->info->phase == Phase::source;
  // An effect that replaces another one is scaled like it.
  if (what.phase == Phase::modulate)
    return catalogue::names_contain(what.modulates, term.entry->name()) ||
           catalogue::names_contain(term.entry->info->replaces, what.modulates);
  return false;
}

// Parameters that a column depends on, written exactly.
void append_nonlinear(std::string& key, const Term& term) {
  key += fmt::format("{}", term.entry->id);
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.entry->parameters[p].kind != Kind::linear) key += fmt::format(",{:a}", term.values[p]);
  key += ';';
}

std::string key_of(const Terms& terms, ParameterRef ref) {
  const Term& term = terms[ref.term];
  std::string key = fmt::format("{}:", ref.parameter);
  append_nonlinear(key, term);
  for (const Term& other : terms)
    if (changes(other, term)) append_nonlinear(key, other);
  return key;
}

template <class P>
DriveConstants<P> lifted(const DriveConstants<double>& d) {
  DriveConstants<P> c;
  c.gear_ratio = P(d.gear_ratio);
  c.torque_constant = P(d.torque_constant);
  c.rated_velocity = P(d.rated_velocity);
  c.reference_temperature = P(d.reference_temperature);
  c.turn_angle_scale = P(d.turn_angle_scale);
  return c;
}

// The direction of a torsion rate that a shift has changed, smoothed over the noise of the measured rate.
template <class S>
S direction_of(const S& rate, double width) {
  using std::tanh;
  return width > 0.0 ? tanh(rate / S(width)) : S(rate > S(0.0) ? 1.0 : rate < S(0.0) ? -1.0 : 0.0);
}

template <class N>
const catalogue::BlockFunctions<N>& functions_of(const catalogue::Entry& entry) {
  if constexpr (std::is_same_v<N, Real>)
    return entry.real;
  else
    return entry.dual;
}

// Signals that a term's torque reads. kWholeRecord for effects with memory, with inputs that others change, or with a
// formula (which would be parsed again for each block).
unsigned reads_of(const Terms& terms, const Term& term) {
  if (term.entry->has_state || term.entry->definition) return kWholeRecord;
  for (const Term& other : terms)
    if (changes(other, term)) return kWholeRecord;
  return term.entry->info->reads;
}

// Calls add(balance, sum) for each balance that the term acts on, and weighs the sum by share(balance).
template <class V, class Share, class Add>
void add_by_shares(const Term& term, Share share, std::span<V> torque, Add add) {
  for (const Balance to : {Balance::motor, Balance::transmission, Balance::load}) {
    const double weight = term.entry->adds_to(to) ? share(to) : 0.0;
    if (weight == 0.0) continue;
    if (weight == 1.0) {
      add(to, torque.data());
      continue;
    }
    std::vector<V> through(torque.size(), V(0.0));
    add(to, through.data());
    for (std::size_t k = 0; k < torque.size(); ++k) torque[k] += through[k] * weight;
  }
}

}  // namespace

double BalanceData::share(const Record& r, Balance of_effect) const {
  if (of_effect == balance_) return 1.0;
  if (balance_ != Balance::motor || prepared_->output_signals.torque) return 0.0;
  const Balance through = r.locked ? Balance::transmission : Balance::load;
  return of_effect == through ? 1.0 / prepared_->constants.gear_ratio : 0.0;
}

// With the drive off friction holds the shaft against whatever else acts on it, a weight or a ripple.
double BalanceData::share_of(const Term& term, const Record& r, Balance of_effect) const {
  const effects::Description& info = *term.entry->info;
  const bool is_of_effort = !term.entry->definition && info.balance == Balance::motor &&
                            (info.reads & (effects::kCurrent | effects::kTorqueInput)) != 0;
  return r.at_rest && !is_of_effort ? 0.0 : share(r, of_effect);
}

template <class N>
bool BalanceData::change_inputs(const Terms& terms, const Term& term, const Record& r,
                                const std::vector<std::vector<typename N::Parameter>>& all_values,
                                std::vector<effects::Inputs<N>>& changed) const {
  bool any = false;
  for (const Term& other : terms) any = any || changes(other, term);
  if (!any) return false;
  const auto constants = lifted<typename N::Parameter>(prepared_->constants);
  changed.reserve(r.inputs.size());
  r.inputs.all().each_block([&](std::size_t, std::span<const effects::Inputs<Real>> block) {
    for (const auto& in : block) changed.push_back(catalogue::lifted<N>(in));
  });
  bool turned = false;
  constexpr std::pair<Phase, bool> kSteps[] = {{Phase::shift, false}, {Phase::shift, true}, {Phase::modulate, false}};
  for (const auto& [phase, last] : kSteps)
    for (std::size_t t = 0; t < terms.size(); ++t)
      if (terms[t].entry->info->phase == phase && terms[t].entry->info->acts_last == last && changes(terms[t], term)) {
        functions_of<N>(*terms[t].entry)
            .change(catalogue::natural(*terms[t].entry, all_values[t]).data(), constants, changed);
        turned = turned || (phase == Phase::shift && (terms[t].entry->info->reads & effects::kMotorAngle) != 0);
      }
  if (turned && !r.at_rest)
    for (auto& in : changed)
      in.torsion_direction = direction_of(in.torsion_rate, r.velocity_noise[index(Balance::transmission)]);
  return true;
}

template bool BalanceData::change_inputs<Real>(const Terms&, const Term&, const Record&,
                                               const std::vector<std::vector<double>>&,
                                               std::vector<effects::Inputs<Real>>&) const;

template <class N>
void BalanceData::add_torque(const Terms& terms, const Term& term, const std::vector<typename N::Parameter>& values,
                             const Record& r, const std::vector<std::vector<typename N::Parameter>>& all_values,
                             std::span<typename N::Value> torque) const {
  using P = typename N::Parameter;
  if (!term.adds_torque()) return;
  const DriveConstants<P> constants = lifted<P>(prepared_->constants);
  std::vector<effects::Inputs<N>> changed;
  const bool any = change_inputs<N>(terms, term, r, all_values, changed);
  const std::vector<P> natural = catalogue::natural(*term.entry, values);
  const auto share_here = [&](Balance to) { return share_of(term, r, to); };
  add_by_shares(term, share_here, torque, [&](Balance to, typename N::Value* sum) {
    const catalogue::BlockFunctions<N>& functions = functions_of<N>(*term.entry);
    if (any)
      functions.torque(natural.data(), constants, to, changed, sum);
    else
      functions.torque_of_plain(natural.data(), constants, to, r.inputs.all(term.entry->info->reads), sum);
  });
}

namespace {

// Linear parameters: all zero but one, which is one. Others keep their values.
std::vector<double> unit_values(const Term& term, std::size_t parameter) {
  std::vector<double> values = term.values;
  for (std::size_t p = 0; p < values.size(); ++p)
    if (term.entry->parameters[p].kind == Kind::linear) values[p] = p == parameter ? 1.0 : 0.0;
  return values;
}

// Whether the torque is linear in all linear parameters together, so that a slope by one of them is its column.
bool is_linear_in_all(const catalogue::Entry& entry) {
  return std::all_of(entry.parameters.begin(), entry.parameters.end(), [](const effects::ParameterInfo& p) {
    return p.per.empty() && p.root_of.empty() && (p.kind != Kind::linear || !(p.low > 0.0));
  });
}

// Columns of two linear parameters of a term by one evaluation, which finds the wave or bell that both multiply once:
// the first parameter is one, the second zero with a slope of one.
struct ColumnPair {
  std::vector<Jet> parameters;
  std::vector<Jet> torque;
  const RowRange* of = nullptr;
  std::size_t first = 0;

  ColumnPair(const std::vector<double>& values_of_first, std::size_t second)
      : parameters(values_of_first.begin(), values_of_first.end()) {
    parameters[second].v[0] = 1.0;
  }
  // Whether this is a block that the other parameter's column has not computed yet; its torque is zero then.
  bool begins(const RowRange& range, const ColumnBlock& block) {
    if (of == &range && first == block.first && torque.size() == block.signal.size()) return false;
    of = &range;
    first = block.first;
    torque.assign(block.signal.size(), Jet(0.0));
    return true;
  }
};

// The column of one linear parameter.
struct UnitColumn {
  const Term* term;
  std::vector<double> values;                       // as unit_values
  unsigned reads;                                   // as reads_of
  std::shared_ptr<ColumnPair> first_of, second_of;  // with the column after it, before it
};

UnitColumn unit_column(const Terms& terms, ParameterRef ref) {
  const Term& term = terms[ref.term];
  return {&term, unit_values(term, ref.parameter), term.adds_torque() ? reads_of(terms, term) : 0, nullptr, nullptr};
}

bool together(const UnitColumn& first, const UnitColumn& second) {
  return first.term == second.term && !first.second_of && first.term->adds_torque() && first.reads != kWholeRecord &&
         is_linear_in_all(*first.term->entry);
}

}  // namespace

const Eigen::VectorXd& BalanceData::column(const Terms& terms, ParameterRef ref) {
  make_columns(terms, {ref});
  return cache_.at(key_of(terms, ref));
}

Eigen::MatrixXd BalanceData::columns(const Terms& terms, const std::vector<ParameterRef>& refs) {
  throw_if_cancelled();
  make_columns(terms, refs);
  Eigen::MatrixXd X(rows(), static_cast<Eigen::Index>(refs.size()));
  for (std::size_t j = 0; j < refs.size(); ++j) X.col(static_cast<Eigen::Index>(j)) = cache_.at(key_of(terms, refs[j]));
  return X;
}

void BalanceData::make_columns(const Terms& terms, const std::vector<ParameterRef>& refs) {
  const auto missing = [&] {
    std::vector<ParameterRef> list;
    for (const ParameterRef& ref : refs)
      if (!cache_.contains(key_of(terms, ref))) list.push_back(ref);
    return list;
  };
  std::vector<ParameterRef> wanted = missing();
  if (wanted.empty()) return;
  // A search over nonlinear parameters computes many columns that are not used again.
  if (cache_.size() * static_cast<std::size_t>(rows()) > kCachedNumbers) {
    cache_.clear();
    wanted = missing();
  }
  const auto all = values_of_all(terms);
  const DriveConstants<Jet> lifted_constants = lifted<Jet>(prepared_->constants);
  std::vector<UnitColumn> unit_columns;
  for (const ParameterRef& ref : wanted) {
    UnitColumn column = unit_column(terms, ref);
    if (!unit_columns.empty() && together(unit_columns.back(), column))
      column.second_of = unit_columns.back().first_of =
          std::make_shared<ColumnPair>(unit_columns.back().values, ref.parameter);
    unit_columns.push_back(std::move(column));
  }
  struct Fill {
    const std::vector<UnitColumn>* of;
    std::function<void(const RowRange&, const UnitColumn&, const ColumnBlock&)> work;
    unsigned reads(std::size_t column) const { return (*of)[column].reads; }
    void operator()(const RowRange& range, std::size_t column, const ColumnBlock& block) const {
      work(range, (*of)[column], block);
    }
  };
  const auto fill = [&](const RowRange& range, const UnitColumn& column, const ColumnBlock& block) {
    const Term& term = *column.term;
    const Record& r = prepared_->records[range.record];
    const auto share_here = [&](Balance to) { return share_of(term, r, to); };
    if (column.reads == kWholeRecord) return add_torque<Real>(terms, term, column.values, r, all, block.signal);
    if (!term.adds_torque()) return;
    if (ColumnPair* const both = column.second_of ? column.second_of.get() : column.first_of.get()) {
      if (both->begins(range, block))
        add_by_shares(term, share_here, std::span(both->torque), [&](Balance to, Jet* sum) {
          term.entry->dual.torque_of_plain(both->parameters.data(), lifted_constants, to, block.inputs, sum);
        });
      for (std::size_t k = 0; k < block.signal.size(); ++k)
        block.signal[k] = column.second_of ? both->torque[k].v[0] : both->torque[k].a;
      return;
    }
    const std::vector<double> natural = catalogue::natural(*term.entry, column.values);
    add_by_shares(term, share_here, block.signal, [&](Balance to, double* sum) {
      term.entry->real.torque_of_plain(natural.data(), prepared_->constants, to, block.inputs, sum);
    });
  };
  const Eigen::MatrixXd made = filtered_columns(wanted.size(), Fill{&unit_columns, fill});
  for (std::size_t j = 0; j < wanted.size(); ++j)
    cache_.insert_or_assign(key_of(terms, wanted[j]), made.col(static_cast<Eigen::Index>(j)));
}

Eigen::VectorXd BalanceData::nonlinear_column(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                              ParameterRef nonlinear_ref) {
  return nonlinear_columns(terms, on_balance, {nonlinear_ref});
}

Eigen::MatrixXd BalanceData::nonlinear_columns(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                               const std::vector<ParameterRef>& nonlinear) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows(), static_cast<Eigen::Index>(nonlinear.size()));
  std::vector<ParameterRef> together;
  std::vector<Eigen::Index> at;
  for (std::size_t j = 0; j < nonlinear.size(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    if (is_slope_cached(terms, nonlinear[j])) {
      columns.col(column) = cached_slope(terms, nonlinear[j]);
    } else {
      together.push_back(nonlinear[j]);
      at.push_back(column);
    }
  }
  if (together.empty()) return columns;
  std::vector<std::vector<Jet>> all;
  for (const Term& term : terms) all.emplace_back(term.values.begin(), term.values.end());
  std::vector<Jet> torque;
  columns(Eigen::all, at) = filtered_columns(
      together.size(), WholeRecord{[&](const RowRange& range, std::size_t j, std::span<double> signal) {
        const ParameterRef nonlinear_ref = together[j];
        all[nonlinear_ref.term][nonlinear_ref.parameter].v[0] = 1.0;
        torque.assign(signal.size(), Jet(0.0));
        for (const std::size_t t : on_balance)
          if (terms[t].adds_torque() && (t == nonlinear_ref.term || changes(terms[nonlinear_ref.term], terms[t])))
            add_torque<Dual>(terms, terms[t], all[t], prepared_->records[range.record], all, torque);
        for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = torque[k].v[0];
        all[nonlinear_ref.term][nonlinear_ref.parameter].v[0] = 0.0;
      }});
  return columns;
}

Eigen::MatrixXd BalanceData::slopes(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                    const std::vector<ParameterRef>& linear,
                                    const std::vector<ParameterRef>& nonlinear) {
  Eigen::MatrixXd both(rows(), static_cast<Eigen::Index>(linear.size() + nonlinear.size()));
  both << columns(terms, linear), nonlinear_columns(terms, on_balance, nonlinear);
  return both;
}

bool BalanceData::is_slope_cached(const Terms& terms, ParameterRef nonlinear_ref) const {
  const Term& term = terms[nonlinear_ref.term];
  return term.entry->info->phase == Phase::source && term.adds_torque() && term.entry->count(Kind::linear) == 1;
}

Eigen::VectorXd BalanceData::cached_slope(const Terms& terms, ParameterRef nonlinear_ref) {
  const Term& term = terms[nonlinear_ref.term];
  std::size_t scale = 0;
  while (term.entry->parameters[scale].kind != Kind::linear) ++scale;
  const std::string key =
      fmt::format("slope {}:{}", nonlinear_ref.parameter, key_of(terms, {nonlinear_ref.term, scale}));
  auto found = cache_.find(key);
  if (found == cache_.end()) {
    if (cache_.size() * static_cast<std::size_t>(rows()) > kCachedNumbers) cache_.clear();
    std::vector<std::vector<Jet>> all;
    for (const Term& other : terms) all.emplace_back(other.values.begin(), other.values.end());
    all[nonlinear_ref.term][scale] = Jet(1.0);
    all[nonlinear_ref.term][nonlinear_ref.parameter].v[0] = 1.0;
    std::vector<Jet> torque;
    const auto fill = [&](const RowRange& range, std::size_t, std::span<double> signal) {
      torque.assign(signal.size(), Jet(0.0));
      add_torque<Dual>(terms, term, all[nonlinear_ref.term], prepared_->records[range.record], all, torque);
      for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = torque[k].v[0];
    };
    found = cache_.emplace(key, filtered_columns(1, WholeRecord{fill})).first;
  }
  return term.values[scale] * found->second;
}

Eigen::VectorXd BalanceData::known_torque(const Terms& terms, const std::vector<std::size_t>& on_balance) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows());
  for (const std::size_t t : on_balance)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].adds_torque() && terms[t].known[p] && terms[t].entry->parameters[p].kind == Kind::linear &&
          terms[t].values[p] != 0.0)
        sum += terms[t].values[p] * column(terms, {t, p});
  for (const std::size_t t : on_balance)
    if (terms[t].scaled_by_none()) sum += term_torque(terms, t);
  for (const std::size_t t : terms_acting_on_other_balance(terms, balance_, prepared_->output_signals))
    sum += term_torque(terms, t);
  return sum;
}

BalanceData::Regression BalanceData::regression(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                                const std::vector<ParameterRef>& linear) {
  return {columns(terms, linear), target() - known_torque(terms, on_balance)};
}

Eigen::VectorXd BalanceData::residual(const Terms& terms) {
  Eigen::VectorXd left = target();
  for (const std::size_t t : terms_on(terms, balance_, prepared_->output_signals)) left -= term_torque(terms, t);
  for (const std::size_t t : terms_acting_on_other_balance(terms, balance_, prepared_->output_signals))
    left -= term_torque(terms, t);
  return left;
}

Eigen::VectorXd BalanceData::term_torque(const Terms& terms, std::size_t t) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows());
  if (!terms[t].adds_torque()) return sum;
  if (terms[t].scaled_by_none()) {
    std::string key = "whole:";
    append_nonlinear(key, terms[t]);
    for (const Term& other : terms)
      if (changes(other, terms[t])) append_nonlinear(key, other);
    if (const auto found = cache_.find(key); found != cache_.end()) return found->second;
    if (cache_.size() * static_cast<std::size_t>(rows()) > kCachedNumbers) cache_.clear();
    const auto all = values_of_all(terms);
    return cache_
        .emplace(key,
                 filtered_columns(1, WholeRecord{[&](const RowRange& range, std::size_t, std::span<double> signal) {
                                    add_torque<Real>(terms, terms[t], terms[t].values, prepared_->records[range.record],
                                                     all, signal);
                                  }}))
        .first->second;
  }
  for (std::size_t p = 0; p < terms[t].values.size(); ++p)
    if (terms[t].entry->parameters[p].kind == Kind::linear) sum += terms[t].values[p] * column(terms, {t, p});
  return sum;
}

}  // namespace flexspline::estimation
