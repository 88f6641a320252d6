#include "host/output/answers/disturbance_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/input/data/record_time.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::output {
namespace {

using selection::Disturbance;

constexpr std::size_t kMostShown = 8;

std::vector<Disturbance> largest_in_order(const std::vector<Disturbance>& all) {
  std::vector<Disturbance> shown = all;
  if (shown.size() > kMostShown) {
    std::ranges::stable_sort(shown, std::ranges::greater{}, &Disturbance::peak);
    shown.resize(kMostShown);
  }
  // Experiments in the order of the list, which has those of one balance after those of another.
  const auto place = [&](const Disturbance& x) {
    return std::ranges::find(all, x.experiment, &Disturbance::experiment) - all.begin();
  };
  std::ranges::stable_sort(shown, [&](const Disturbance& a, const Disturbance& b) {
    return std::pair(place(a), a.from_s) < std::pair(place(b), b.from_s);
  });
  return shown;
}

}  // namespace

void print_disturbances(Console& console, const std::vector<Disturbance>& all, const data::Dataset* dataset) {
  if (all.empty()) return;
  Table table({"disturbance in", "from", "to", "peak"}, "lrrr");
  bool is_relative = false;
  for (const Disturbance& x : largest_in_order(all)) {
    const double start_s = dataset ? data::start_of_times(*dataset, x.experiment) : 0.0;
    is_relative = is_relative || start_s != 0.0;
    table.row({x.experiment, fmt::format("{:.3f} s", x.from_s - start_s), fmt::format("{:.3f} s", x.to_s - start_s),
               with_unit(x.peak, x.unit)});
  }
  console.line();
  console.line(table.text());
  if (is_relative) console.line(fmt::format("  Times are{}.", data::kAfterFirstSample));
  if (all.size() > kMostShown) console.line(fmt::format("  and {} more; --json lists all", all.size() - kMostShown));
}

}  // namespace flexspline::output
