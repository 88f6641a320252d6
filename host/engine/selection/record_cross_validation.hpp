// Whether what a candidate explains carries over to records that it was not fitted on: leave-group-out
// cross-validation by record, nonlinear parameters fitted again.
#pragma once

#include "host/engine/selection/candidate_fits.hpp"

namespace flexspline::selection {

// Records that were predicted from the others, by the model alone and with the candidate.
struct RecordCrossValidation {
  int better = 0, worse = 0;  // by more than chance (SelectionPolicy::least_gain); others do not decide

  // Fewer than SelectionPolicy::named_frequency of the records that decide are predicted better.
  bool is_refuted() const;
  // By the sign test, at SelectionPolicy::sign_test_p_value.
  bool is_certain() const;
};

// A record counts if the others alone would name the candidate. Its own random effects are predicted from its own
// samples, for both models in the same way. Nothing counts with fewer than three records, or where a parameter is each
// record's own.
RecordCrossValidation cross_validate_by_record(const BalanceSearch& search, const CandidateFit& candidate);

// Fewer than three records cannot show that anything carries over, and what filters leave around reversals repeats with
// the motion: within SelectionPolicy::at_floor of the noise nothing is named from them.
bool is_within_floor_of_few_records(const BalanceSearch& search);

// Refuses candidates that would be named and do not carry over, best first, until one does. On balances that stability
// selection does not cover, a candidate that leaves more than noise must pass the sign test: a law with many parameters
// follows any difference between records. The list stays best first.
void check_by_record(const BalanceSearch& search, std::vector<CandidateFit>& candidates);

}  // namespace flexspline::selection
