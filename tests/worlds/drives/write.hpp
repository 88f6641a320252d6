#pragma once

#include <filesystem>
#include <vector>

#include "tests/worlds/drives/case.hpp"
#include "tests/worlds/drives/measure.hpp"
#include "tests/worlds/drives/truth.hpp"

namespace flexspline::worlds::drives {

/// Writes the case's folder `<kind>-<seed>` into `folder`: fit/, holdout/, model.toml and truth.json. Throws where a
/// file cannot be written.
void write_case(const std::filesystem::path& folder, const Case& drive, const std::vector<Measured>& records,
                const Truth& truth);

}  // namespace flexspline::worlds::drives
