// Writes a machine as a user's folder: CSV files and dataset.toml in fit/ and holdout/, model.toml, and truth.json
// apart.
#pragma once

#include <filesystem>

#include "tests/worlds/machines/machine.hpp"

namespace flexspline::worlds::machines {

// Draws again until a machine's controller holds it and what is hidden in it has a plausible size.
Machine machine_of(std::uint64_t seed, Kind kind, bool stress);

void write_machine(const Machine& machine, const std::filesystem::path& folder);

}  // namespace flexspline::worlds::machines
