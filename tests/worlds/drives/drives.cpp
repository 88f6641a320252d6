#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "tests/worlds/drives/make.hpp"
#include "tests/worlds/drives/write.hpp"

namespace {

namespace drives = flexspline::worlds::drives;

constexpr const char* kUsage =
    "flexspline_drives COUNT FIRST_SEED OUT_DIR [--kind NAME]\n"
    "Writes a folder for each seed: fit/, holdout/, model.toml and truth.json. Without --kind the kinds take turns by "
    "the seed.\n";

const drives::Kind* kind_of(const std::string& name) {
  for (const drives::Kind& kind : drives::kinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

void run(std::uint64_t count, std::uint64_t first, const std::string& folder, const drives::Kind* only) {
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const drives::Kind& kind = only ? *only : drives::kinds()[seed % drives::kinds().size()];
    const drives::Made made = drives::make_case(kind, seed);
    drives::write_case(folder, made.drive, made.records, made.truth);
  }
}

}  // namespace

int main(int count, char** arguments) {
  const std::vector<std::string> words(arguments + 1, arguments + count);
  const drives::Kind* only = words.size() == 5 && words[3] == "--kind" ? kind_of(words[4]) : nullptr;
  if (words.size() != 3 && only == nullptr) {
    if (words.size() == 5 && words[3] == "--kind")
      std::fprintf(stderr, "flexspline_drives: there is no kind '%s'; known are those below\n", words[4].c_str());
    std::fputs(kUsage, stderr);
    for (const drives::Kind& kind : drives::kinds())
      std::fprintf(stderr, "  %.*s\n", static_cast<int>(kind.name.size()), kind.name.data());
    return 2;
  }
  try {
    run(std::stoull(words[0]), std::stoull(words[1]), words[2], only);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "flexspline_drives: %s\n", error.what());
    return 2;
  }
  return 0;
}
