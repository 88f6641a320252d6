#include "host/engine/selection/unknown_structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/selection/candidate_fits.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::selection {
namespace {

using effects::Variable;
using estimation::Balance;
using estimation::LearnedTable;
using estimation::TableSpecification;

constexpr std::size_t kScreenedPoints = 24;
constexpr std::size_t kLearned = 3;  // signals whose curves are learnt in full

struct ScreenedCurve {
  TableSpecification specification;
  std::string label;
  LearnedTable curve;
};

std::string label_of(const TableSpecification& q) {
  for (const effects::VariableInfo& v : effects::kVariables)
    if (v.variable == q.variable) return fmt::format("{}{}", v.name, q.times_direction ? "*direction" : "");
  return {};
}

bool measured(const RegressionProblem& data, const effects::VariableInfo& v) {
  const estimation::PreparedData& p = data.prepared();
  const auto all = [&](auto has) {
    return std::all_of(data.records().begin(), data.records().end(),
                       [&](const RowRange& range) { return has(p.records[range.record]); });
  };
  if ((v.reads & effects::kTorque) && !p.output_signals.torque) return false;
  if ((v.reads & effects::kCurrent) && !p.effort_is_current) return false;
  if ((v.reads & effects::kTemperature) && !all([](const auto& r) { return r.has_temperature; })) return false;
  if ((v.reads & effects::kOutputMotion) && !all([](const auto& r) { return r.has_output_motion; })) return false;
  if ((v.reads & effects::kTorsion) && !all([](const auto& r) { return r.has_output_motion && r.has_motor_motion; }))
    return false;
  const bool turns = p.rotary || p.constants.turn_angle_scale != 1.0;
  if (v.variable == Variable::motor_angle && !turns) return false;
  return v.variable != Variable::output_angle || p.rotary;
}

// The current is the left side of the motor balance, the torque that of the others: a curve over it would explain
// itself. The motions of both sides are collinear, so each balance uses its own.
bool belongs(Balance balance, const effects::VariableInfo& v) {
  if (v.variable == Variable::temperature || v.variable == Variable::motor_angle ||
      v.variable == Variable::output_angle)
    return true;
  switch (balance) {
    case Balance::motor:
      return v.variable != Variable::current && (v.reads & effects::kOutputMotion) == 0;
    case Balance::transmission:
      return (v.reads & (effects::kTorsion | effects::kCurrent)) != 0;
    case Balance::load:
      return (v.reads & effects::kOutputMotion) != 0;
  }
  return false;
}

// Signals that a curve may run over on this balance: measured, varying, and not the left side itself.
// A torque with noise of its sensor is on that side, too.
std::vector<TableSpecification> table_specifications(const RegressionProblem& data, const Terms& model,
                                                     bool torque_has_noise) {
  std::vector<TableSpecification> list;
  for (const effects::VariableInfo& v : effects::kVariables) {
    if (!measured(data, v)) continue;
    if (!belongs(data.balance(), v) || (torque_has_noise && (v.reads & effects::kTorque) != 0)) continue;
    const Eigen::VectorXd signal = data.evaluator().signal_at_rows(model, v.variable);
    const estimation::SignalRange range = estimation::central_range(signal);
    const double span = range.high - range.low;
    if (!(span > 0.0) || (v.variable == Variable::temperature && span < kPolicy.least_temperature_span)) continue;
    // Over a part of a turn the curve over an angle is not periodic.
    for (const bool times_direction : {false, true}) {
      TableSpecification q;
      q.variable = v.variable;
      q.times_direction = times_direction;
      q.balance = data.balance();
      q.delay_too = true;
      list.push_back(q);
    }
  }
  return list;
}

// Those that the data identify, in the order of the specifications; learnt on all cores.
std::vector<ScreenedCurve> curves(const RegressionProblem& data, const Terms& model,
                                  const std::vector<TableSpecification>& specifications,
                                  const Eigen::VectorXd& weights) {
  std::vector<std::optional<LearnedTable>> learned(specifications.size());
  estimation::in_parallel(specifications.size(), [&](std::size_t i) {
    learned[i] = estimation::learn_table(data, model, specifications[i], weights);
  });
  std::vector<ScreenedCurve> list;
  for (std::size_t i = 0; i < specifications.size(); ++i)
    if (learned[i]) list.push_back({specifications[i], label_of(specifications[i]), std::move(*learned[i])});
  return list;
}

bool is_significant(const LearnedTable& curve) {
  return curve.score > kPolicy.curve_score && curve.decrease_percent > kPolicy.curve_chi2_percent;
}

// The visited point at which the curve is least certain, and the signals that are collinear with it.
std::string next_record(const UnknownStructure& unknown, const data::Axis axis) {
  const model::Table& table = unknown.curve.table;
  const effects::VariableInfo& v = *catalogue::find_variable(unknown.definition.variable);
  std::size_t widest = 0;
  for (std::size_t k = 0; k < table.std.size(); ++k)
    if (table.std[k] > table.std[widest]) widest = k;
  const auto unit = catalogue::unit_on(v.unit, axis);
  std::string text = fmt::format(
      "slow motion back and forth over {} from {:.3g} to {:.3g} {}, most of all around {:.3g} {}, where the curve is "
      "least certain",
      v.name, table.at.front(), table.at.back(), unit, table.at[widest], unit);
  std::string others;
  for (std::size_t k = 1; k < unknown.depends_on.size() && k < 3; ++k)
    if (unknown.depends_on[k].decrease_percent > 0.5 * unknown.depends_on.front().decrease_percent &&
        unknown.depends_on[k].variable.substr(0, unknown.depends_on[k].variable.find('*')) != v.name)
      others += fmt::format("{}{}", others.empty() ? "" : " and ", unknown.depends_on[k].variable);
  if (!others.empty()) text += fmt::format("; and a motion in which {} and {} are not correlated", v.name, others);
  return text + "; then the same at another load or temperature, to check whether the curve remains the same";
}

}  // namespace

std::optional<UnknownStructure> find_unknown_structure(BalanceSearch& search, const Terms& model,
                                                       bool torque_has_noise) {
  const RegressionProblem& data = *search.data;
  const Eigen::VectorXd weights = search.base.root_weights.cwiseProduct(search.keep);
  std::vector<TableSpecification> specifications = table_specifications(data, model, torque_has_noise);
  for (TableSpecification& q : specifications) {
    // Without the filter a curve costs little, and serves to distinguish signals.
    q.filtered = false;
    q.most_points = kScreenedPoints;
    q.exactly = true;
  }
  std::vector<ScreenedCurve> list = curves(data, model, specifications, weights);
  const auto more = [](const ScreenedCurve& a, const ScreenedCurve& b) {
    return a.curve.decrease_percent > b.curve.decrease_percent;
  };
  std::sort(list.begin(), list.end(), more);
  if (list.empty() || !(list.front().curve.score > 0.0)) return std::nullopt;
  specifications.clear();
  for (std::size_t k = 0; k < std::min(kLearned, list.size()); ++k) {
    specifications.push_back(list[k].specification);
    specifications.back().filtered = true;
    specifications.back().exactly = false;
    specifications.back().most_points = 128;
  }
  std::vector<ScreenedCurve> learned = curves(data, model, specifications, weights);
  if (learned.empty()) return std::nullopt;
  std::sort(learned.begin(), learned.end(), more);
  const ScreenedCurve* best = &learned.front();
  for (const ScreenedCurve& s : learned)
    if (100.0 - s.curve.decrease_percent <
            (1.0 + kPolicy.simpler_curve) * (100.0 - learned.front().curve.decrease_percent) &&
        s.curve.effective_degrees_of_freedom < best->curve.effective_degrees_of_freedom)
      best = &s;
  if (!is_significant(best->curve)) return std::nullopt;
  // No structure of a drive bends over the acceleration, but noise and delay of the position do, which the error has
  // in proportion to the inertia, and the acceleration twice differentiated.
  if (best->specification.variable == Variable::acceleration) return std::nullopt;
  UnknownStructure unknown;
  unknown.effect = fmt::format("{}:{}", catalogue::kTableEffect, best->label);
  unknown.definition = *estimation::effect_of(best->specification, best->curve.table, "unknown").definition;
  unknown.curve = best->curve;
  unknown.depends_on.push_back({best->label, best->curve.decrease_percent});
  for (const ScreenedCurve& s : list)
    if (s.label != best->label && s.curve.score > kPolicy.curve_score)
      unknown.depends_on.push_back({s.label, s.curve.decrease_percent});
  unknown.record_next = next_record(unknown, data.prepared().rotary ? data::Axis::rotary : data::Axis::linear);
  return unknown;
}

namespace {

// The model with the curve in it, cross-validated as candidates are.
CrossValidatedFit with_curve(BalanceSearch& search, const UnknownStructure& unknown) {
  model::Effect effect;
  effect.type = std::string(catalogue::kTableEffect);
  effect.id = "unknown";
  effect.definition = unknown.definition;
  Terms terms = search.base.terms;
  terms.push_back(estimation::term_of(effect));
  return cross_validate(*search.data, std::move(terms), search.keep);
}

// What the named effects explain of what the curve explains, by the squares of left-out samples; one where the curve
// does not explain more for certain.
double share_of(const CrossValidatedFit& base, const CrossValidatedFit& named, const CrossValidatedFit& curve,
                double more_numbers) {
  const LikelihoodGain of_named = likelihood_gain(named, curve, std::max(0.0, more_numbers));
  if (of_named.score < kPolicy.curve_score) return 1.0;
  // In units of the base's squares.
  const double with_curve = 1.0 - likelihood_gain(base, curve, 0.0).chi2_percent / 100.0;
  const double with_named = with_curve / std::max(1.0 - of_named.chi2_percent / 100.0, 1e-12);
  return with_curve < 1.0 ? (1.0 - with_named) / (1.0 - with_curve) : 1.0;
}

// Whether halves of the data choose the effect as well, and experiments that are held out confirm it.
bool is_chosen_and_confirmed(const Diagnosis& result, const CandidateFit& named) {
  if (!result.resampling) return false;
  const NamedEffect name{std::string(named.model.entry->name()), named.model.order};
  return std::any_of(result.resampling->found.begin(), result.resampling->found.end(), [&](const auto& found) {
    return found.is_strongly_confirmed() &&
           std::any_of(found.group.begin(), found.group.end(), [&](const auto& n) { return is_of_family(n, name); });
  });
}

}  // namespace

void check_unknown_structure(BalanceSearch& search, const CandidateFit* named, Diagnosis& result) {
  auto unknown =
      find_unknown_structure(search, search.base.terms, result.resampling && result.resampling->torque_has_noise);
  if (!unknown) return;
  if (named) {
    const CrossValidatedFit curve = with_curve(search, *unknown);
    const auto share = [&](const CandidateFit& candidate, double numbers) {
      return share_of(search.base, candidate.fit, curve, unknown->curve.effective_degrees_of_freedom - numbers);
    };
    unknown->named_share_percent = 100.0 * share(*named, named->model.added);
    if (*unknown->named_share_percent >= 100.0 * kPolicy.curve_recovered) return;
    // Two effects of the catalogue may explain it together.
    BalanceSearch next{search.data, search.keep, named->fit};
    const std::vector<CandidateFit> more = rank_candidates(next);
    if (!more.empty() && passes(more.front()) &&
        share(more.front(), named->model.added + more.front().model.added) >= kPolicy.recovered_by_two)
      return;
    // The curve then shows what else is missing.
    if (is_chosen_and_confirmed(result, *named)) {
      result.partial = true;
      return;
    }
    result.named.clear();
    result.recovered_percent.reset();
    result.remaining_structure = result.localised;
  } else if (likelihood_gain(search.base, with_curve(search, *unknown), unknown->curve.effective_degrees_of_freedom)
                 .score < kPolicy.curve_score) {
    // A curve that only one or two records show is their own friction.
    return;
  }
  result.verdict = Verdict::unknown_structure;
  result.unknown = std::move(unknown);
}

}  // namespace flexspline::selection
