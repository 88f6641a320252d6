// Instrumental variables: least squares is biased where its columns are made from noisy motion; columns of the
// simulated motion are as close to the true ones and know nothing of the noise.
#pragma once

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

// Refits all balances from the values that least squares found, which it replaces along with residuals and
// covariances; (Z' W (y - f(theta))) = 0 with Z the model's slopes along its own free run, solved by Newton steps; the
// free run follows the new values. Adds warnings for records without a free run, which keep their own columns.
void refit_with_instruments(Identification& identification);

}  // namespace flexspline::estimation
