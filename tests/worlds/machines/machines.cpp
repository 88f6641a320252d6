// flexspline_machines COUNT FIRST_SEED OUT_DIR [--kind NAME] [--stress]: machines of eight kinds as folders that the
// tool can read.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/worlds/machines/write_machine.hpp"

namespace {

namespace machines = flexspline::worlds::machines;

int usage() {
  fmt::print(stderr, "usage: flexspline_machines COUNT FIRST_SEED OUT_DIR [--kind NAME] [--stress]\nkinds:");
  for (const auto kind : machines::kKinds) fmt::print(stderr, " {}", name_of(kind));
  fmt::print(stderr, "\n");
  return 2;
}

std::optional<machines::Kind> kind_named(const std::string& name) {
  for (const auto kind : machines::kKinds)
    if (name_of(kind) == name) return kind;
  return std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() < 3) return usage();
  std::optional<machines::Kind> only;
  bool stress = false;
  for (std::size_t k = 3; k < arguments.size(); ++k) {
    if (arguments[k] == "--stress") {
      stress = true;
    } else if (arguments[k] == "--kind" && k + 1 < arguments.size() && (only = kind_named(arguments[k + 1]))) {
      ++k;
    } else {
      return usage();
    }
  }
  try {
    const int count = std::stoi(arguments[0]);
    const unsigned long long first = std::stoull(arguments[1]);
    for (int k = 0; k < count; ++k) {
      const unsigned long long seed = first + static_cast<unsigned long long>(k);
      const machines::Kind kind = only.value_or(machines::kKinds[seed % machines::kKinds.size()]);
      write_machine(machines::machine_of(seed, kind, stress),
                    std::filesystem::path(arguments[2]) / fmt::format("{}-{}", name_of(kind), seed));
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "flexspline_machines: {}\n", error.what());
    return 2;
  }
  return 0;
}
