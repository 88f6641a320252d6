// Intervals that do not rest on a parabola: by profile, and by bootstrap.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

using Progress = std::function<void(std::string_view)>;

// Replaces the 95 % intervals of the estimates (not their standard errors) of an identification that is assembled.
//
// Profile: a parameter is held at a value and all others of its balance are fitted again; the interval ends where the
// weighted sum of squares has grown by 3.84 s^2 times the residual's autocorrelation time (likelihood ratio). An end
// that is not reached within the parameter's range stays open, with a warning.
void profile(Identification& identification, const Progress& progress);

// Block bootstrap (Carlstein 1986): fixed blocks of several autocorrelation times are drawn again, `replicates` times,
// and all parameters of the balance fitted; 2.5 and 97.5 % of what comes out. The same seed gives the same intervals.
void bootstrap(Identification& identification, int replicates, std::uint64_t seed, const Progress& progress);

}  // namespace flexspline::estimation
