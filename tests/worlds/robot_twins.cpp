// flexspline_robot_twins COUNT FIRST_SEED OUT_DIR [--family NAME]: robot-like twins as folders that the tool can read.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/worlds/write.hpp"

namespace {

int usage() {
  fmt::print(stderr, "usage: flexspline_robot_twins COUNT FIRST_SEED OUT_DIR [--family NAME]\nfamilies:");
  for (const auto family : flexspline::worlds::kFamilies) fmt::print(stderr, " {}", family);
  fmt::print(stderr, "\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  namespace worlds = flexspline::worlds;
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() != 3 && (arguments.size() != 5 || arguments[3] != "--family")) return usage();
  const std::string family = arguments.size() == 5 ? arguments[4] : "robot-like";
  if (std::find(worlds::kFamilies.begin(), worlds::kFamilies.end(), family) == worlds::kFamilies.end()) return usage();
  try {
    const int count = std::stoi(arguments[0]);
    const unsigned long long first = std::stoull(arguments[1]);
    for (int k = 0; k < count; ++k) {
      worlds::Twin twin = worlds::draw(first + static_cast<unsigned long long>(k), family);
      const worlds::Shares shares = worlds::fit_sizes(twin);
      write_case(twin, shares, std::filesystem::path(arguments[2]) / fmt::format("{}-{}", family, twin.seed));
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "flexspline_robot_twins: {}\n", error.what());
    return 2;
  }
  return 0;
}
