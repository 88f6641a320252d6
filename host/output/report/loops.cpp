#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/engine/comparison/full_rate.hpp"
#include "host/output/report/parts.hpp"
#include "host/output/report/trace.hpp"

namespace flexspline::report {
namespace {

using nlohmann::json;

constexpr std::size_t kPoints = 1500;
constexpr std::size_t kMostLoops = 8;
// A free record is of interest where its load twists the gear about as much as others do.
constexpr double kLoadedShare = 0.2;

double largest_torque(const estimation::Record& record) {
  double largest = 0.0;
  for (const double torque : record.torque)
    if (std::isfinite(torque)) largest = std::max(largest, std::abs(torque));
  return largest;
}

}  // namespace

json hysteresis_loops(const View& view) {
  json loops = json::array();
  const auto balance = std::find_if(view.balances.begin(), view.balances.end(), [](const BalanceView& b) {
    return b.data->balance() == estimation::Balance::transmission;
  });
  if (balance == view.balances.end()) return loops;
  double largest = 0.0;
  for (const estimation::Record& record : view.prepared.records) largest = std::max(largest, largest_torque(record));
  // Locked records first: nothing else moves in them.
  std::vector<std::size_t> chosen;
  for (const bool locked : {true, false})
    for (const estimation::RowRange& range : balance->data->records()) {
      const estimation::Record& record = view.prepared.records[range.record];
      if (record.locked == locked && (locked || largest_torque(record) > kLoadedShare * largest))
        chosen.push_back(range.record);
    }
  if (chosen.size() > kMostLoops) chosen.resize(kMostLoops);
  for (const std::size_t at : chosen) {
    const estimation::Record& record = view.prepared.records[at];
    const auto full = comparison::full_rate(view.prepared, record, estimation::Balance::transmission, view.terms);
    if (!full) continue;
    std::size_t samples = 0;
    for (const data::Segment& s : record.segments) samples += s.last - s.first;
    const std::size_t step = std::max<std::size_t>(1, samples / kPoints);
    // A point without a number separates two segments.
    std::vector<double> torsion, measured, modelled;
    for (const data::Segment& s : record.segments) {
      for (std::size_t k = s.first; k < s.last; k += step) {
        torsion.push_back(record.inputs.torsion_at(k));
        measured.push_back(full->target[k]);
        modelled.push_back(full->target[k] - full->residual[k]);
      }
      for (auto* part : {&torsion, &measured, &modelled}) part->push_back(std::nan(""));
    }
    loops.push_back({{"experiment", record.name},
                     {"locked", record.locked},
                     {"unit", balance->unit},
                     {"torsion_unit", view.unit_of(data::Column::output_position)},
                     {"torsion", packed(torsion)},
                     {"measured", packed(measured)},
                     {"model", packed(modelled)}});
  }
  return loops;
}

}  // namespace flexspline::report
