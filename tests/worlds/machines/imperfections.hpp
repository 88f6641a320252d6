// By how much each imperfection that was not hidden raises the error of the base model.
#pragma once

#include "tests/worlds/machines/account.hpp"

namespace flexspline::worlds::machines {

// From this share of the RMS error on, a name that the catalogue has for an imperfection counts as true.
inline constexpr double kTrueFrom = 0.01;

struct CatalogueName {
  std::string effect;
  double order = 0.0;  // 0: any, or the effect has none
};

struct Imperfection {
  std::string what;
  double excess = 0.0;               // of the RMS error, with what is hidden in the model
  std::vector<CatalogueName> names;  // that are right for it; none where the catalogue has no such effect
};

struct Account {
  double base_error_nm = 0.0;  // of the motor's balance
  double excess = 0.0;         // of what is hidden, in its balance
  Balance balance = Balance::motor;
  double error_with_nm = 0.0, error_floor_nm = 0.0;  // in that balance, with it left out of the model and with it
  std::vector<Imperfection> imperfections;
};

Account account_of(const Machine& machine, const std::vector<Run>& runs);

}  // namespace flexspline::worlds::machines
