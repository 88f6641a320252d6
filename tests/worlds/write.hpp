// Writes a twin as a user's folder: CSV files and dataset.toml in fit/ and holdout/, model.toml, and truth.json apart.
#pragma once

#include <filesystem>

#include "tests/worlds/excess.hpp"

namespace flexspline::worlds {

void write_case(const Twin& twin, const Shares& shares, const std::filesystem::path& folder);

}  // namespace flexspline::worlds
