// A host before a board with three half bridges: it has the motor measured, makes a block of what was found, and turns
// it. Motors and supplies for the benches.
#pragma once

#include <cmath>
#include <cstdio>
#include <vector>

#include "hil/board/drive_setup.hpp"
#include "hil/board/plant_rig.hpp"
#include "hil/twin/factory_block.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "host/drive_link/drive/commissioning_result.hpp"
#include "host/drive_link/drive/motor_block.hpp"
#include "shared/protocol/texts.hpp"
#include "tests/board/stage_bench.hpp"
#include "tests/board/stored_block.hpp"

namespace flexspline::tests {

using protocol::CommissioningState, protocol::Kind, protocol::Mode;

inline motor::MotorParameters some_motor() {
  motor::MotorParameters m;
  m.pole_pairs = 7;
  m.resistance_ohm = 0.42;
  m.inductance_d_h = 0.35e-3;
  m.inductance_q_h = 0.45e-3;
  m.flux_vs = 0.0075;
  return m;
}
inline motor::InverterParameters inverter_of_24_v() {
  motor::InverterParameters i;
  i.supply_v = 24.0;
  i.averaged_steps = 6;
  return i;
}
inline double timer_hz(const Chip& chip) {
  return 2.0 * chip.clock.apb2_hz();
}

// A host's part of commissioning.
inline deployment::CommissioningSetup setup_of(const protocol::CommissioningStage& stage, double test_a) {
  deployment::CommissioningSetup s;
  s.current_full_scale_a = 1e-3 * stage.current_full_scale_ma;
  s.bus_full_scale_v = 1e-3 * stage.bus_full_scale_mv;
  s.pwm_hz = stage.pwm_hz;
  s.timer_counts = static_cast<int>(stage.timer_counts);
  s.two_sensors = stage.two_sensors;
  s.current_a = test_a;
  s.bus_v = 24.0;
  return s;
}
inline protocol::CommissioningBegin begin_of(const deployment::CommissioningSetup& setup) {
  const auto s = deployment::commissioning_settings(setup);
  return {s.least_bus, s.current,         s.most_current, s.most_voltage, s.voltage_ramp, s.slow_step,
          s.fast_step, s.most_shaft_step, s.step_ramp,    s.most_travel,  s.most_periods, s.stated_pole_pairs};
}
inline protocol::CommissioningProgress measure(StageBench& bench, const deployment::CommissioningSetup& setup) {
  EXPECT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  for (;;) {
    const auto now = bench.get<protocol::CommissioningProgress>(Kind::commissioning_state);
    if (now.state != CommissioningState::runs) return now;
    bench.chip.periods(2000);
  }
}
inline control::commissioning::Result result_of(StageBench& bench) {
  return drive::result_of(bench.get<protocol::CommissioningResult>(Kind::commissioning_result));
}
inline void expect_measured(StageBench& bench, const motor::MotorParameters& truth, double test_a) {
  const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), test_a);
  const auto end = measure(bench, setup);
  ASSERT_EQ(end.state, CommissioningState::done)
      << deployment::commissioning_fault_text(end.fault).name << " " << int{end.phase} << " in "
      << deployment::commissioning_step_text(end.step);
  const auto found = deployment::commissioning_findings(setup, result_of(bench));
  const double ohm = truth.resistance_ohm + motor::InverterParameters{}.on_resistance_ohm;
  EXPECT_NEAR(found.resistance_ohm, ohm, 0.03 * ohm);
  EXPECT_NEAR(found.inductance_d_h, truth.inductance_d_h, 0.05 * truth.inductance_d_h);
  EXPECT_NEAR(found.inductance_q_h, truth.inductance_q_h, 0.05 * truth.inductance_q_h);
  EXPECT_NEAR(found.flux_vs, truth.flux_vs, 0.02 * truth.flux_vs);
  EXPECT_EQ(found.pole_pairs, truth.pole_pairs);
  EXPECT_FALSE(found.reversed);
  std::printf("R %+.2f %%, Ld %+.2f %%, Lq %+.2f %%, flux %+.2f %%, %.1f s\n",
              100.0 * (found.resistance_ohm / ohm - 1.0), 100.0 * (found.inductance_d_h / truth.inductance_d_h - 1.0),
              100.0 * (found.inductance_q_h / truth.inductance_q_h - 1.0),
              100.0 * (found.flux_vs / truth.flux_vs - 1.0), end.periods / setup.pwm_hz);
  bench.chip.periods(2);
  EXPECT_FALSE(bench.is_on());
  bench.expect_no_violation();
}

// Puts a block into the first parameter sectors before the drive is switched on.
template <std::size_t size>
class SectorsPort {
 public:
  static constexpr std::size_t kSectorBytes = size;
  explicit SectorsPort(FlashModel& flash, std::size_t from = 0) : flash_(flash), from_(from) {}
  bool erase(std::size_t) { return true; }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i)
      flash_.bytes[from_ + sector * size + 4 * word + i] = static_cast<std::uint8_t>(value >> (8 * i));
    return true;
  }
  std::span<const std::uint8_t> bytes(std::size_t sector) const {
    return std::span<const std::uint8_t>(flash_.bytes).subspan(from_ + sector * size, size);
  }

 private:
  FlashModel& flash_;
  std::size_t from_;
};

// The demo's drive with the scales of a board, and a motor of its torque constant.
struct Turned {
  plant::Drive drive = plant::demo_plant().drive;
  motor::MotorParameters motor = some_motor();
  motor::ShaftParameters shaft;

  explicit Turned(const StageWiring& w) {
    drive.sensors.motor_counts = static_cast<int>(w.counts);
    motor.flux_vs = drive.torque_constant_nm_a / (1.5 * motor.pole_pairs);
    shaft.inertia_kg_m2 = drive.find("inertia")->value("inertia");
  }
  std::vector<std::uint8_t> block(const control::MotorSettings& found, double full_scale_a, double most_a) const {
    control::DriveSetup<double> s = board::setup_of(drive, board::constants_of(drive, 10'000));
    s.has_torque_sensor = false;
    s.output_counts = 0;
    s.current.full_scale = full_scale_a;
    s.amplifier_full_scale = most_a;
    s.temperature = {.full_scale = 256.0};
    const std::vector<std::uint8_t> made = twin::factory_block(drive, s);
    return found.pole_pairs > 0 ? drive::with_motor(made, found) : made;
  }
};
inline control::MotorSettings motor_found(StageBench& bench, double test_a) {
  const auto stage = bench.get<protocol::CommissioningStage>(Kind::commissioning_stage);
  const auto setup = setup_of(stage, test_a);
  EXPECT_EQ(measure(bench, setup).state, CommissioningState::done);
  return deployment::motor_settings(setup, result_of(bench), std::ldexp(stage.shortest_pulse, -30),
                                    stage.encoder_counts, 1000.0);
}
inline std::int32_t per_unit(double value, double base) {
  return static_cast<std::int32_t>(std::lround(std::ldexp(value / base, 27)));
}
// With a host that says each ten milliseconds that it is there.
inline void run_with_host(StageBench& bench, double seconds) {
  for (int left = static_cast<int>(std::lround(seconds * 20'000)); left > 0; left -= 200) {
    bench.command({.kind = protocol::CommandKind::heartbeat});
    bench.chip.periods(150);
  }
}

// Of the whole interrupt: registers, the stage with its protections, and field-oriented control.
inline void expect_loop_within(StageBench& bench, std::uint64_t instructions) {
  std::uint64_t least = UINT64_MAX, most = 0;
  bench.chip.machine.count_instructions();
  for (int k = 0; k < 64; ++k) {
    bench.chip.period();
    least = std::min(least, bench.chip.loop_instructions);
    most = std::max(most, bench.chip.loop_instructions);
  }
  std::printf("the current loop's interrupt: %d to %d instructions\n", static_cast<int>(least), static_cast<int>(most));
  EXPECT_LT(most, instructions);
  EXPECT_GT(least, 390U) << "less than field-oriented control alone: tests/counts/budget.txt";
}

}  // namespace flexspline::tests
