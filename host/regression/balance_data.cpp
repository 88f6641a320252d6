#include "host/regression/balance_data.hpp"

#include <fmt/format.h>

#include "host/regression/giving_up.hpp"
#include "host/signals/differentiate.hpp"

namespace flexspline::regression {
namespace {

using catalogue::DriveConstants;
using data::Column;
using effects::Kind;
using effects::Phase;
using numbers::Dual;
using numbers::Jet;

constexpr Eigen::Index kFewestRows = 16;
constexpr std::size_t kCachedNumbers = 40'000'000;

// Whether a shift or modulation reaches what a term computes.
bool changes(const Term& changer, const Term& term) {
  const effects::Description& what = *changer.entry->info;
  // A kinematic error's own torque follows the measured torque.
  if (what.phase == Phase::shift)
    return (term.entry->info->reads & effects::kTorsion) != 0 && term.entry->info->phase == Phase::source;
  // What takes the place of an effect is scaled as that would be.
  if (what.phase == Phase::modulate)
    return catalogue::names_contain(what.modulates, term.entry->name()) ||
           catalogue::names_contain(term.entry->info->replaces, what.modulates);
  return false;
}

// Parameters that a column depends on, written exactly.
void append_shapes(std::string& key, const Term& term) {
  key += fmt::format("{}", term.entry->id);
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.entry->parameters[p].kind != Kind::linear) key += fmt::format(",{:a}", term.values[p]);
  key += ';';
}

std::string key_of(const Terms& terms, Slot slot) {
  const Term& term = terms[slot.term];
  std::string key = fmt::format("{}:", slot.parameter);
  append_shapes(key, term);
  for (const Term& other : terms)
    if (changes(other, term)) append_shapes(key, other);
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

// The direction of a torsion rate that a shift has changed, smooth over the noise of the rate as it was measured.
template <class S>
S direction_of(const S& rate, double width) {
  using std::tanh;
  return width > 0.0 ? tanh(rate / S(width)) : S(rate > S(0.0) ? 1.0 : rate < S(0.0) ? -1.0 : 0.0);
}

template <class N>
const catalogue::Along<N>& along(const catalogue::Entry& entry) {
  if constexpr (std::is_same_v<N, Real>)
    return entry.real;
  else
    return entry.dual;
}

}  // namespace

bool BalanceData::usable(const Record& r) const {
  switch (balance_) {
    case Balance::motor:
      return !r.effort.empty() && r.has_motor_motion && (!prepared_->torque_measured || !r.torque.empty());
    case Balance::transmission:
      return !r.torque.empty() && r.has_motor_motion && r.has_output_motion && !r.at_rest;
    case Balance::load:
      return !r.torque.empty() && !r.locked && (r.has_output_motion || r.has_motor_motion) && !r.at_rest;
  }
  return false;
}

double BalanceData::share(const Record& r, Balance of_effect) const {
  if (of_effect == balance_) return 1.0;
  if (balance_ != Balance::motor || prepared_->torque_measured) return 0.0;
  const Balance through = r.locked ? Balance::transmission : Balance::load;
  return of_effect == through ? 1.0 / prepared_->constants.gear_ratio : 0.0;
}

void BalanceData::filter(const RowRange& range, Eigen::Ref<Eigen::MatrixXd> signals) const {
  const auto at = static_cast<std::size_t>(&range - ranges_.data());
  for (const data::Segment& s : prepared_->records[range.record].segments)
    filters_[at].apply_columns_in_place(
        signals.middleRows(static_cast<Eigen::Index>(s.first), static_cast<Eigen::Index>(s.last - s.first)));
}

bool BalanceData::filtered_alike(const RowRange& a, const RowRange& b) const {
  const Record &first = prepared_->records[a.record], &second = prepared_->records[b.record];
  return first.sample_s == second.sample_s && first.segments.size() == 1 && second.segments.size() == 1 &&
         first.inputs.size() == second.inputs.size() && first.segments[0].first == second.segments[0].first &&
         first.segments[0].last == second.segments[0].last;
}

void BalanceData::take_rows(const RowRange& range, const double* signal, Eigen::Ref<Eigen::VectorXd> rows) const {
  const auto& samples = prepared_->records[range.record].rows[index(balance_)].samples;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double* at = signal + samples[k];
    const double x = beyond_.empty() ? 0.0 : beyond_[static_cast<std::size_t>(range.first) + k];
    // A cubic through four samples; the filter leaves nothing that it could not follow.
    rows[static_cast<Eigen::Index>(k)] =
        x == 0.0 ? *at
                 : at[-1] * (x * (1.0 - x) * (x - 2.0) / 6.0) + at[0] * ((x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0) +
                       at[1] * ((x + 1.0) * x * (2.0 - x) / 2.0) + at[2] * ((x + 1.0) * x * (x - 1.0) / 6.0);
  }
}

template <class Fill>
Eigen::MatrixXd BalanceData::along_rows(std::size_t columns, Fill fill) const {
  // Some at a time: more would not stay in the processor's cache. Of records that are alike some are taken together.
  constexpr std::size_t kTogether = 8;
  Eigen::MatrixXd rows(ranges_.empty() ? 0 : ranges_.back().last, static_cast<Eigen::Index>(columns));
  Eigen::MatrixXd signals;
  for (std::size_t first = 0; first < columns; first += kTogether) {
    const std::size_t many = std::min(kTogether, columns - first);
    for (std::size_t i = 0; i < ranges_.size();) {
      std::size_t end = i + 1;
      while (end < ranges_.size() && (end - i + 1) * many <= kTogether && filtered_alike(ranges_[i], ranges_[end]))
        ++end;
      const std::size_t samples = prepared_->records[ranges_[i].record].inputs.size();
      signals.setZero(static_cast<Eigen::Index>(samples), static_cast<Eigen::Index>((end - i) * many));
      Eigen::Index at = 0;
      for (std::size_t range = i; range < end; ++range)
        for (std::size_t j = 0; j < many; ++j)
          fill(ranges_[range], first + j, std::span<double>(signals.col(at++).data(), samples));
      filter(ranges_[i], signals);
      at = 0;
      for (std::size_t range = i; range < end; ++range)
        for (std::size_t j = 0; j < many; ++j)
          take_rows(
              ranges_[range], signals.col(at++).data(),
              rows.col(static_cast<Eigen::Index>(first + j)).segment(ranges_[range].first, ranges_[range].size()));
      i = end;
    }
  }
  return rows;
}

BalanceData::BalanceData(const Prepared& prepared, Balance balance) : prepared_(&prepared), balance_(balance) {
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < prepared.records.size(); ++i) {
    const Record& r = prepared.records[i];
    const auto count = static_cast<Eigen::Index>(r.rows[index(balance)].samples.size());
    if (!usable(r)) continue;
    if (count < kFewestRows) {
      left_out_.emplace(i, fmt::format("{} (of its {} rows {} are masked)", r.name,
                                       r.rows[index(balance)].masked + static_cast<std::size_t>(count),
                                       r.rows[index(balance)].masked));
      continue;
    }
    ranges_.push_back({i, first, first + count});
    filters_.emplace_back(signals::ZeroPhaseFilter::kDefaultOrder,
                          std::min(prepared.pipeline.row_cutoff_hz, 0.45 / r.sample_s), 1.0 / r.sample_s);
    first += count;
  }
  const auto left_side = [&](const Record& r, std::size_t k) {
    switch (balance_) {
      case Balance::motor:
        return r.effort[k] - (prepared.torque_measured ? r.torque[k] / prepared.constants.gear_ratio : 0.0);
      case Balance::transmission:
        return r.torque[k];
      case Balance::load:
        return r.torque[k] - (r.load_torque.empty() ? 0.0 : r.load_torque[k]);
    }
    return 0.0;
  };
  const auto fill_target = [&](const RowRange& range, std::size_t, std::span<double> signal) {
    const Record& r = prepared.records[range.record];
    for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = left_side(r, k);
    // A known load torque reaches the motor through the gear.
    if (balance_ == Balance::motor && !prepared.torque_measured && !r.load_torque.empty())
      for (std::size_t k = 0; k < signal.size(); ++k) signal[k] -= r.load_torque[k] / prepared.constants.gear_ratio;
  };
  target_ = along_rows(1, fill_target);
  delay_ = along_rows(1, [&](const RowRange& range, std::size_t, std::span<double> signal) {
    fill_target(range, 0, signal);
    const Record& r = prepared.records[range.record];
    for (const data::Segment& s : r.segments) {
      const std::span<double> part(signal.data() + s.first, s.last - s.first);
      // Filtered first: differences of raw noise would lose their digits to it.
      const std::vector<double> slope = signals::central_derivative(part, r.sample_s);
      for (std::size_t k = 0; k < slope.size(); ++k) part[k] = -slope[k];
    }
  });
}

double BalanceData::filter_autocorrelation_time() const {
  double longest = 1.0;
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    const Record& r = prepared_->records[ranges_[i].record];
    const double row_hz = 1.0 / (r.sample_s * static_cast<double>(r.decimation));
    constexpr int kSteps = 200;
    const double top_hz = std::min(3.0 * filters_[i].cutoff_hz(), 0.5 / r.sample_s);
    double bandwidth_hz = 0.0;
    for (int k = 0; k < kSteps; ++k) {
      const double gain = filters_[i].gain((k + 0.5) / kSteps * top_hz);
      bandwidth_hz += gain * gain * top_hz / kSteps;
    }
    longest = std::max(longest, row_hz / (2.0 * bandwidth_hz));
  }
  return longest;
}

std::vector<std::vector<RowRange>> BalanceData::folds(std::size_t parts) const {
  std::vector<std::vector<RowRange>> folds(parts);
  for (const RowRange& range : ranges_)
    for (std::size_t part = 0; part < parts; ++part) {
      const auto cut = [&](std::size_t p) {
        return range.first + static_cast<Eigen::Index>(static_cast<std::size_t>(range.size()) * p / parts);
      };
      folds[part].push_back({range.record, cut(part), cut(part + 1)});
    }
  return folds;
}

std::size_t BalanceData::sample_of(const RowRange& range, Eigen::Index row) const {
  Eigen::Index start = 0;
  for (const RowRange& whole : ranges_)
    if (whole.record == range.record) start = whole.first;
  return prepared_->records[range.record].rows[index(balance_)].samples[static_cast<std::size_t>(row - start)];
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
  for (const auto& in : r.inputs) changed.push_back(catalogue::lifted<N>(in));
  bool turned = false;
  constexpr std::pair<Phase, bool> kSteps[] = {{Phase::shift, false}, {Phase::shift, true}, {Phase::modulate, false}};
  for (const auto& [phase, last] : kSteps)
    for (std::size_t t = 0; t < terms.size(); ++t)
      if (terms[t].entry->info->phase == phase && terms[t].entry->info->acts_last == last && changes(terms[t], term)) {
        along<N>(*terms[t].entry).change(catalogue::natural(*terms[t].entry, all_values[t]).data(), constants, changed);
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
  for (const Balance to : {Balance::motor, Balance::transmission, Balance::load}) {
    const double weight = term.entry->adds_to(to) ? share(r, to) : 0.0;
    if (weight == 0.0) continue;
    const auto add = [&](typename N::Value* sum) {
      const catalogue::Along<N>& functions = along<N>(*term.entry);
      if (any)
        functions.torque(natural.data(), constants, to, changed, sum);
      else
        functions.torque_of_plain(natural.data(), constants, to, r.inputs, sum);
    };
    if (weight == 1.0) {
      add(torque.data());
      continue;
    }
    std::vector<typename N::Value> through(torque.size(), typename N::Value(0.0));
    add(through.data());
    for (std::size_t k = 0; k < torque.size(); ++k) torque[k] += through[k] * weight;
  }
}

namespace {

// Linear parameters: all nought but one, which is one. Others as they stand.
std::vector<double> unit_values(const Term& term, std::size_t parameter) {
  std::vector<double> values = term.values;
  for (std::size_t p = 0; p < values.size(); ++p)
    if (term.entry->parameters[p].kind == Kind::linear) values[p] = p == parameter ? 1.0 : 0.0;
  return values;
}

}  // namespace

const Eigen::VectorXd& BalanceData::column(const Terms& terms, Slot slot) {
  make_columns(terms, {slot});
  return cache_.at(key_of(terms, slot));
}

Eigen::MatrixXd BalanceData::columns(const Terms& terms, const std::vector<Slot>& slots) {
  ask_whether_to_give_up();
  make_columns(terms, slots);
  Eigen::MatrixXd X(rows(), static_cast<Eigen::Index>(slots.size()));
  for (std::size_t j = 0; j < slots.size(); ++j)
    X.col(static_cast<Eigen::Index>(j)) = cache_.at(key_of(terms, slots[j]));
  return X;
}

void BalanceData::make_columns(const Terms& terms, const std::vector<Slot>& slots) {
  const auto missing = [&] {
    std::vector<Slot> list;
    for (const Slot& slot : slots)
      if (!cache_.contains(key_of(terms, slot))) list.push_back(slot);
    return list;
  };
  std::vector<Slot> wanted = missing();
  if (wanted.empty()) return;
  // A search over shapes makes many columns that nobody asks for again.
  if (cache_.size() * static_cast<std::size_t>(rows()) > kCachedNumbers) {
    cache_.clear();
    wanted = missing();
  }
  const auto all = values_of_all(terms);
  const Eigen::MatrixXd made =
      along_rows(wanted.size(), [&](const RowRange& range, std::size_t j, std::span<double> signal) {
        const Term& term = terms[wanted[j].term];
        add_torque<Real>(terms, term, unit_values(term, wanted[j].parameter), prepared_->records[range.record], all,
                         signal);
      });
  for (std::size_t j = 0; j < wanted.size(); ++j)
    cache_.insert_or_assign(key_of(terms, wanted[j]), made.col(static_cast<Eigen::Index>(j)));
}

Eigen::VectorXd BalanceData::shape_column(const Terms& terms, const std::vector<std::size_t>& on_balance, Slot shape) {
  return shape_columns(terms, on_balance, {shape});
}

Eigen::MatrixXd BalanceData::shape_columns(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                           const std::vector<Slot>& shapes) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows(), static_cast<Eigen::Index>(shapes.size()));
  std::vector<Slot> together;
  std::vector<Eigen::Index> at;
  for (std::size_t j = 0; j < shapes.size(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    if (slopes_are_kept(terms, shapes[j])) {
      columns.col(column) = kept_slope(terms, shapes[j]);
    } else {
      together.push_back(shapes[j]);
      at.push_back(column);
    }
  }
  if (together.empty()) return columns;
  std::vector<std::vector<Jet>> all;
  for (const Term& term : terms) all.emplace_back(term.values.begin(), term.values.end());
  std::vector<Jet> torque;
  columns(Eigen::all, at) =
      along_rows(together.size(), [&](const RowRange& range, std::size_t j, std::span<double> signal) {
        const Slot shape = together[j];
        all[shape.term][shape.parameter].v[0] = 1.0;
        torque.assign(signal.size(), Jet(0.0));
        for (const std::size_t t : on_balance)
          if (terms[t].adds_torque() && (t == shape.term || changes(terms[shape.term], terms[t])))
            add_torque<Dual>(terms, terms[t], all[t], prepared_->records[range.record], all, torque);
        for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = torque[k].v[0];
        all[shape.term][shape.parameter].v[0] = 0.0;
      });
  return columns;
}

bool BalanceData::slopes_are_kept(const Terms& terms, Slot shape) const {
  const Term& term = terms[shape.term];
  return term.entry->info->phase == Phase::source && term.adds_torque() && term.entry->count(Kind::linear) == 1;
}

Eigen::VectorXd BalanceData::kept_slope(const Terms& terms, Slot shape) {
  const Term& term = terms[shape.term];
  std::size_t scale = 0;
  while (term.entry->parameters[scale].kind != Kind::linear) ++scale;
  const std::string key = fmt::format("slope {}:{}", shape.parameter, key_of(terms, {shape.term, scale}));
  auto found = cache_.find(key);
  if (found == cache_.end()) {
    if (cache_.size() * static_cast<std::size_t>(rows()) > kCachedNumbers) cache_.clear();
    std::vector<std::vector<Jet>> all;
    for (const Term& other : terms) all.emplace_back(other.values.begin(), other.values.end());
    all[shape.term][scale] = Jet(1.0);
    all[shape.term][shape.parameter].v[0] = 1.0;
    std::vector<Jet> torque;
    const auto fill = [&](const RowRange& range, std::size_t, std::span<double> signal) {
      torque.assign(signal.size(), Jet(0.0));
      add_torque<Dual>(terms, term, all[shape.term], prepared_->records[range.record], all, torque);
      for (std::size_t k = 0; k < signal.size(); ++k) signal[k] = torque[k].v[0];
    };
    found = cache_.emplace(key, along_rows(1, fill)).first;
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
  for (const std::size_t t : terms_reaching(terms, balance_, prepared_->torque_measured)) sum += term_torque(terms, t);
  return sum;
}

Eigen::VectorXd BalanceData::term_torque(const Terms& terms, std::size_t t) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows());
  if (!terms[t].adds_torque()) return sum;
  if (terms[t].scaled_by_none()) {
    std::string key = "whole:";
    append_shapes(key, terms[t]);
    for (const Term& other : terms)
      if (changes(other, terms[t])) append_shapes(key, other);
    if (const auto found = cache_.find(key); found != cache_.end()) return found->second;
    if (cache_.size() * static_cast<std::size_t>(rows()) > kCachedNumbers) cache_.clear();
    const auto all = values_of_all(terms);
    return cache_
        .emplace(key, along_rows(1,
                                 [&](const RowRange& range, std::size_t, std::span<double> signal) {
                                   add_torque<Real>(terms, terms[t], terms[t].values, prepared_->records[range.record],
                                                    all, signal);
                                 }))
        .first->second;
  }
  for (std::size_t p = 0; p < terms[t].values.size(); ++p)
    if (terms[t].entry->parameters[p].kind == Kind::linear) sum += terms[t].values[p] * column(terms, {t, p});
  return sum;
}

}  // namespace flexspline::regression
