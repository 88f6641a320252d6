#include "host/engine/selection/named_delay.hpp"

#include <algorithm>
#include <cmath>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/estimation/model_projection.hpp"
#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/selection/confounding.hpp"
#include "host/engine/selection/described_candidates.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

// What a fit leaves on experiments that are held out, with its lag or without it.
double held_out_squares(const HeldOut& held_out, const CrossValidatedFit& fit, bool with_lag) {
  Eigen::VectorXd residual = held_out.data->residual(fit.terms);
  if (with_lag) residual -= fit.theta[fit.theta.size() - 1] * held_out.data->delay_column();
  return residual.squaredNorm();
}

// Whether the squared error on held-out experiments falls by what a term must take off from the base model without its
// lag to `with` that of its own. True where none are held out.
bool is_confirmed(const HeldOut* held_out, const CrossValidatedFit& base, const CrossValidatedFit& with) {
  if (!held_out || !held_out->data) return true;
  return held_out_squares(*held_out, with, true) <=
         (1.0 - kPolicy.line_share) * held_out_squares(*held_out, base, false);
}

double counted(const CrossValidatedFit& fit) {
  return static_cast<double>((fit.root_weights.array() > 0.0).count());
}

double longest_sample_s(const SearchedBalance& motor) {
  double longest_s = 0.0;
  for (const estimation::Record& r : motor.search.data->prepared().records) longest_s = std::max(longest_s, r.sample_s);
  return longest_s;
}

// Whether the effort comes before the motion, for certain, and lag and delay raise the RMS error without them by as
// much as a large effect does. `more`: what a delay takes off the squared error beyond the lag, as a share.
bool matters(const Lag& lag, double more, double least_s) {
  return -lag.seconds >= least_s && -lag.seconds <= kPolicy.longest_lag_s &&
         lag.standard_errors >= kPolicy.delay_errors &&
         (1.0 - lag.share) * (1.0 - more) <= 1.0 / std::pow(kPolicy.large_rise, 2);
}

// The delay as a candidate: what the lag of the base model takes off, and a delay beyond it by the share `more`.
void describe_by_lag(const SearchedBalance& motor, const Lag& lag, double more, const model::Drive& drive,
                     const std::optional<Resampling>& resampled, const CandidateFit& candidate, Candidate& delay) {
  const CrossValidatedFit& base = motor.search.base;
  const Eigen::Index last = base.theta.size() - 1;
  delay.is_lag = true;
  delay.note =
      "Each model here has a lag of the effort, so that halves of the data do not choose a delay. Its value, its size "
      "and "
      "its error before are those of the lag; all other errors are with the lag in the model.";
  estimation::Estimate& value = delay.parameters.front();
  const effects::ParameterInfo& info = catalogue::get(delay.effect).parameters.front();
  // The best of all lags is not to first order. Without it, the delay is between the lag and the sum of both in the
  // delay's own fit: uniformly distributed, for all that is known.
  if (resampled && resampled->lag_s && *resampled->lag_s < 0.0) {
    value.value = -*resampled->lag_s;
    set_std(value, *resampled->lag_std_s, info);
  } else {
    const double both = candidate.fit.terms.back().values.front() - lag_of(candidate.fit).seconds;
    value.value = -lag.seconds;
    set_std(value, std::hypot(base.std[last], (both - value.value) / std::sqrt(12.0)), info);
  }
  // The likelihood of one linear parameter, as likelihood_gain() has it.
  const double independent = counted(base) / base.autocorrelation_time;
  const double ratio = -independent * std::log(1.0 - lag.share);
  delay.score = ratio - std::log(std::max(2.0, independent)) + (more > 0.0 ? delay.score : 0.0);
  delay.p_value = numbers::chi_squared_above(1.0, ratio);
  delay.chi2_decrease_percent = 100.0 * (1.0 - (1.0 - lag.share) * (1.0 - more));
  delay.rmse_cv_before /= std::sqrt(1.0 - lag.share);
  const Eigen::MatrixXd columns = estimation::model_columns(*motor.search.data, base.terms);
  const estimation::ModelProjection by_model(columns.leftCols(last), base.root_weights);
  delay.size = size_of(motor.search, lag.seconds * by_model.orthogonal_part(columns.col(last)), drive);
}

}  // namespace

Lag lag_of(const CrossValidatedFit& fit) {
  const Eigen::Index delay = fit.theta.size() - 1;
  Lag lag{fit.theta[delay]};
  if (!(fit.std[delay] > 0.0) || !std::isfinite(fit.std[delay])) return lag;
  lag.standard_errors = std::abs(lag.seconds) / fit.std[delay];
  // The squares that one column takes off are Student's t, squared, times the variance of the noise; the standard error
  // counts only one sample in an autocorrelation time.
  const double taken_off = std::pow(lag.standard_errors, 2) * fit.autocorrelation_time;
  lag.share = taken_off / (taken_off + fit.root_weights.cwiseProduct(fit.residual).squaredNorm());
  return lag;
}

void name_delay(const SearchedBalance& motor, const model::Drive& drive, Diagnosis& result) {
  const bool is_unknown =
      result.resampling && std::ranges::any_of(result.resampling->found, &Resampling::FoundTerm::is_unknown_structure);
  if (!result.named.empty() || is_unknown) return;
  const auto is_delay = [](const CandidateFit& c) { return estimation::is_delay_of_current(*c.model.entry); };
  const auto delay = std::ranges::find_if(motor.candidates, is_delay);
  if (delay == motor.candidates.end()) return;
  const double least_s = kPolicy.least_delay_samples * longest_sample_s(motor);
  // A long delay is more than a lag to first order.
  const bool is_more = delay->gain.score > kPolicy.named_score;
  const double more = is_more ? 0.01 * delay->gain.chi2_percent : 0.0;
  const Lag lag = lag_of(motor.search.base);
  if (!matters(lag, more, least_s)) return;
  const auto is_instead = [&](const CandidateFit& other) {
    return (explains_a_part(other) && other.gain.score > delay->gain.score) ||
           !matters(lag_of(other.fit), more, least_s);
  };
  if (std::ranges::any_of(motor.candidates, [&](const CandidateFit& c) { return !is_delay(c) && is_instead(c); }))
    return;
  if (!is_confirmed(motor.held_out.get(), motor.search.base, motor.search.base) &&
      !(is_more && is_confirmed(motor.held_out.get(), motor.search.base, delay->fit)))
    return;
  result.named = {name_of(*delay)};
  result.verdict = Verdict::missing_effect;
  std::erase_if(result.possible, [&](const PossibleEffect& p) { return contains(p.group, result.named.front()); });
  const auto described =
      std::ranges::find_if(result.candidates, [&](const Candidate& c) { return name_of(c) == result.named.front(); });
  if (described == result.candidates.end()) return;
  described->admit();
  describe_by_lag(motor, lag, more, drive, result.resampling, *delay, *described);
  std::rotate(result.candidates.begin(), described, described + 1);
}

}  // namespace flexspline::selection
