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
/// next to them; for all sets also a dataset.toml and a base-model.toml of the whole drive. `parts` selects sets whose
/// names begin with one of them ("table-1"); none: all. Returns how many experiments were written. Throws
/// std::invalid_argument for an unknown part, std::runtime_error where a file cannot be written.
std::size_t write_data_set(const std::filesystem::path& folder, const std::vector<std::string>& parts,
                           std::uint64_t seed);

}  // namespace flexspline::rhs100
