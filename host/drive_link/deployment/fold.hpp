// Effects that an image lacks, as tables: where a torque depends on one signal, a table of it runs on any image that
// has table_effect.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "host/physics/catalogue/resolved_model.hpp"
#include "host/physics/model/model.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::deployment {

struct FoldedTable {
  // As catalogue::table_parameters, on the balance of the effect, over the whole envelope of a drive with these bases.
  std::vector<double> parameters;
  double error = 0.0;  // largest difference to the effect within the envelope, N m on its balance
};
// `constants` of the drive in SI. Nothing where the effect depends on more than one signal, on none, or on what was
// before.
std::optional<FoldedTable> folded(const catalogue::ResolvedEffect& effect,
                                  const effects::DriveConstants<double>& constants,
                                  const effects::DriveConstants<double>& bases);

// The number of table effects in a block.
std::size_t table_number();

// What catalogue::table_parameters gives, back. Throws std::invalid_argument where they are none.
model::Definition definition_of(const std::vector<double>& table_parameters);

}  // namespace flexspline::deployment
