// Whether each record has an inertia of its own, as where the load was changed between recordings: no effect of the
// catalogue, and nothing that friction explains.
#pragma once

#include <optional>
#include <string>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/balance_search.hpp"

namespace flexspline::selection {

struct RecordInertia {
  std::string parameter;           // "inertia.inertia"
  double explains_percent = 0.0;   // of the squared error, with one value for each record in place of one for all
  double least = 0.0, most = 0.0;  // of the records that know it well
  std::string unit;
};

// Of the parameters that multiply an acceleration, the one whose values by record explain most of the error; nothing
// where that is less than a part that matters, or no two records differ beyond their errors.
std::optional<RecordInertia> inertia_by_record(const estimation::Identification& base, const BalanceSearch& search);
std::string inertia_text(const RecordInertia& own);  // a warning

}  // namespace flexspline::selection
