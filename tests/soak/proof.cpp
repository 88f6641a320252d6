#include "tests/soak/proof.hpp"

#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <map>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/error_proof.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "tests/support/random_model.hpp"

namespace flexspline::soak {
namespace {

constexpr std::size_t kSamples = 20'000;
constexpr double kTickS = 1.0 / 16'000.0;

struct Row {
  std::size_t models = 0, unproven = 0, outside = 0;
  double largest_bound = 0.0;  // in bases of torque
  double nearest = 0.0;        // largest share of its bound that was seen
  void add(const std::array<double, 3>& bound, const std::array<double, 3>& seen) {
    ++models;
    bool out = false;
    for (std::size_t b = 0; b < bound.size(); ++b) {
      largest_bound = std::max(largest_bound, bound[b]);
      if (bound[b] > 0.0) nearest = std::max(nearest, seen[b] / bound[b]);
      out = out || seen[b] > bound[b];
    }
    if (out) ++outside;
  }
};

}  // namespace

int run_proof_campaign(double minutes, const std::string& page, const std::string& version) {
  using Clock = std::chrono::steady_clock;
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(60.0 * minutes));
  std::map<std::string, Row> rows;
  Row sums;
  std::size_t samples = 0;
  std::mt19937 random(1);
  while (Clock::now() < end) {
    const model::Model m = tests::random_model(random);
    const auto effects = tests::values_of(m);
    try {
      const auto drive = deployment::bases_of(m, kTickS);
      const auto range = deployment::prove(effects, drive);
      if (!range.holds) continue;
      const auto proof = deployment::prove_error(effects, drive);
      const auto seen = deployment::compare(effects, drive, range, kSamples, random());
      samples += kSamples;
      for (std::size_t e = 0; e < effects.size(); ++e) {
        Row& row = rows[m.effects[e].type];
        if (proof.parts[e].unproven.empty())
          row.add(proof.parts[e].bound, seen.parts[e]);
        else
          ++row.unproven;
      }
      if (proof.holds)
        sums.add(proof.sum, seen.worst);
      else
        ++sums.unproven;
    } catch (const deployment::PackError&) {
      // It does not fit a drive.
    }
  }
  std::string text = fmt::format(
      "# The error of parameter blocks: proven and seen\n\nVersion {}. {} directed samples of {} random models. "
      "Errors are "
      "in bases of torque; what the columns mean is in [`PROOF.md`](../../host/drive_link/deployment/PROOF.md).\n\n| "
      "effect | "
      "proven | "
      "not proven | largest bound | nearest to its bound | outside |\n| --- | --- | --- | --- | --- | --- |\n",
      version, samples, sums.models + sums.unproven);
  const auto add = [&](const std::string& name, const Row& r) {
    text += fmt::format("| {} | {} | {} | {:.2g} | {:.0f} % | {} |\n", name, r.models, r.unproven, r.largest_bound,
                        100.0 * r.nearest, r.outside);
  };
  std::size_t outside = sums.outside;
  for (const auto& [name, row] : rows) {
    add(name, row);
    outside += row.outside;
  }
  add("sum of a model", sums);
  std::ofstream(page) << text;
  fmt::print("{} samples, {} parts outside what was proven; see {}\n", samples, outside, page);
  return outside == 0 ? 0 : 1;
}

}  // namespace flexspline::soak
