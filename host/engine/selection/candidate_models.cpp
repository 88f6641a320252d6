#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/policy.hpp"

#include <fmt/format.h>

#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/physics/catalogue/order_causes.hpp"

namespace flexspline::selection {

bool moves_both_ways(const RegressionProblem& data) {
  const std::vector<estimation::Record>& records = data.prepared().records;
  const auto is_held_out = [&](const estimation::RowRange& range) {
    return records[range.record].experiment->role == data::Role::holdout;
  };
  // What is fitted has to show the directions. Where all is held out, all is fitted.
  const bool all_held_out = std::all_of(data.records().begin(), data.records().end(), is_held_out);
  int forward_only = 0, backward_only = 0;
  for (const auto& range : data.records()) {
    if (is_held_out(range) && !all_held_out) continue;
    const estimation::Record& r = records[range.record];
    if (r.at_rest) return true;
    double forward = 0.0, backward = 0.0;
    for (const std::size_t k : r.rows[estimation::index(data.balance())].samples) {
      const double v = r.direction_variable(data.balance(), k);
      (v > 0.0 ? forward : backward) += v != 0.0 ? 1.0 : 0.0;
    }
    if (std::min(forward, backward) >= kPolicy.least_direction_share * (forward + backward) && forward + backward > 0.0)
      return true;
    (forward > backward ? forward_only : backward_only) += 1;
  }
  return std::min(forward_only, backward_only) >= kPolicy.fewest_one_way_records;
}

namespace {

using effects::Kind;
using effects::Phase;
using estimation::RegressionProblem;
using estimation::Term;
using estimation::Terms;

bool has(const Terms& terms, std::string_view name) {
  return std::any_of(terms.begin(), terms.end(), [&](const Term& t) { return t.entry->name() == name; });
}

bool replaced_in(const Terms& terms, const catalogue::Entry& entry) {
  const auto names = catalogue::split_names(entry.info->replaces);
  return std::any_of(names.begin(), names.end(), [&](std::string_view n) { return has(terms, n); });
}

// The model has the effect, or one that takes its place.
bool replaces_it(const Terms& terms, std::string_view name) {
  return has(terms, name) || std::any_of(terms.begin(), terms.end(), [&](const Term& t) {
           return catalogue::names_contain(t.entry->info->replaces, name);
         });
}

// All torques of the motor balance could be scaled by one factor, unless one of them is known: a parameter that the
// user gave, or the torque of a loaded sensor.
bool knows_torque_scale(const RegressionProblem& data, const Terms& terms) {
  if (states_a_torque(terms)) return true;
  if (!data.prepared().output_signals.torque) return false;
  double sensor = 0.0, effort = 0.0;
  for (const auto& range : data.records()) {
    const estimation::Record& r = data.prepared().records[range.record];
    for (std::size_t k = 0; k < r.inputs.size() && !r.effort.empty(); ++k) {
      sensor += r.inputs.torque_at(k) * r.inputs.torque_at(k);
      effort += r.effort[k] * r.effort[k];
    }
  }
  return std::sqrt(sensor) > kPolicy.least_loaded_share * data.prepared().constants.gear_ratio * std::sqrt(effort);
}

// Something in the model already has this effect's place.
bool covered(const Terms& terms, const catalogue::Entry& entry) {
  return std::any_of(terms.begin(), terms.end(),
                     [&](const Term& t) { return catalogue::names_contain(t.entry->info->replaces, entry.name()); });
}

bool visible(const RegressionProblem& data, const Terms& terms, const catalogue::Entry& entry) {
  const unsigned reads = entry.info->reads;
  const estimation::PreparedData& p = data.prepared();
  const bool has_torque =
      p.output_signals.torque || std::any_of(p.records.begin(), p.records.end(),
                                             [](const estimation::Record& r) { return !r.inputs.torque.empty(); });
  if ((reads & effects::kTorque) && !has_torque) return false;
  const bool is_of_sensor = (reads & effects::kTorque) && entry.info->balance == estimation::Balance::transmission;
  if (is_of_sensor && !p.output_signals.torque) return false;
  if ((reads & effects::kCurrent) && !p.effort_is_current) return false;
  if ((reads & effects::kTorqueInput) && p.effort_is_current) return false;
  if ((reads & effects::kTorqueScale) && !knows_torque_scale(data, terms)) return false;
  if ((reads & effects::kBothDirections) && !moves_both_ways(data)) return false;
  const auto any = [&](auto what) {
    return std::any_of(data.records().begin(), data.records().end(),
                       [&](const estimation::RowRange& range) { return what(p.records[range.record]); });
  };
  // Behind a rigid gear the output's motion is proportional to the motor's, so its effects are confounded with the
  // motor's.
  if ((reads & effects::kOutputMotion) && !(reads & effects::kOutputAngle) &&
      !any([](const estimation::Record& r) { return r.has_output_motion; }))
    return false;
  if ((reads & effects::kOutputAngle) && !p.rotary) return false;
  if (reads & effects::kTemperature) {
    double low = 1e300, high = -1e300;
    for (const auto& range : data.records()) {
      const estimation::Record& r = p.records[range.record];
      if (!r.has_temperature) return false;
      for (std::size_t k = 0; k < r.inputs.size(); ++k) {
        low = std::min(low, r.inputs.temperature_at(k));
        high = std::max(high, r.inputs.temperature_at(k));
      }
    }
    if (high - low < kPolicy.least_temperature_span) return false;
  }
  return true;
}

// The range of angles of the record that has the largest one, in turns of the motor.
double largest_range_in_turns(const estimation::PreparedData& prepared) {
  double largest = 0.0;
  for (const estimation::Record& r : prepared.records) {
    if (r.inputs.angle.empty()) continue;
    double low = 1e300, high = -1e300;
    for (std::size_t k = 0; k < r.inputs.size(); k += r.decimation) {
      low = std::min(low, r.inputs.angle_at(k));
      high = std::max(high, r.inputs.angle_at(k));
    }
    largest = std::max(largest, high - low);
  }
  return largest * prepared.constants.turn_angle_scale / (2.0 * std::numbers::pi);
}

// The orders with the largest waves in the residual. Waves are not filtered: the filter costs much and hardly changes
// the ranking. Where the motor hardly turns, waves of all orders resemble the model's offset, so only their orthogonal
// part counts.
std::vector<double> likely_orders(const RegressionProblem& data, const catalogue::Entry& entry,
                                  const Unexplained& left) {
  std::vector<std::pair<double, double>> found;  // minus the decrease, order
  std::vector<effects::Inputs<catalogue::Real>> rows;
  for (const auto& range : data.records()) {
    const estimation::Record& r = data.prepared().records[range.record];
    for (const std::size_t k : r.rows[estimation::index(data.balance())].samples) rows.push_back(r.inputs[k]);
  }
  const std::size_t given = static_cast<std::size_t>(std::find_if(entry.parameters.begin(), entry.parameters.end(),
                                                                  [](const auto& p) { return p.kind == Kind::given; }) -
                                                     entry.parameters.begin());
  for (const double order : possible_orders(entry, data.prepared())) {
    Eigen::MatrixXd waves(left.residual.size(), 0);
    for (std::size_t p = 0; p < entry.parameters.size(); ++p) {
      if (p == given) continue;
      std::vector<double> values(entry.parameters.size(), 0.0), wave(rows.size(), 0.0);
      values[given] = order;
      values[p] = 1.0;
      if (entry.info->phase == Phase::shift) {
        // It changes the torsion; a stiffness turns that into a torque.
        auto shifted = rows;
        entry.real.change(values.data(), data.prepared().constants, shifted);
        for (std::size_t k = 0; k < rows.size(); ++k) wave[k] = shifted[k].torsion - rows[k].torsion;
      } else {
        entry.real.torque(values.data(), data.prepared().constants, data.balance(), rows, wave.data());
      }
      waves.conservativeResize(Eigen::NoChange, waves.cols() + 1);
      waves.rightCols(1) =
          left.root_weights.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(wave.data(), left.residual.size()));
    }
    if (left.own.cols() > 0) waves -= left.own * (left.own.transpose() * waves);
    const Eigen::VectorXd explained = waves * algebra::PivotedQr(waves).solve(left.residual);
    found.emplace_back(-explained.squaredNorm(), order);
  }
  std::sort(found.begin(), found.end());
  std::vector<double> orders;
  for (std::size_t i = 0; i < kPolicy.orders_tried; ++i) orders.push_back(found[i].second);
  // Where these data hardly distinguish orders, the usual one of such effects is tried, too; another balance may
  // decide.
  for (std::size_t i = kPolicy.orders_tried; i < found.size(); ++i)
    if (found[i].second == entry.parameters[given].usual &&
        found[i].first <= kPolicy.usual_order_share * found[0].first)
      orders.push_back(found[i].second);
  std::sort(orders.begin(), orders.end());
  return orders;
}

// Inputs of a sample in motion with its direction as a pure sign. Smoothed over the noise of the velocity it would
// leave a small part of what acts the other way.
effects::Inputs<catalogue::Real> with_sign(effects::Inputs<catalogue::Real> in, Balance balance, double sign) {
  (balance == Balance::motor  ? in.direction
   : balance == Balance::load ? in.output_direction
                              : in.torsion_direction) = sign;
  return in;
}

// Linear parameters of which one unit adds no torque at any of these samples; nonlinear ones are in the middle of their
// range.
std::vector<std::size_t> without_torque(const RegressionProblem& data, const Term& added,
                                        const std::vector<effects::Inputs<catalogue::Real>>& samples) {
  std::vector<double> middle = added.values;
  for (std::size_t p = 0; p < middle.size(); ++p) {
    if (added.free_linear(p)) middle[p] = 0.0;
    if (added.free_nonlinear(p))
      middle[p] = begins_at_zero(added, p) ? 0.0 : estimation::parameter_range(data, added, p).at(0.5);
  }
  std::vector<std::size_t> unseen;
  for (std::size_t p = 0; p < middle.size(); ++p) {
    if (!added.free_linear(p)) continue;
    std::vector<double> values = middle, torque(samples.size(), 0.0);
    values[p] = 1.0;
    added.entry->real.torque(values.data(), data.prepared().constants, data.balance(), samples, torque.data());
    if (std::all_of(torque.begin(), torque.end(), [](double t) { return t == 0.0; })) unseen.push_back(p);
  }
  return unseen;
}

}  // namespace

std::size_t free_count(const Terms& terms) {
  std::size_t count = 0;
  for (const Term& t : terms)
    for (std::size_t p = 0; p < t.known.size(); ++p) count += t.known[p] ? 0 : 1;
  return count;
}

bool is_each_records_own(const catalogue::Entry& entry) {
  return std::any_of(entry.parameters.begin(), entry.parameters.end(), [](const auto& p) { return p.per_record; });
}

bool may_be_seen(const RegressionProblem& data, const Terms& terms, const catalogue::Entry& entry) {
  if (!visible(data, terms, entry) || covered(terms, entry)) return false;
  if (!entry.info->replaces.empty() && !replaced_in(terms, entry)) return false;
  if (!entry.info->modulates.empty() && !replaces_it(terms, entry.info->modulates)) return false;
  return entry.count(Kind::given) > 0 || !has(terms, entry.name());
}

void leave_out_unseen_direction(const RegressionProblem& data, Terms& terms) {
  Term& added = terms.back();
  const catalogue::Entry& entry = *added.entry;
  if (entry.has_state || entry.info->phase != Phase::source || !(entry.info->reads & effects::kDirection)) return;
  // Calls work(record, sample, velocity) for each sample in motion that is fitted on.
  const auto each_in_motion = [&](const auto& work) {
    for (const auto& range : data.records()) {
      const estimation::Record& r = data.prepared().records[range.record];
      if (r.at_rest || r.experiment->role == data::Role::holdout) continue;
      for (const std::size_t k : r.rows[estimation::index(data.balance())].samples)
        if (const double v = r.direction_variable(data.balance(), k); v != 0.0) work(r, k, v);
    }
  };
  double forward = 0.0, backward = 0.0;
  each_in_motion([&](const estimation::Record&, std::size_t, double v) { (v > 0.0 ? forward : backward) += 1.0; });
  if (std::min(forward, backward) > kPolicy.one_way_share * (forward + backward) || forward == backward) return;
  const double sign = forward > backward ? 1.0 : -1.0;
  std::vector<effects::Inputs<catalogue::Real>> seen;
  each_in_motion([&](const estimation::Record& r, std::size_t k, double v) {
    if (v * sign > 0.0) seen.push_back(with_sign(r.inputs[k], data.balance(), sign));
  });
  const std::vector<std::size_t> unseen = without_torque(data, added, seen);
  if (unseen.size() == entry.count(Kind::linear)) return;  // another cause than the direction
  for (const std::size_t p : unseen) {
    added.known[p] = 1;
    added.values[p] = 0.0;
  }
}

bool states_a_torque(const Terms& terms) {
  for (const Term& t : terms)
    for (std::size_t p = 0; p < t.known.size(); ++p)
      if (t.known[p] && t.entry->parameters[p].kind == Kind::linear && t.values[p] != 0.0) return true;
  return false;
}

bool has_phase_error(const Terms& terms, const catalogue::Entry& entry, std::optional<double> order) {
  return order && std::any_of(terms.begin(), terms.end(), [&](const Term& t) {
           const auto given = std::find_if(t.entry->parameters.begin(), t.entry->parameters.end(),
                                           [](const auto& p) { return p.kind == Kind::given; });
           return given != t.entry->parameters.end() &&
                  t.values[static_cast<std::size_t>(given - t.entry->parameters.begin())] == *order &&
                  (catalogue::names_contain(entry.info->phase_error_of, t.entry->name()) ||
                   catalogue::names_contain(t.entry->info->phase_error_of, entry.name()));
         });
}

std::vector<double> possible_orders(const catalogue::Entry& entry, const estimation::PreparedData& prepared) {
  std::vector<double> orders;
  for (const double order : catalogue::orders_of_output(entry, prepared.drive))
    if (largest_range_in_turns(prepared) * order >= kPolicy.least_range_of_cycle) orders.push_back(order);
  for (int order = 1; order <= kPolicy.highest_order; ++order) orders.push_back(order);
  for (const double order : catalogue::orders_of_motor(entry, prepared.drive))
    if (order > kPolicy.highest_order) orders.push_back(order);
  return orders;
}

Terms extend(const Terms& terms, const catalogue::Entry& entry, std::optional<double> order) {
  const bool ordered = entry.count(Kind::given) > 0;
  for (const Term& t : terms)
    if (t.entry->name() == entry.name() && (!ordered || t.label() == estimation::candidate_term(entry, order).label()))
      throw model::ModelError(fmt::format("the model has {} already; remove it first, or identify again", t.label()));
  if (!entry.info->modulates.empty() && !replaces_it(terms, entry.info->modulates))
    throw model::ModelError(fmt::format("{} scales {}, which the model does not have; add that first", entry.name(),
                                        entry.info->modulates));
  Terms extended;
  for (const Term& t : terms)
    if (!catalogue::names_contain(entry.info->replaces, t.entry->name())) extended.push_back(t);
  Term term = estimation::candidate_term(entry, order);
  const bool taken = std::any_of(terms.begin(), terms.end(), [&](const Term& t) { return t.id == term.id; });
  if (taken) term.id = fmt::format("{}_{:g}", entry.name(), order.value_or(0.0));
  extended.push_back(std::move(term));
  return extended;
}

bool begins_at_zero(const Term& term, std::size_t p) {
  const auto& info = term.entry->parameters[p];
  return info.low < 0.0 && info.per.empty() && term.entry->info->phase != Phase::modulate;
}

std::vector<CandidateModel> candidate_models(const RegressionProblem& data, const Terms& terms,
                                             const Unexplained& left) {
  std::vector<CandidateModel> list;
  const bool collapsed = !data.prepared().output_signals.torque && data.balance() == estimation::Balance::motor;
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (entry.identified_on() != data.balance() && !collapsed) continue;
    if (!may_be_seen(data, terms, entry)) continue;
    const bool ordered = entry.count(Kind::given) > 0;
    // Orders are per turn: a linear axis has turns where its pitch is known.
    const bool turns = data.prepared().rotary || data.prepared().constants.turn_angle_scale != 1.0;
    if (ordered && !turns) continue;
    const std::vector<double> orders = ordered ? likely_orders(data, entry, left) : std::vector<double>{0.0};
    for (const double order : orders) {
      CandidateModel model;
      model.entry = &entry;
      if (ordered) model.order = order;
      if (has_phase_error(terms, entry, model.order)) continue;
      if (ordered && std::any_of(terms.begin(), terms.end(), [&](const Term& t) {
            return t.entry == &entry && t.label() == estimation::candidate_term(entry, order).label();
          }))
        continue;
      model.terms = extend(terms, entry, model.order);
      Term& added = model.terms.back();
      for (std::size_t p = 0; p < added.values.size(); ++p)
        if (added.free_nonlinear(p))
          added.values[p] = begins_at_zero(added, p) ? 0.0 : estimation::parameter_range(data, added, p).at(0.5);
      leave_out_unseen_direction(data, model.terms);
      estimation::set_grid_values(data, model.terms, {model.terms.size() - 1});
      model.added = static_cast<double>(free_count(model.terms)) - static_cast<double>(free_count(terms));
      list.push_back(std::move(model));
    }
  }
  return list;
}

}  // namespace flexspline::selection
