// Effects that scale friction by a recorded signal which hardly changes within a record, as temperature does. Blocks of
// a record show nothing of them, so that halves of the data do not say whether chance did it: as many records count as
// there are.
#pragma once

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// Names the effect with which the records' friction goes, behind what is named already (meta-regression to first order,
// Student's t by Knapp and Hartung 2003, times the effects that were tried), or lists it as possible. Returns whether
// one is named.
bool name_scaling(const estimation::Identification& base, const SearchedBalance& motor, Diagnosis& result);

// Takes back such effects that halves of the data chose and that the records do not confirm. Of fewer records than a
// test needs, held-out experiments may confirm it instead: of more, these are few and go with any drift by chance.
// Lists what is taken back as possible.
void take_back_unconfirmed_scaling(const estimation::Identification& base, const SearchedBalance& motor,
                                   Diagnosis& result);

}  // namespace flexspline::selection
