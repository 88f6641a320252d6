// What another block would change on a drive, in the words of the model.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/drive_link/drive/session.hpp"

namespace flexspline::drive {

struct BlockChange {
  std::string effect;     // its id in the model, or its type
  std::string what;       // "added", "removed", "changed", "same"
  std::string parameter;  // of "changed" where the blocks have their parameters; else empty
  std::optional<double> before{};
  std::optional<double> after{};
  std::string unit{};
};

// What is known of a block without a drive.
struct BlockView {
  std::size_t bytes = 0;
  std::string sha256;
  std::string model;  // its name; empty where there is no block
  std::string drive;
};
BlockView view_of(const Bytes& block);

// Effects that only one of both has, and parameters (or, where a block came without, coefficients) that differ.
// `before` may be empty. Throws deployment::PackError where `after` is no good block.
std::vector<BlockChange> changes(const Bytes& before, const Bytes& after);

}  // namespace flexspline::drive
