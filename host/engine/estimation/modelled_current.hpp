// The current that a model makes of the motion.
#pragma once

#include "host/engine/estimation/record.hpp"
#include "host/engine/estimation/terms.hpp"

namespace flexspline::estimation {

// Whether the torque of a term is that of the modelled current, where the records have one. A memory of the measured
// current averages its noise, and a coefficient of a nonlinear function of it is estimated from noise that is in the
// effort, too. A limit of the current shows in the measured one alone.
bool reads_modelled_current(const Term& term);
// Of these, the torque of a nonlinear function of the current, with a linear coefficient.
bool is_nonlinear_in_current(const Term& term);

// Whether an effect delays the current: it reads the current alone and has a state.
bool is_delay_of_current(const catalogue::Entry& entry);
bool has_delay_of_current(const Terms& terms);

// Gives the records the current that `terms`, with values, make of motion and load, A, for effects with a memory of the
// current, or nonlinear in it (RecordSignals::modelled_current). Nothing changes where a term has such a memory, or no
// current is measured.
void take_modelled_current(PreparedData& prepared, const Terms& terms);

}  // namespace flexspline::estimation
