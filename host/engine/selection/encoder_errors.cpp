#include "host/engine/selection/encoder_errors.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

constexpr double kOrdersOfOutput[] = {1.0, 2.0};  // an eccentric disc, and one that is bent or tilted

// What an encoder's error does: it shifts the torsion by a constant, or by waves over the angle.
bool is_error_of_angle(const catalogue::Entry& entry) {
  return entry.identified_on() == estimation::Balance::transmission && entry.info->phase == effects::Phase::shift &&
         (is_each_records_own(entry) || entry.count(effects::Kind::given) > 0);
}

// The model with a zero of the torsion, and with waves once and twice per turn of the output, as far as each of the two
// lowers the error significantly.
CrossValidatedFit with_encoder_errors(const BalanceSearch& own) {
  CrossValidatedFit fit = own.base;
  for (const bool zero : {true, false}) {
    Terms terms = fit.terms;
    for (const catalogue::Entry& entry : catalogue::all()) {
      if (!is_error_of_angle(entry) || is_each_records_own(entry) != zero) continue;
      for (const double order : kOrdersOfOutput) {
        const std::optional<double> per_turn =
            zero ? std::nullopt : std::optional(order / own.data->prepared().constants.gear_ratio);
        try {
          terms = extend(terms, entry, per_turn);
        } catch (const model::ModelError&) {
          continue;  // the model has it already
        }
      }
    }
    if (terms.size() == fit.terms.size()) continue;
    const auto more = static_cast<double>(free_count(terms) - free_count(fit.terms));
    CrossValidatedFit next = cross_validate(*own.data, std::move(terms), own.keep);
    const LikelihoodGain gain = likelihood_gain(fit, next, more);
    if (gain.score > kPolicy.named_score && gain.chi2_percent > kPolicy.named_chi2_percent) fit = std::move(next);
  }
  return fit;
}

// Torque that the encoders' steps make where the gear were a spring alone.
struct TorqueOfSteps {
  double rms = 0.0;
  double largest = 0.0;  // of both angles rounded by half a step
};

TorqueOfSteps torque_of_steps(const RegressionProblem& data) {
  double rms = 0.0, motor_step = 0.0, output_step = 0.0;
  for (const RowRange& range : data.records()) {
    const estimation::Record& record = data.prepared().records[range.record];
    const double motor = record.motor_quantum.value_or(0.0) / data.prepared().constants.gear_ratio;
    const double output = record.output_quantum.value_or(0.0);
    rms = std::max(rms, std::sqrt((motor * motor + output * output) / 12.0));
  }
  // A locked output does not show its steps; it shows them where it moves.
  for (const estimation::Record& record : data.prepared().records) {
    motor_step = std::max(motor_step, record.motor_quantum.value_or(0.0) / data.prepared().constants.gear_ratio);
    output_step = std::max(output_step, record.output_quantum.value_or(0.0));
  }
  const auto variables =
      comparison::sample_variables(data, data.prepared().rotary ? data::Axis::rotary : data::Axis::linear);
  const auto torsion =
      std::find_if(variables.begin(), variables.end(), [](const auto& v) { return v.name == "torsion"; });
  if (torsion == variables.end() || !torsion->values.allFinite()) return {};
  const Eigen::VectorXd x = torsion->values.array() - torsion->values.mean();
  const double stiffness = std::abs(x.dot(data.target())) / std::max(x.squaredNorm(), 1e-300);
  return {stiffness * rms, stiffness * 0.5 * (motor_step + output_step)};
}

// RMS torque that a candidate takes off the residual.
double torque_explained(const BalanceSearch& own, const CandidateFit& t) {
  return std::sqrt(std::max(0.0, std::pow(own.base.rmse_fixed_effects(), 2) - std::pow(t.fit.rmse_fixed_effects(), 2)));
}

// An encoder's error is in the torsion alone: what explains most of another torque balance as well is none.
bool shows_on_others(const CandidateFit& t) {
  return t.other_balance_score > kPolicy.named_score && t.other_balance_percent >= 100.0 * kPolicy.most_share;
}

bool is_same(const CandidateFit& a, const CandidateFit& b) {
  return a.model.entry == b.model.entry && a.model.order == b.model.order;
}

}  // namespace

void check_encoder_errors(const BalanceSearch& own, std::vector<CandidateFit>& candidates) {
  if (own.data->balance() != estimation::Balance::transmission) return;
  const TorqueOfSteps steps = torque_of_steps(*own.data);
  // A constant does not average out as a loop does: rounded angles may be off by as much all the time.
  for (CandidateFit& t : candidates) {
    if (!passes(t) || !is_each_records_own(*t.model.entry) || torque_explained(own, t) >= steps.largest) continue;
    t.admissible = false;
    t.why_not = "it is smaller than half a step of the encoders";
  }
  sort_candidates(own, candidates);
  const auto is_checked = [](const CandidateFit& t) {
    return passes(t) && !t.model.order && !is_error_of_angle(*t.model.entry);
  };
  if (std::none_of(candidates.begin(), candidates.end(), is_checked)) return;
  for (CandidateFit& t : candidates) {
    if (!is_checked(t) || !t.model.entry->has_state || torque_explained(own, t) >= steps.rms) continue;
    t.admissible = false;
    t.why_not = "its loop is smaller than the steps of the encoders";
  }
  const BalanceSearch behind{own.data, own.keep, with_encoder_errors(own), own.floor};
  if (behind.base.terms.size() == own.base.terms.size()) return sort_candidates(own, candidates);
  const std::vector<CandidateFit> again = rank_candidates(behind, [&](const CandidateModel& model) {
    return std::any_of(candidates.begin(), candidates.end(),
                       [&](const CandidateFit& t) { return is_checked(t) && t.model.entry == model.entry; });
  });
  for (CandidateFit& t : candidates) {
    if (!is_checked(t) || shows_on_others(t)) continue;
    const auto at = std::find_if(again.begin(), again.end(), [&](const CandidateFit& a) { return is_same(a, t); });
    if (at != again.end() && is_worth_a_term(behind, *at)) continue;
    t.admissible = false;
    t.why_not = "a zero or an eccentric disc of an encoder explains it as well";
  }
  sort_candidates(own, candidates);
  if (candidates.empty() || again.empty() || !is_checked(candidates.front()) || !is_worth_a_term(behind, again.front()))
    return;
  const auto best = std::find_if(candidates.begin(), candidates.end(),
                                 [&](const CandidateFit& t) { return is_checked(t) && is_same(t, again.front()); });
  if (best != candidates.end()) std::rotate(candidates.begin(), best, best + 1);
}

}  // namespace flexspline::selection
