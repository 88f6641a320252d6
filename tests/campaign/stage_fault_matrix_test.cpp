// A three-phase drive that cannot run away: every fault of its stage, its motor's wires and the encoder that its field
// angle comes from, in each mode, at each speed, with each load.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "tests/support/campaign_size.hpp"
#include "tests/support/on_all_cores.hpp"
#include "tests/support/stage_fault_cells.hpp"

namespace flexspline::tests::stage_fault_matrix_test {
namespace {

constexpr double kOver = 1.1;  // of the overspeed limit, for the true shaft

struct Row {
  int cells = 0, silent = 0, alarms = 0;
  double open_s = 0.0, other_open_s = 0.0, peak_rad_s = 0.0, peak_a = 0.0, travel = 0.0;
  std::string worst;
  std::map<std::string, int> named;

  void add(const StageFaultCell& cell, const StageFaultOutcome& o) {
    ++cells;
    ++named[o.named()];
    if (o.before != Fault::none) ++alarms;
    if (o.fault == Fault::none) ++silent;
    peak_rad_s = std::max(peak_rad_s, o.peak_rad_s);
    peak_a = std::max(peak_a, o.peak_phase_a);
    travel = std::max(travel, o.travel_turns);
    double& open = has_time(cell) ? open_s : other_open_s;
    if (o.open_s <= open) return;
    open = o.open_s;
    if (has_time(cell)) worst = cell.name();
  }
  void print(const std::string& name) const {
    std::printf("%-19s %5d %7d %7d %9.3f %9.1f %6.0f %7.1f %6.1f  %s;", name.c_str(), cells, silent, alarms,
                1e3 * open_s, 1e3 * other_open_s, peak_rad_s, peak_a, travel, worst.c_str());
    for (const auto& [fault, count] : named) std::printf(" %s %d", fault.c_str(), count);
    std::printf("\n");
  }
};

// `coasting_turns`: of the same cell where the amplifier goes off at once.
void check(const StageFaultCell& cell, const StageFaultOutcome& o, double most_rad_s, double most_a,
           double coasting_turns) {
  const StageFaultKind& kind = *cell.kind;
  const std::string name = cell.name();
  EXPECT_EQ(o.before, Fault::none) << "false alarm: " << name;
  EXPECT_LE(o.peak_rad_s, most_rad_s) << name;
  if (!kind.is_short) {
    EXPECT_LE(o.peak_phase_a, most_a) << name;
  }
  if (o.fault != Fault::none) {
    EXPECT_TRUE(o.is_expected(kind)) << name << ": named " << o.named();
  }
  if (kind.injections.empty()) return;
  if (has_time(cell)) {
    EXPECT_GE(o.open_s, 0.0) << name << ": never off";
    EXPECT_LE(o.open_s, stated_s(cell) + 1e-9) << name << ": " << o.named();
  } else if (o.fault == Fault::none) {
    // Nothing shows it: there is no torque, or the field stays behind and holds the shaft within an electrical turn. It
    // comes to rest no later than one that coasts.
    EXPECT_LT(o.end_rad_s, 1.0) << name;
    EXPECT_LT(o.travel_turns, coasting_turns + 1.0 / board::three_phase_of(demo_drive()).motor.pole_pairs) << name;
  }
}

TEST(StageFaultMatrix, OpensTheSwitchesInTheStatedTimeNamesTheFaultAndKeepsSpeedAndCurrent) {
  const double most_rad_s = kOver * demo_setup().safety.overspeed;
  const firmware::ThreePhaseSettings settings = board::three_phase_settings_of(demo_drive());
  const double most_a = std::ldexp(settings.most_phase, -27) * board::three_phase_of(demo_drive()).sensors.full_scale_a;
  const auto cells = tests::whole_campaigns() ? stage_cells({0.0, 0.02, 0.1, 0.25, 0.5, 1.0}, {7, 11, 19, 23})
                                              : stage_cells({0.0, 0.1, 0.5}, {7});
  const Block block = demo_block(cell_setup(true));
  std::vector<StageFaultOutcome> outcomes(cells.size());
  tests::on_all_cores(cells.size(), [&](std::size_t i) { outcomes[i] = StageFaultRun(cells[i], block).run(0.5); });
  // The cells of each fault are in one order.
  const std::size_t each = cells.size() / stage_faults().size();
  std::size_t coasting = 0;
  while (cells[coasting].kind->name != "driver fault") coasting += each;
  std::map<std::string, Row> rows;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    rows[std::string(cells[i].kind->name)].add(cells[i], outcomes[i]);
    check(cells[i], outcomes[i], most_rad_s, most_a, outcomes[coasting + i % each].travel_turns);
  }
  std::printf("%-19s %5s %7s %7s %9s %9s %6s %7s %6s  worst with a time; named\n", "fault", "cells", "silent", "alarms",
              "open ms", "others", "rad/s", "A", "turns");
  for (const auto& [name, row] : rows) row.print(name);
  std::printf("limits: %.0f rad/s, %.2f A; %zu cells\n", most_rad_s, most_a, cells.size());
}

// A load that drives the motor, on a supply that takes nothing back.
TEST(StageFaultMatrix, WithoutABrakeResistorRegenerationEndsInBusHighBelowTheStagesLimit) {
  const Block block = demo_block(cell_setup(true));
  const board::ThreePhaseParameters nominal = board::three_phase_of(demo_drive());
  const double most_v = 30583.0 / 32768.0 * nominal.sensors.bus_full_scale_v;
  struct Load {
    double nm, rad_s;
  };
  for (const Load load : {Load{-20.0, 100.0}, Load{-20.0, 150.0}, Load{-30.0, 150.0}, Load{-10.0, 60.0}})
    for (const bool has_brake : {true, false}) {
      board::ThreePhaseParameters p = nominal;
      p.inverter.supply_takes_back = false;
      VirtualDrive drive({.drive = demo_drive(), .seed = 7, .three_phase = true, .motor = p}, block);
      drive.read_frames(false);
      drive.run(1000);
      ASSERT_EQ(drive.command(arm_velocity(load.rad_s)).refusal, Refusal::none);
      run_with_host(drive, 1.0);
      if (!has_brake) drive.rig().inject(Injection::brake_missing);
      drive.rig().set_load_torque(load.nm);
      double bus_v = 0.0;
      for (int ms = 0; ms < 1000; ++ms) {
        run_with_host(drive, 1e-3);
        bus_v = std::max(bus_v, drive.rig().three_phase()->power().bus_v());
      }
      const firmware::FaultRecord& fault = drive.status().fault;
      std::printf("load %.0f N m at %.0f rad/s, brake resistor %s: bus up to %.2f V, fault %s\n", load.nm, load.rad_s,
                  has_brake ? "there" : "missing", bus_v,
                  std::string(protocol::stage_fault_text(fault.limit).name).c_str());
      // What a period adds, at the largest power of the drive.
      EXPECT_LT(bus_v, most_v + 0.1);
      EXPECT_GT(bus_v, nominal.inverter.supply_v + 1.0) << "it gives nothing back";
      EXPECT_EQ(fault.fault, has_brake ? Fault::none : Fault::amplifier_fault);
      if (has_brake) continue;
      EXPECT_EQ(fault.limit, static_cast<std::int32_t>(firmware::StageFault::bus_high));
      EXPECT_EQ(drive.status().mode, Mode::fault);
      EXPECT_FALSE(drive.last().actuation.enabled);
    }
}

}  // namespace
}  // namespace flexspline::tests::stage_fault_matrix_test
