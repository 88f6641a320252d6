// A drive that cannot run away: every fault of its encoders, in each mode, at each speed, with each load.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "tests/support/campaign_size.hpp"
#include "tests/support/closed_loop_runs.hpp"
#include "tests/support/sensor_fault_cells.hpp"

namespace flexspline::tests::sensor_fault_matrix_test {
namespace {

constexpr double kOver = 1.1;  // of the overspeed limit, for the true shaft

TEST(SensorFaultMatrix, TheTrueSpeedNeverExceedsTheOverspeedLimitByMoreThanATenth) {
  const double limit = kOver * demo_setup().safety.overspeed;
  const Block with = demo_block(cell_setup(true)), without = demo_block(cell_setup(false));
  const auto cells = tests::whole_campaigns() ? all_cells({0.0, 0.01, 0.025, 0.05, 0.1, 0.225, 0.5, 1.0})
                                              : all_cells({0.0, 0.225, 1.0});
  std::vector<SensorFaultOutcome> outcomes(cells.size());
  tests::on_all_cores(
      cells.size(), [&](std::size_t i) { outcomes[i] = run_cell(cells[i], cells[i].output_encoder ? with : without); });
  struct Row {
    int cells = 0, over = 0, unseen = 0, silent = 0, alarms = 0;
    double found_s = 0.0, peak = 0.0, travel = 0.0;
    std::string worst;
    std::map<std::string, int> faults;
  };
  std::map<std::string, Row> rows;
  double worst = 0.0, unseen_peak = 0.0;
  std::string worst_cell;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const SensorFaultCell& cell = cells[i];
    const SensorFaultOutcome& o = outcomes[i];
    const bool healthy = cell.fault->injections.empty();
    Row& row = rows[std::string(cell.fault->name) + (cell.output_encoder ? "" : ", no output encoder")];
    ++row.cells;
    if (o.before != Fault::none || (healthy && o.fault != Fault::none && o.fault != Fault::overspeed)) ++row.alarms;
    EXPECT_EQ(o.before, Fault::none) << "false alarm: " << cell.name();
    if (healthy && o.fault != Fault::overspeed) {
      EXPECT_EQ(firmware::info_of(o.fault).name, "none") << "false alarm: " << cell.name();
    }
    // Without a second encoder no signal shows one that counts half of a motion which only a current bounds.
    const bool unseen =
        cell.fault->name == "motor coupling slips" && cell.mode == Mode::current && !cell.output_encoder;
    if (o.over(limit)) ++(unseen ? row.unseen : row.over);
    if (unseen) unseen_peak = std::max(unseen_peak, o.peak_rad_s);
    if (unseen) continue;
    EXPECT_LE(o.peak_rad_s, limit) << cell.name() << ": fault " << firmware::info_of(o.fault).name << " after "
                                   << o.found_s << " s";
    if (o.fault == Fault::none) ++row.silent;
    ++row.faults[std::string(firmware::info_of(o.fault).name)];
    row.found_s = std::max(row.found_s, o.found_s);
    row.travel = std::max(row.travel, o.travel_rad);
    if (o.peak_rad_s > row.peak) {
      row.peak = o.peak_rad_s;
      row.worst = cell.name();
    }
    if (!healthy && o.peak_rad_s > worst) {
      worst = o.peak_rad_s;
      worst_cell = cell.name();
    }
  }
  std::printf("%-40s %6s %6s %7s %8s %8s %10s %12s %s\n", "fault", "cells", "over", "unseen", "no fault", "alarms",
              "found ms", "peak rad/s", "travel of the motor, turns; worst cell; faults");
  for (const auto& [name, row] : rows) {
    std::printf("%-40s %6d %6d %7d %8d %8d %10.0f %12.0f %6.1f; %s;", name.c_str(), row.cells, row.over, row.unseen,
                row.silent, row.alarms, 1e3 * row.found_s, row.peak, row.travel / kTurn, row.worst.c_str());
    for (const auto& [fault, count] : row.faults) std::printf(" %s %d", fault.c_str(), count);
    std::printf("\n");
  }
  std::printf("worst cell: %.0f rad/s of %.0f (%s); unseen up to %.0f rad/s; %zu cells\n", worst, limit,
              worst_cell.c_str(), unseen_peak, cells.size());
}

}  // namespace
}  // namespace flexspline::tests::sensor_fault_matrix_test
