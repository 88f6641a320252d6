// The delay of the current as a missing effect.
#pragma once

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// The lag that a fit has as its last column.
struct Lag {
  double seconds = 0.0;  // negative: the effort comes before the motion that it belongs to
  double standard_errors = 0.0;
  double share = 0.0;  // of the squared error, weighted by each record's noise, that the column takes off
};
Lag lag_of(const CrossValidatedFit& fit);

// Names `current_delay` on the motor's balance where the effort comes before the motion by a certain lag, without which
// the RMS error is larger by what a large effect makes, and the squared error on experiments that are held out by what
// a term takes off; and where nothing is named, halves find nothing that is in no catalogue, none that explains a part
// of the error is likelier than a delay beyond the lag, and the lag stays with each of them: friction that the model
// lacks makes the effort turn early, too. A lag is in every model that candidates are compared with, so that likelihood
// counts only what is more than a lag, and halves do not choose it; the candidate is described by the lag.
void name_delay(const SearchedBalance& motor, const model::Drive& drive, Diagnosis& result);

}  // namespace flexspline::selection
