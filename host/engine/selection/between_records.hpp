// A friction law that shows only from record to record: each record is fitted by the model's own friction, whose values
// go with the record's speed or load as the law predicts.
#pragma once

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "host/engine/selection/searched_balance.hpp"

namespace flexspline::selection {

// Names the law, or the laws that these data cannot distinguish, where nothing else is named on the motor balance,
// friction differs between its records, and meta-regression explains the difference (steps in METHOD.md). The result
// keeps `partial`, as the records themselves do not show the law. `all_records`: the model fitted on those held out as
// well, where there are any; effects that scale friction are tested on it.
void name_between_records(const estimation::Identification& base, const estimation::Identification& all_records,
                          const SearchedBalance& motor, Diagnosis& result);

}  // namespace flexspline::selection
