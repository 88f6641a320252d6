// The data set rhs-100 as files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hil/rhs100/experiments.hpp"

namespace flexspline::rhs100 {

/// Records the sets and writes one folder each (CSV files, dataset.toml, base-model.toml, truth.toml) and a README.md
/// beside them; where all sets are asked for, a dataset.toml and a base-model.toml of the whole drive, too. `parts`
/// picks sets whose names begin with one of them ("table-1"); none: all. Returns how many experiments were written.
/// Throws std::invalid_argument for a part that there is not, std::runtime_error where a file cannot be written.
std::size_t write_data_set(const std::filesystem::path& folder, const std::vector<std::string>& parts,
                           std::uint64_t seed);

}  // namespace flexspline::rhs100
