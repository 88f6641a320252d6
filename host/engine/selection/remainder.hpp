// What is left of the error of a balance, with what is named in the model.
#pragma once

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// Sets the remaining structure, the recovered share, the delay, drifts, and, where nothing is named, the verdict.
void assess_remainder(const SearchedBalance& chosen, Diagnosis& result);

// The verdict of the names that are left where some were taken back after it was made. Returns whether none is.
bool follow_names(const SearchedBalance& chosen, Diagnosis& result);

// Friction that differs between runs more than `fit` explains, with a warning each.
void add_drifts(const SearchedBalance& balance, const CrossValidatedFit& fit, Diagnosis& result);

// What to do about a delay of the effort against the motion; empty where it is within what the alignment leaves open.
std::string delay_advice(double delay_s, const estimation::PreparedData& prepared);

}  // namespace flexspline::selection
