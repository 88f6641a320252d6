#include "host/engine/estimation/regressor_evaluator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "host/engine/estimation/filtered_columns.hpp"
#include "host/engine/estimation/modelled_current.hpp"

namespace flexspline::estimation {
namespace {

using catalogue::DriveConstants;
using effects::Kind;
using effects::Phase;
using numbers::Dual;
using numbers::Jet;

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

// Signals that a term's torque reads. kWholeRecord for effects with memory, with inputs that others change, of the
// modelled current, or with a formula (which would be parsed again for each block).
unsigned reads_of(const Terms& terms, const Term& term) {
  if (reads_modelled_current(term) || term.entry->definition) return kWholeRecord;
  for (const Term& other : terms)
    if (changes_inputs_of(other, term)) return kWholeRecord;
  return term.entry->info->reads;
}

unsigned current_for(const PreparedData& prepared, const Term& term) {
  const bool is_measured = prepared.nonlinear_in_measured_current && is_nonlinear_in_current(term);
  return reads_modelled_current(term) && !is_measured ? RecordSignals::kModelledCurrent : 0;
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

double RegressorEvaluator::share(const Record& r, Balance of_effect) const {
  if (of_effect == balance_) return 1.0;
  if (balance_ != Balance::motor || prepared_->output_signals.torque) return 0.0;
  const Balance through = r.locked ? Balance::transmission : Balance::load;
  return of_effect == through ? 1.0 / prepared_->constants.gear_ratio : 0.0;
}

// With the drive off friction holds the shaft against whatever else acts on it, a weight or a ripple.
double RegressorEvaluator::share_of(const Term& term, const Record& r, Balance of_effect) const {
  const effects::Description& info = *term.entry->info;
  const bool is_of_effort = !term.entry->definition && info.balance == Balance::motor &&
                            (info.reads & (effects::kCurrent | effects::kTorqueInput)) != 0;
  return r.at_rest && !is_of_effort ? 0.0 : share(r, of_effect);
}

template <class N>
bool RegressorEvaluator::change_inputs(const Terms& terms, const Term& term, const Record& r,
                                       const std::vector<std::vector<typename N::Parameter>>& all_values,
                                       std::vector<effects::Inputs<N>>& changed) const {
  bool any = false;
  for (const Term& other : terms) any = any || changes_inputs_of(other, term);
  if (!any) return false;
  const auto constants = lifted<typename N::Parameter>(prepared_->constants);
  changed.reserve(r.inputs.size());
  r.inputs.all(RecordSignals::kAll | current_for(*prepared_, term)).each_block([&](std::size_t, auto block) {
    for (const auto& in : block) changed.push_back(catalogue::lifted<N>(in));
  });
  bool turned = false;
  constexpr std::pair<Phase, bool> kSteps[] = {{Phase::shift, false}, {Phase::shift, true}, {Phase::modulate, false}};
  for (const auto& [phase, last] : kSteps)
    for (std::size_t t = 0; t < terms.size(); ++t)
      if (terms[t].entry->info->phase == phase && terms[t].entry->info->acts_last == last &&
          changes_inputs_of(terms[t], term)) {
        functions_of<N>(*terms[t].entry)
            .change(catalogue::natural(*terms[t].entry, all_values[t]).data(), constants, changed);
        turned = turned || (phase == Phase::shift && (terms[t].entry->info->reads & effects::kMotorAngle) != 0);
      }
  if (turned && !r.at_rest)
    for (auto& in : changed)
      in.torsion_direction = direction_of(in.torsion_rate, r.velocity_noise[index(Balance::transmission)]);
  return true;
}

template bool RegressorEvaluator::change_inputs<Real>(const Terms&, const Term&, const Record&,
                                                      const std::vector<std::vector<double>>&,
                                                      std::vector<effects::Inputs<Real>>&) const;

template <class N>
void RegressorEvaluator::add_torque(const Terms& terms, const Term& term,
                                    const std::vector<typename N::Parameter>& values, const Record& r,
                                    const std::vector<std::vector<typename N::Parameter>>& all_values,
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
      functions.torque_of_plain(natural.data(), constants, to,
                                r.inputs.all(term.entry->info->reads | current_for(*prepared_, term)), sum);
  });
}

std::vector<double> RegressorEvaluator::torque_along(const Terms& terms, std::size_t record) const {
  const Record& r = prepared_->records[record];
  std::vector<double> torque(r.inputs.size(), 0.0);
  const auto all = values_of_all(terms);
  for (const Term& term : terms) add_torque<Real>(terms, term, term.values, r, all, torque);
  return torque;
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
  ParameterRef ref;
  std::vector<double> values;        // as unit_values
  unsigned reads;                    // as reads_of
  std::shared_ptr<ColumnPair> pair;  // with another linear parameter
  bool is_second = false;            // of the pair
};

// Linear parameters are taken in pairs by their order in the effect, whatever is asked for together: a column must not
// depend on that, not even in its last bit.
UnitColumn unit_column(const Terms& terms, ParameterRef ref, const std::vector<UnitColumn>& before) {
  const Term& term = terms[ref.term];
  UnitColumn column{&term, ref, unit_values(term, ref.parameter), term.adds_torque() ? reads_of(terms, term) : 0,
                    nullptr};
  if (!term.adds_torque() || column.reads == kWholeRecord || !is_linear_in_all(*term.entry)) return column;
  std::vector<std::size_t> linear;
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.entry->parameters[p].kind == Kind::linear) linear.push_back(p);
  const auto at = static_cast<std::size_t>(std::find(linear.begin(), linear.end(), ref.parameter) - linear.begin());
  const std::size_t first = at - at % 2;
  if (first + 1 >= linear.size()) return column;
  column.is_second = at != first;
  if (column.is_second && !before.empty() && before.back().ref == ParameterRef{ref.term, linear[first]})
    column.pair = before.back().pair;
  else
    column.pair = std::make_shared<ColumnPair>(unit_values(term, linear[first]), linear[first + 1]);
  return column;
}

}  // namespace

Eigen::MatrixXd RegressorEvaluator::unit_columns(const Terms& terms, const std::vector<ParameterRef>& refs) const {
  const auto all = values_of_all(terms);
  const DriveConstants<Jet> lifted_constants = lifted<Jet>(prepared_->constants);
  std::vector<UnitColumn> unit_columns;
  for (const ParameterRef& ref : refs) unit_columns.push_back(unit_column(terms, ref, unit_columns));
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
    if (ColumnPair* const both = column.pair.get()) {
      if (both->begins(range, block))
        add_by_shares(term, share_here, std::span(both->torque), [&](Balance to, Jet* sum) {
          term.entry->dual.torque_of_plain(both->parameters.data(), lifted_constants, to, block.inputs, sum);
        });
      for (std::size_t k = 0; k < block.signal.size(); ++k)
        block.signal[k] = column.is_second ? both->torque[k].v[0] : both->torque[k].a;
      return;
    }
    const std::vector<double> natural = catalogue::natural(*term.entry, column.values);
    add_by_shares(term, share_here, block.signal, [&](Balance to, double* sum) {
      term.entry->real.torque_of_plain(natural.data(), prepared_->constants, to, block.inputs, sum);
    });
  };
  return filtered_columns(refs.size(), Fill{&unit_columns, fill});
}

Eigen::MatrixXd RegressorEvaluator::unfiltered_columns(const Terms& terms,
                                                       const std::vector<ParameterRef>& refs) const {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows(), std::ssize(refs));
  std::vector<effects::Inputs<Real>> inputs;
  for (const RowRange& range : ranges_) {
    const Record& r = prepared_->records[range.record];
    inputs.clear();
    for (const std::size_t k : r.rows[index(balance_)].samples) inputs.push_back(r.inputs[k]);
    for (std::size_t j = 0; j < refs.size(); ++j) {
      const Term& term = terms[refs[j].term];
      const std::vector<double> natural = catalogue::natural(*term.entry, unit_values(term, refs[j].parameter));
      const std::span torque(columns.col(static_cast<Eigen::Index>(j)).data() + range.first, inputs.size());
      const auto share_here = [&](Balance to) { return share_of(term, r, to); };
      add_by_shares(term, share_here, torque, [&](Balance to, double* sum) {
        term.entry->real.torque(natural.data(), prepared_->constants, to, inputs, sum);
      });
    }
  }
  return columns;
}

Eigen::MatrixXd RegressorEvaluator::slopes(const Terms& terms, const std::vector<std::size_t>& of,
                                           const std::vector<ParameterRef>& nonlinear) const {
  std::vector<std::vector<Jet>> all;
  for (const Term& term : terms) all.emplace_back(term.values.begin(), term.values.end());
  std::vector<Jet> torque;
  return filtered_columns(
      nonlinear.size(), WholeRecord{[&](const RowRange& range, std::size_t j, std::span<double> signal) {
        const ParameterRef by = nonlinear[j];
        all[by.term][by.parameter].v[0] = 1.0;
        torque.assign(signal.size(), Jet(0.0));
        for (const std::size_t t : of)
          if (terms[t].adds_torque() && (t == by.term || changes_inputs_of(terms[by.term], terms[t])))
            add_torque<Dual>(terms, terms[t], all[t], prepared_->records[range.record], all, torque);
        for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = torque[k].v[0];
        all[by.term][by.parameter].v[0] = 0.0;
      }});
}

Eigen::VectorXd RegressorEvaluator::slope_per_unit(const Terms& terms, ParameterRef nonlinear,
                                                   std::size_t linear) const {
  std::vector<std::vector<Jet>> all;
  for (const Term& term : terms) all.emplace_back(term.values.begin(), term.values.end());
  all[nonlinear.term][linear] = Jet(1.0);
  all[nonlinear.term][nonlinear.parameter].v[0] = 1.0;
  std::vector<Jet> torque;
  return filtered_columns(1, WholeRecord{[&](const RowRange& range, std::size_t, std::span<double> signal) {
                            torque.assign(signal.size(), Jet(0.0));
                            add_torque<Dual>(terms, terms[nonlinear.term], all[nonlinear.term],
                                             prepared_->records[range.record], all, torque);
                            for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = torque[k].v[0];
                          }});
}

Eigen::VectorXd RegressorEvaluator::torque(const Terms& terms, std::size_t term) const {
  const auto all = values_of_all(terms);
  return filtered_columns(1, WholeRecord{[&](const RowRange& range, std::size_t, std::span<double> signal) {
                            add_torque<Real>(terms, terms[term], terms[term].values, prepared_->records[range.record],
                                             all, signal);
                          }});
}

}  // namespace flexspline::estimation
