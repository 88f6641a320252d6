// What resampling (host/selection) makes of the motor's balance, and how the verdict follows it.
#pragma once

#include <vector>

#include "host/selection/diagnosis.hpp"
#include "host/selection/searched_balance.hpp"

namespace flexspline::selection {

// Experiments of role fit choose, those of role holdout judge.
Resampling resample(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                    const estimation::Terms& terms);

// Whether the verdict on the motor's balance follows resampling. Likelihood is sharper where all that the model lacks
// is the one effect, and nothing else than that can be meant by what is left: it decides where the halves of the data
// hold nothing above the noise, and where resampling does not speak against its name.
bool resampling_decides(const Resampling& resampling, const SearchedBalance& motor);

// Names what resampling found; nothing where it found nothing that is in the catalogue. The
// candidates that it names come first.
void name_stable(SearchedBalance& chosen, Diagnosis& result);

}  // namespace flexspline::selection
