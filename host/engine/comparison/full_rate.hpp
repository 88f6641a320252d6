// Residual and target of one record at every sample, for what decimated and masked samples cannot serve: spectra and
// periods.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"

namespace flexspline::comparison {

struct FullRate {
  std::vector<double> target;       // N m, filtered; zero outside the segments
  std::vector<double> residual;     // target minus model
  std::vector<std::uint8_t> valid;  // within the segments that the record's samples are taken from
};

// Nothing where the record lacks what the balance needs. `record` need not be one of `prepared`, which gives the rest.
std::optional<FullRate> full_rate(const estimation::PreparedData& prepared, const estimation::Record& record,
                                  estimation::Balance balance, const estimation::Terms& terms);

}  // namespace flexspline::comparison
