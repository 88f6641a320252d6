// Which effects likelihood names on a balance, and what the balances that did not decide the verdict lack.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// Puts the effect to name first. Returns the name of an effect that it is named for as well, if there is one.
std::string choose_named(SearchedBalance& chosen);

// Names the first candidate of the balance that decides, and what cannot be distinguished from it.
void name_by_likelihood(const SearchedBalance& chosen, const std::string& alias, Diagnosis& result);

// What the other balances lack as well: each is a regression of its own, and an effect on one does not explain the
// error of another. Appends single names; what cannot be distinguished from others there becomes `possible`.
void name_on_other_balances(std::vector<SearchedBalance>& all, const SearchedBalance& chosen, const model::Drive& drive,
                            Diagnosis& result);

// Waves of the output's angle that explain a part of a balance's error, and that are not named as the data do not show
// their period, are possible.
void list_waves_of_uncertain_period(const std::vector<SearchedBalance>& all, Diagnosis& result);

}  // namespace flexspline::selection
