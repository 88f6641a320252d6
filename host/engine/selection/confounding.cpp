#include "host/engine/selection/confounding.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/comparison/residual_map.hpp"
#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

constexpr std::size_t kBins = 10;
// Fewer bins would alias a ripple to a lower order.
constexpr double kBinsPerWave = 6.0;
constexpr double kRowsPerBin = 8.0;

std::string label_of(const CandidateFit& candidate) {
  return candidate.fit.terms.back().label();
}

data::Axis axis_of(const RegressionProblem& data) {
  return data.prepared().rotary ? data::Axis::rotary : data::Axis::linear;
}

// The part of an effect's torque that is orthogonal to the model, over samples of these weights.
Eigen::VectorXd own_torque(BalanceSearch& search, const CandidateFit& candidate, const Eigen::VectorXd& weights) {
  const estimation::ModelProjection by_model(estimation::model_columns(*search.data, search.base.terms), weights);
  return by_model
      .orthogonal_part(estimation::model_torque(*search.data, candidate.fit.terms) -
                       estimation::model_torque(*search.data, search.base.terms))
      .col(0);
}

std::size_t bins_for(const CandidateFit& candidate, const std::string& variable, Eigen::Index rows) {
  if (!candidate.model.order || !variable.ends_with("angle")) return kBins;
  const double most = static_cast<double>(rows) / kRowsPerBin;
  return std::max(kBins, static_cast<std::size_t>(std::min(kBinsPerWave * std::abs(*candidate.model.order), most)));
}

// The plain variable that a torque depends on most: "speed" of "speed x direction".
std::string variable_of(const RegressionProblem& data, const Eigen::VectorXd& torque) {
  const auto shares = comparison::localise(data, torque, 1.0, axis_of(data));
  for (const comparison::Share& share : shares)
    if (share.variable != "record" && share.variable != "direction")
      return share.variable.substr(0, share.variable.find(" x "));
  return shares.empty() ? "" : shares.front().variable;
}

// `own` is the torque of the first effect, orthogonal to the model.
ConfoundingReason compare(BalanceSearch& search, const Eigen::VectorXd& own, const CandidateFit& second) {
  const RegressionProblem& data = *search.data;
  ConfoundingReason reason;
  reason.effect = label_of(second);
  const estimation::ModelProjection by_confounded(estimation::model_columns(data, second.fit.terms),
                                                  search.base.root_weights);
  // The second may lack an effect that it replaces; that torque is the same for both.
  const Eigen::VectorXd left = by_confounded.orthogonal_part(own).col(0);
  const double whole = search.base.root_weights.cwiseProduct(own).norm();
  reason.own_percent = whole > 0.0 ? 100.0 * search.base.root_weights.cwiseProduct(left).norm() / whole : 0.0;
  reason.variable = variable_of(data, own - left);
  return reason;
}

// Mean of what the model lacks over bins of a variable in which the effect shows most (what resists motion, where that
// shows more), and the torque of the effect in the same bins.
std::optional<Evidence> evidence(BalanceSearch& search, const CandidateFit& candidate, data::Axis axis) {
  const RegressionProblem& data = *search.data;
  // With one friction for all runs: what is missing may pass for friction that differs.
  const Eigen::VectorXd &weights = search.base.root_weights_fixed_effects(),
                        &lacking = search.base.residual_fixed_effects();
  const Eigen::VectorXd own = own_torque(search, candidate, weights);
  const auto shares = comparison::localise(data, own, 1.0, axis);
  const std::vector<comparison::SampleVariable> variables = comparison::sample_variables(data, axis);
  const Eigen::VectorXd directions = comparison::sample_directions(data);
  for (const comparison::Share& share : shares) {
    const std::string name = share.variable.substr(0, share.variable.find(" x "));
    const auto variable =
        std::find_if(variables.begin(), variables.end(), [&](const auto& v) { return v.name == name; });
    if (variable == variables.end()) continue;
    const bool resisting = name != share.variable;
    const comparison::Bins bins =
        comparison::equal_count_bins(variable->values, bins_for(candidate, name, variable->values.size()));
    if (bins.count() < 3) continue;
    Evidence map{name, variable->unit, resisting, share.share_percent, {}};
    for (std::size_t b = 0; b < bins.count(); ++b) {
      Evidence::Bin bin{bins.edges[b], bins.edges[b + 1], 0.0, 0.0};
      double count = 0.0;
      for (Eigen::Index k = 0; k < data.rows(); ++k) {
        if (bins.bin[static_cast<std::size_t>(k)] != static_cast<int>(b) || !(weights[k] > 0.0)) continue;
        const double sign = resisting ? directions[k] : 1.0;
        if (!std::isfinite(sign)) continue;
        bin.lacking += sign * lacking[k];
        bin.effect += sign * own[k];
        count += 1.0;
      }
      if (count == 0.0) continue;
      bin.lacking /= count;
      bin.effect /= count;
      map.bins.push_back(bin);
    }
    return map;
  }
  return std::nullopt;
}

}  // namespace

EffectSize size_of(const BalanceSearch& search, const Eigen::VectorXd& own, const model::Drive& drive) {
  const Eigen::VectorXd& weights = search.base.root_weights;
  EffectSize size;
  double squares = 0.0, rows = 0.0;
  for (Eigen::Index k = 0; k < own.size(); ++k) {
    if (!(weights[k] > 0.0)) continue;
    squares += own[k] * own[k];
    rows += 1.0;
    size.peak = std::max(size.peak, std::abs(own[k]));
  }
  size.rms = rows > 0.0 ? std::sqrt(squares / rows) : 0.0;
  const double gear = search.data->balance() == estimation::Balance::motor ? drive.gear_ratio.value.value_or(1.0) : 1.0;
  if (const auto rated = drive.rated_torque_nm.value; rated && *rated > 0.0)
    size.percent_of_rated = 100.0 * size.rms * gear / *rated;
  return size;
}

ConfoundingReason compare_with_model(BalanceSearch& search, const CandidateFit& candidate) {
  const RegressionProblem& data = *search.data;
  ConfoundingReason reason;
  reason.effect = candidate.confounded_with;
  const estimation::ModelProjection by_model(estimation::model_columns(data, search.base.terms),
                                             search.base.root_weights);
  Terms unit = candidate.fit.terms;
  const std::size_t last = unit.size() - 1;
  Eigen::VectorXd torque = Eigen::VectorXd::Zero(data.rows());
  for (std::size_t p = 0; p < unit[last].values.size(); ++p)
    if (unit[last].free_linear(p)) torque += unit[last].entry->parameters[p].usual * data.column(unit, {last, p});
  reason.own_percent = 100.0 * by_model.orthogonal_share(torque);
  reason.variable = variable_of(data, torque);
  return reason;
}

bool is_scale_confounded(const BalanceSearch& search, const CandidateFit& first, const CandidateFit& second) {
  const unsigned both = first.model.entry->info->reads & second.model.entry->info->reads;
  return (both & effects::kTorqueScale) != 0 && !states_a_torque(search.base.terms);
}

bool is_angle_confounded(const CandidateFit& first, const CandidateFit& second) {
  constexpr unsigned kAngle = effects::kMotorAngle | effects::kOutputAngle;
  constexpr unsigned kMotion = effects::kMotorMotion | effects::kOutputMotion;
  const unsigned reads = second.model.entry->info->reads;
  const bool is_of_angle = (reads & kAngle) != 0 && (reads & ~(kAngle | kMotion)) == 0;
  const bool is_offset =
      (first.model.entry->info->reads & (effects::kBothDirections | kMotion)) == effects::kBothDirections;
  return is_offset && is_of_angle && !second.model.order && passes(first) && passes(second) &&
         second.gain.score >= first.gain.score - kPolicy.confounded_margin;
}

void explain_named(BalanceSearch& search, const std::vector<CandidateFit>& candidates, const model::Drive& drive,
                   Diagnosis& result) {
  const auto candidate_of = [&](const NamedEffect& n) {
    return std::find_if(candidates.begin(), candidates.end(), [&](const CandidateFit& t) {
      return t.model.entry->name() == n.effect && t.model.order == n.order;
    });
  };
  for (Candidate& c : result.candidates)
    for (const NamedEffect& n : result.named) {
      if (c.is_lag || c.effect != n.effect || c.order != n.order || candidate_of(n) == candidates.end()) continue;
      c.evidence = evidence(search, *candidate_of(n), drive.axis);
      const Eigen::VectorXd own = own_torque(search, *candidate_of(n), search.base.root_weights);
      c.size = size_of(search, own, drive);
      if (result.verdict != Verdict::confusable_effects) continue;
      for (const NamedEffect& other : result.named)
        if (&other != &n && candidate_of(other) != candidates.end())
          c.confounding_reasons.push_back(compare(search, own, *candidate_of(other)));
    }
}

}  // namespace flexspline::selection
