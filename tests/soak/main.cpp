// Runs a campaign for a given number of minutes and writes its results: see `./dev soak`.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/soak/campaign.hpp"
#include "tests/soak/page.hpp"
#include "tests/soak/proof.hpp"

namespace {

using namespace flexspline::soak;
using Clock = std::chrono::steady_clock;

// Fewer sets do not determine the tail of the distribution.
constexpr std::size_t kFewestNulls = 60;

// Runs rounds until the time is over or none is left; a drive that was started is finished.
void run_until(Clock::time_point end, const std::function<std::vector<Case>(std::uint64_t)>& round_of,
               Results& results) {
  std::mutex guard;
  for (std::uint64_t round = 0; Clock::now() < end; ++round) {
    const std::vector<Case> cases = round_of(round);
    if (cases.empty()) return;
    std::vector<Case> open;
    for (const Case& c : cases)
      if (!results.has(c)) open.push_back(c);
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      for (std::size_t i = next++; i < open.size() && Clock::now() < end; i = next++) {
        try {
          const Outcome outcome = run(open[i]);
          const std::lock_guard lock(guard);
          results.add(outcome);
          fmt::print("{} {}: {}\n", outcome.right ? "right" : "WRONG", outcome.what.key(), outcome.named);
          std::fflush(stdout);
        } catch (const std::exception& error) {
          fmt::print(stderr, "{}: {}\n", open[i].key(), error.what());
        }
      }
    };
    std::vector<std::jthread> others;
    for (unsigned t = 1; t < std::max(1U, std::thread::hardware_concurrency()); ++t) others.emplace_back(work);
    work();
  }
}

int run_campaign(const std::string& name, double minutes, const std::string& results_file, const std::string& page,
                 const std::string& version) {
  const bool calibrates = name == "calibrate";
  if (name == "proof") return run_proof_campaign(minutes, page, version);
  if (!calibrates && name != "diagnose") {
    fmt::print(stderr, "there is no campaign \"{}\"; known are diagnose, calibrate and proof\n", name);
    return 2;
  }
  Results results(results_file, version);
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(60.0 * minutes));
  run_until(end, calibrates ? calibration_round : test_round, results);
  if (results.all().empty() || (calibrates && results.all().size() < kFewestNulls)) {
    fmt::print("{} drives so far, too few to say anything; run it again for more\n", results.all().size());
    return 0;
  }
  std::ofstream(page) << (calibrates ? threshold_header(results.all(), version) : page_of(results.all(), version));
  fmt::print("{} drives; see {}\n", results.all().size(), page);
  return 0;
}

}  // namespace

// Arguments: campaign, minutes, file of results, file to write, version.
int main(int argc, char** argv) {
  if (argc != 6) {
    fmt::print(stderr, "usage: {} CAMPAIGN MINUTES RESULTS PAGE VERSION\n", argv[0]);
    return 2;
  }
  try {
    return run_campaign(argv[1], std::stod(argv[2]), argv[3], argv[4], argv[5]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "soak: {}\n", error.what());
    return 2;
  }
}
