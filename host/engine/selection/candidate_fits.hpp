// Fits of one torque balance with each effect of the catalogue added.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/selection/balance_search.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/cross_validation.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {

struct CandidateFit {
  CandidateModel model;
  CrossValidatedFit fit;
  LikelihoodGain gain;
  double other_balance_score = 0.0;    // on the other balances that the effect acts on, with the same parameters
  double other_balance_percent = 0.0;  // largest decrease of left-out chi-square on those
  bool at_floor_on_others = true;      // likewise
  bool admissible = true;
  std::string why_not;
  std::string confounded_with;  // the effect of the model that the data cannot distinguish it from
  std::string note;             // a remark for the user if it is named
  // Error on experiments that are held out, with it over without it; of the best one that passes alone.
  std::optional<double> held_out_ratio;
  bool shows_held_out = true;  // its torque there is large enough to take off the share of an effect that matters
  bool leads = false;          // has a higher score than a simpler one that comes first, but not significantly
  bool order_is_not_identifiable =
      false;  // not admissible for this reason only: it has the usual order, which is the best of those tried
  bool has_uncertain_period = false;  // is a wave of the output's angle, and the data do not show its period

  double score() const { return gain.score + other_balance_score; }
};

// Whether two candidates are the same function of the data, by their gains: of a drive without a gear a wave of the
// motor's turn is one of the output's. Nothing that gains nothing is.
bool is_same_function(const CandidateFit& a, const CandidateFit& b);

// Whether an effect may be named: admissible, certain, and large enough to matter.
bool passes(const CandidateFit& candidate);
// Whether it also takes the share off the left-out squares above the noise that a term has to; off all of them where
// the noise is not known.
bool is_worth_a_term(const BalanceSearch& search, const CandidateFit& candidate);
// Whether its likelihood is significant, admissible or not, and it takes the share of a term off all left-out squares.
bool explains_a_part(const CandidateFit& candidate);
// Refuses those that would be named and are not worth it, best first. The list stays best first.
void check_worth(const BalanceSearch& search, std::vector<CandidateFit>& candidates);

// All effects that could be added (where `is_tried` is given, of those alone), best first; the best ones with their
// nonlinear parameters searched continuously.
std::vector<CandidateFit> rank_candidates(const BalanceSearch& search,
                                          const std::function<bool(const CandidateModel&)>& is_tried = {});
// The same candidate with its nonlinear parameters searched continuously from where they are, with the noise that it
// leaves. `coarse`: decimated samples for the first steps, or null.
CandidateFit refined(const BalanceSearch& search, const CandidateFit& candidate, const RegressionProblem* coarse);
// Best first: admissible ones before others, by score; of confounded ones that leave almost the same error, the
// simplest.
void sort_candidates(const BalanceSearch& search, std::vector<CandidateFit>& candidates);

// One more forward step, then backward elimination: an effect that was named because it resembles the true one is
// dropped once the true one is in the model. Returns the candidate to name instead of the first of all, or nothing.
std::optional<CandidateFit> backward_elimination(const BalanceSearch& search,
                                                 const std::vector<CandidateFit>& candidates);

// Whether all amplitudes of a law whose description explains that case came out negative.
bool is_negative(const CandidateFit& candidate);
// Whether it is negative over so wide a range of speed that it is another law, whatever its formula
// (effects::Description::wide_negative_is).
bool is_another_law(const CandidateFit& candidate, const RegressionProblem& data);

// The position of a parameter among the linear ones of a cross-validated model, or nothing if it is not estimated
// there.
std::optional<std::size_t> position(const CrossValidatedFit& fit, std::string_view id, std::string_view parameter);

}  // namespace flexspline::selection
