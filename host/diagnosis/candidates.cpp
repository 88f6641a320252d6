#include "host/diagnosis/candidates.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/regression/shapes.hpp"

namespace flexspline::diagnosis {
namespace {

using effects::Kind;
using effects::Phase;
using regression::BalanceData;
using regression::Term;
using regression::Terms;

// Orders of ripple that gears and motors make: the wave generator's, and slots, poles and bearings up to two dozen.
constexpr int kHighestOrder = 24;
// Less variation than that shows no effect of temperature.
constexpr double kTemperatureSpan = 3.0;

bool has(const Terms& terms, std::string_view name) {
  return std::any_of(terms.begin(), terms.end(), [&](const Term& t) { return t.entry->name() == name; });
}

bool replaced_in(const Terms& terms, const catalogue::Entry& entry) {
  const auto names = catalogue::split_names(entry.info->replaces);
  return std::any_of(names.begin(), names.end(), [&](std::string_view n) { return has(terms, n); });
}

// Something in the model already stands in for this effect.
bool covered(const Terms& terms, const catalogue::Entry& entry) {
  return std::any_of(terms.begin(), terms.end(),
                     [&](const Term& t) { return catalogue::names_contain(t.entry->info->replaces, entry.name()); });
}

bool visible(const BalanceData& data, const catalogue::Entry& entry) {
  const unsigned reads = entry.info->reads;
  const regression::Prepared& p = data.prepared();
  if ((reads & effects::kTorque) && !p.torque_measured) return false;
  if ((reads & effects::kCurrent) && !p.effort_is_current) return false;
  if ((reads & effects::kTorqueInput) && p.effort_is_current) return false;
  const auto any = [&](auto what) {
    return std::any_of(data.records().begin(), data.records().end(),
                       [&](const regression::RowRange& range) { return what(p.records[range.record]); });
  };
  // Behind a rigid gear the output's motion is the motor's, and so are its effects.
  if ((reads & effects::kOutputMotion) && !(reads & effects::kOutputAngle) &&
      !any([](const regression::Record& r) { return r.has_output_motion; }))
    return false;
  if ((reads & effects::kOutputAngle) && !p.rotary) return false;
  if (reads & effects::kTemperature) {
    double low = 1e300, high = -1e300;
    for (const auto& range : data.records()) {
      const regression::Record& r = p.records[range.record];
      if (!r.has_temperature) return false;
      for (const auto& in : r.inputs) {
        low = std::min(low, in.temperature);
        high = std::max(high, in.temperature);
      }
    }
    if (high - low < kTemperatureSpan) return false;
  }
  return true;
}

std::size_t free_count(const Terms& terms) {
  std::size_t count = 0;
  for (const Term& t : terms)
    for (std::size_t p = 0; p < t.known.size(); ++p) count += t.known[p] ? 0 : 1;
  return count;
}

}  // namespace

Terms extend(const Terms& terms, const catalogue::Entry& entry, std::optional<double> order) {
  const bool ordered = entry.count(Kind::given) > 0;
  for (const Term& t : terms)
    if (t.entry->name() == entry.name() && (!ordered || t.label() == regression::candidate_term(entry, order).label()))
      throw model::ModelError(fmt::format("the model has {} already; remove it first, or identify again", t.label()));
  if (!entry.info->modulates.empty() && !has(terms, entry.info->modulates))
    throw model::ModelError(fmt::format("{} scales {}, which the model does not have; add that first", entry.name(),
                                        entry.info->modulates));
  Terms extended;
  for (const Term& t : terms)
    if (!catalogue::names_contain(entry.info->replaces, t.entry->name())) extended.push_back(t);
  Term term = regression::candidate_term(entry, order);
  const bool taken = std::any_of(terms.begin(), terms.end(), [&](const Term& t) { return t.id == term.id; });
  if (taken) term.id = fmt::format("{}_{:g}", entry.name(), order.value_or(0.0));
  extended.push_back(std::move(term));
  return extended;
}

std::vector<Proposal> proposals(const BalanceData& data, const Terms& terms) {
  std::vector<Proposal> list;
  const bool collapsed = !data.prepared().torque_measured && data.balance() == regression::Balance::motor;
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (entry.info->balance != data.balance() && !collapsed) continue;
    if (!visible(data, entry) || covered(terms, entry)) continue;
    if (!entry.info->replaces.empty() && !replaced_in(terms, entry)) continue;
    if (!entry.info->modulates.empty() && !has(terms, entry.info->modulates)) continue;
    const bool ordered = entry.count(Kind::given) > 0;
    if (!ordered && has(terms, entry.name())) continue;
    // Orders are counted by turn: a linear axis has turns where its pitch is known.
    const bool turns = data.prepared().rotary || data.prepared().constants.turn_angle_scale != 1.0;
    if (ordered && !turns) continue;
    for (int order = 1; order <= (ordered ? kHighestOrder : 1); ++order) {
      Proposal proposal;
      proposal.entry = &entry;
      if (ordered) proposal.order = order;
      if (ordered && std::any_of(terms.begin(), terms.end(), [&](const Term& t) {
            return t.entry == &entry && t.label() == regression::candidate_term(entry, order).label();
          }))
        continue;
      proposal.extended = extend(terms, entry, proposal.order);
      Term& added = proposal.extended.back();
      for (std::size_t p = 0; p < added.values.size(); ++p)
        if (added.free_shape(p)) added.values[p] = regression::shape_range(data, added, p).at(0.5);
      proposal.added = static_cast<double>(free_count(proposal.extended)) - static_cast<double>(free_count(terms));
      list.push_back(std::move(proposal));
    }
  }
  return list;
}

}  // namespace flexspline::diagnosis
