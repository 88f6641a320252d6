// Boards with three half bridges: set-up, the instant of the samples, what opens the switches, and the measurement of a
// motor by the real image.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <set>
#include <string>

#include "hil/board/drive_setup.hpp"
#include "hil/board/plant_rig.hpp"
#include "hil/twin/factory_block.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "host/drive_link/drive/motor_block.hpp"
#include "shared/protocol/texts.hpp"
#include "shared/storage/parameter_store.hpp"
#include "tests/board/stage_bench.hpp"

namespace flexspline::tests {
namespace {

using protocol::CommissioningState, protocol::Kind, protocol::Mode;

// RM0390 and the schematic of the X-NUCLEO-IHM08M1: shunts of 10 milliohm, amplifiers of 5.182 about 1.71 V, which fall
// with a current into the motor; a divider of 169 and 9.31 kiloohm at the bus.
StageWiring nucleo(const std::string& name = "ihm08m1") {
  StageWiring w;
  w.image = std::string(FLEXSPLINE_BOARDS) + "/nucleo_ihm08m1/" + name + ".elf";
  w.written = {.address = 0x08020000,
               .sectors = {{5, 0, 0x20000}, {6, 0x20000, 0x20000}, {7, 0x40000, 0x20000, false}}};
  w.currents = {0, 11, 10};
  w.full_scale_a = 1.65 / (0.01 * 5.1818);
  w.zero_share = 1.71 / 1.65 - 1.0;
  w.currents_fall = true;
  w.bus = 1;
  w.bus_full_scale_v = 3.3 * (169.0 + 9.31) / 9.31;
  w.temperature = 12;
  w.temperature_share = 4.7 / (10.0 + 4.7);  // 25 degrees Celsius
  return w;
}
motor::MotorParameters some_motor() {
  motor::MotorParameters m;
  m.pole_pairs = 7;
  m.resistance_ohm = 0.42;
  m.inductance_d_h = 0.35e-3;
  m.inductance_q_h = 0.45e-3;
  m.flux_vs = 0.0075;
  return m;
}
motor::InverterParameters inverter_of_24_v() {
  motor::InverterParameters i;
  i.supply_v = 24.0;
  i.averaged_steps = 6;
  return i;
}
struct NucleoBench : StageBench {
  explicit NucleoBench(const std::string& name = "ihm08m1") : StageBench(nucleo(name), some_motor(), inverter_of_24_v()) {}
};
double timer_hz(const Chip& chip) {
  return 2.0 * chip.clock.apb2_hz();
}

TEST(BoardStage, StartsWithAllSwitchesOpenADeadTimeAndABreakInput) {
  NucleoBench bench;
  Chip& chip = bench.chip;
  bench.come_up();
  EXPECT_EQ(chip.clock.core_hz(), 160e6);
  EXPECT_FALSE(chip.tim1.outputs_on());
  const std::uint32_t bdtr = chip.tim1.at(0x44);
  EXPECT_NEAR((bdtr & 0x7F) / timer_hz(chip), 500e-9, 10e-9);
  EXPECT_EQ(bdtr & 0x80, 0U);
  EXPECT_EQ(bdtr & 0x3000, 0x1000U) << "a low break input opens all switches";
  EXPECT_EQ(bdtr & 0x4000, 0U) << "they do not close by themselves";
  for (const std::uint32_t channel : {1U, 2U, 3U}) {
    EXPECT_EQ(chip.tim1.at(0x20) >> (4 * (channel - 1)) & 15, 13U) << "high side active high, low side active low";
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, false)) << channel;
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, true)) << channel;
  }
  EXPECT_DOUBLE_EQ(chip.tim1.period_us(timer_hz(chip)), 50.0);
  EXPECT_EQ(chip.machine.tick_priority(), 0xFFU) << "the current loop interrupts the tick";
  // Pins of the timer with pulls that hold the switches open before it drives them.
  for (const auto& [port, pin, pull] : {std::array{0, 8, 2}, {0, 9, 2}, {0, 10, 2}, {0, 7, 1}, {1, 0, 1}, {1, 1, 1}}) {
    EXPECT_EQ(chip.ports[port].mode(pin), 2U);
    EXPECT_EQ(chip.ports[port].function(pin), 1U);
    EXPECT_EQ(chip.ports[port].at(0x0C) >> (2 * pin) & 3, static_cast<std::uint32_t>(pull));
  }
  const auto status = bench.status();
  EXPECT_EQ(status.mode, Mode::idle) << protocol::fault_text(status.fault).name << " " << status.fault_seen << " "
                                     << status.fault_limit;
  bench.expect_no_violation();
}

// The instant at which the currents are held is a number of the timer's and of the converters' registers: nothing that
// the processor does moves it.
TEST(BoardStage, TheInstantOfTheSamplesIsTheTimersWhateverTheProcessorDoes) {
  NucleoBench bench;
  Chip& chip = bench.chip;
  bench.come_up();
  const double hz = timer_hz(chip), apb2 = chip.clock.apb2_hz();
  ASSERT_TRUE(chip.tim1.triggers_by_compare4());
  const int timer_set_ups = chip.tim1.set_ups_while_it_runs, converter_set_ups = chip.converter.set_ups;
  std::mt19937 random{3};
  std::set<double> instants;
  for (int k = 0; k < 2000; ++k) {
    instants.insert(chip.tim1.trigger_us(hz) + chip.converter.sample_us(apb2) - chip.tim1.top_us(hz));
    // The tick, an interrupt that waits, a command, a loop that ends late: whatever delays instructions.
    if (random() % 8 == 0) bench.ask(Kind::status, protocol::Empty{});
    chip.loop_is_late = random() % 16 == 0;
    ASSERT_EQ(chip.period(), Stop::waits);
  }
  EXPECT_EQ(instants.size(), 1U) << "no jitter";
  EXPECT_NEAR(*instants.begin(), 0.0, 0.01) << "us: held in the middle of the low sides' time";
  EXPECT_EQ(chip.tim1.set_ups_while_it_runs, timer_set_ups) << "no register that the instant depends on is written";
  EXPECT_EQ(chip.converter.set_ups, converter_set_ups);
  EXPECT_LT(chip.converter.conversion_us(apb2), 4.0);
  bench.expect_no_violation();
}

TEST(BoardStage, AConverterThatStopsOpensTheSwitchesWithinThreePeriodsAndIsAFault) {
  NucleoBench bench;
  bench.come_up();
  Chip& chip = bench.chip;
  chip.tim1.write(0x44, chip.tim1.at(0x44) | 1U << 15);  // as if it were on
  ASSERT_TRUE(chip.tim1.outputs_on());
  chip.converter_is_dead = true;
  chip.converter.words[0x00] = 0;
  chip.periods(3);
  EXPECT_FALSE(chip.tim1.outputs_on());
  const auto status = bench.status();
  EXPECT_EQ(status.mode, Mode::fault);
  EXPECT_EQ(protocol::fault_text(status.fault).name, "motor_encoder_stale") << "nothing is sampled any more";
  EXPECT_GT(bench.status().tick, status.tick) << "the application goes on";
  bench.expect_no_violation();
}

TEST(BoardStage, ACurrentLoopThatEndsAfterTheTimersBottomIsAnOverrun) {
  NucleoBench bench;
  bench.come_up();
  bench.chip.loop_is_late = true;
  bench.chip.periods(4);
  bench.chip.loop_is_late = false;
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "tick_overrun");
}

// A host's part of commissioning.
deployment::CommissioningSetup setup_of(const protocol::CommissioningStage& stage, double test_a) {
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
protocol::CommissioningBegin begin_of(const deployment::CommissioningSetup& setup) {
  const auto s = deployment::commissioning_settings(setup);
  return {s.least_bus, s.current,         s.most_current, s.most_voltage, s.voltage_ramp, s.slow_step,
          s.fast_step, s.most_shaft_step, s.step_ramp,    s.most_travel,  s.most_periods, s.stated_pole_pairs};
}
protocol::CommissioningProgress measure(StageBench& bench, const deployment::CommissioningSetup& setup) {
  EXPECT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  for (;;) {
    const auto now = bench.get<protocol::CommissioningProgress>(Kind::commissioning_state);
    if (now.state != CommissioningState::runs) return now;
    bench.chip.periods(2000);
  }
}
control::commissioning::Result result_of(StageBench& bench) {
  const auto from = bench.get<protocol::CommissioningResult>(Kind::commissioning_result);
  control::commissioning::Result r;
  r.gain = {from.gain[0], from.gain[1], from.gain[2]};
  r.resistance = from.resistance;
  r.inductance_d = from.inductance_d;
  r.inductance_q = from.inductance_q;
  r.flux = from.flux;
  r.pole_pairs = from.pole_pairs;
  r.reversed = from.reversed;
  r.offset_angle = from.offset_angle;
  return r;
}
void expect_measured(StageBench& bench, const motor::MotorParameters& truth, double test_a) {
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
  std::printf("R %+.2f %%, Ld %+.2f %%, Lq %+.2f %%, flux %+.2f %%, %.1f s\n", 100.0 * (found.resistance_ohm / ohm - 1.0),
              100.0 * (found.inductance_d_h / truth.inductance_d_h - 1.0),
              100.0 * (found.inductance_q_h / truth.inductance_q_h - 1.0),
              100.0 * (found.flux_vs / truth.flux_vs - 1.0), end.periods / setup.pwm_hz);
  bench.chip.periods(2);
  EXPECT_FALSE(bench.is_on());
  bench.expect_no_violation();
}

TEST(BoardStage, TheImageMeasuresAMotorThatNothingIsKnownOf) {
  NucleoBench bench;
  bench.come_up();
  bench.chip.machine.count_instructions();
  std::uint64_t most = 0;
  bench.observes = [&] { most = std::max(most, bench.chip.loop_instructions); };
  expect_measured(bench, some_motor(), 6.0);
  std::printf("at most %d instructions in a period\n", static_cast<int>(most));
  EXPECT_LT(most, 4'000U) << "half a PWM period has as many cycles";
}
// Half a PWM period has enough room for every period of it; one that is late all the same does no harm.
TEST(BoardStage, APeriodThatIsLateWhileAMotorIsMeasuredIsNoFault) {
  NucleoBench bench;
  bench.come_up();
  const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 6.0);
  ASSERT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  bench.chip.periods(3000);
  bench.chip.loop_is_late = true;
  bench.chip.periods(2);
  bench.chip.loop_is_late = false;
  EXPECT_EQ(bench.get<protocol::CommissioningProgress>(Kind::commissioning_state).state, CommissioningState::runs);
}
TEST(BoardStage, WithAnEncoderOnSpiOneFrameAPeriodIsEnough) {
  StageWiring w = nucleo("ihm08m1-abs");
  w.counts = 1 << 14;
  StageBench bench(w, some_motor(), inverter_of_24_v());
  AngleSensorOnSpi sensor(bench.chip.machine, [&] { return !bench.chip.ports[3].high(2); });
  bench.chip.machine.attach(0x40003C00, sensor);
  bench.encoder = [&](std::uint32_t counts) { sensor.angle = counts & 0x3FFF; };
  bench.come_up();
  EXPECT_EQ(bench.status().mode, Mode::idle);
  EXPECT_LE(sensor.clock_hz(bench.chip.clock.apb1_hz()), 10e6);
  expect_measured(bench, some_motor(), 6.0);
  sensor.fault = AngleSensorOnSpi::Fault::no_magnet;
  bench.chip.periods(600);
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "motor_encoder_stale");
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
    return drive::with_motor(twin::factory_block(drive, s), found);
  }
};
control::MotorSettings motor_found(StageBench& bench, double test_a) {
  const auto stage = bench.get<protocol::CommissioningStage>(Kind::commissioning_stage);
  const auto setup = setup_of(stage, test_a);
  EXPECT_EQ(measure(bench, setup).state, CommissioningState::done);
  return deployment::motor_settings(setup, result_of(bench), std::ldexp(stage.shortest_pulse, -30),
                                    stage.encoder_counts, 1000.0);
}
template <class Port>
void store(Port port, const std::vector<std::uint8_t>& block) {
  storage::ParameterStore<Port> into(port);
  const auto good = [](std::span<const std::uint8_t>) { return 0U; };
  std::uint32_t reason = 0;
  into.boot(good);
  EXPECT_EQ(into.begin(block.size(), model::crc32(block)), storage::StoreError::none);
  EXPECT_EQ(into.write(0, block), storage::StoreError::none);
  EXPECT_EQ(into.commit(good, reason), storage::StoreError::none);
}
std::int32_t per_unit(double value, double base) {
  return static_cast<std::int32_t>(std::lround(std::ldexp(value / base, 27)));
}
// Host that says each 2 ms that it is there.
void run_with_host(StageBench& bench, double seconds) {
  for (int left = static_cast<int>(std::lround(seconds * 20'000)); left > 0; left -= 200) {
    bench.command({.kind = protocol::CommandKind::heartbeat});
    bench.chip.periods(150);
  }
}

// Of the whole interrupt: registers, the stage with its protections, and field-oriented control.
void expect_loop_within(StageBench& bench, std::uint64_t instructions) {
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

TEST(BoardStage, TheMotorThatWasMeasuredTurnsAsTheHostSaysAndItsTorqueIsThatOfTheCurrent) {
  const StageWiring w = nucleo();
  const Turned turned(w);
  control::MotorSettings found;
  {
    StageBench bench(w, turned.motor, inverter_of_24_v(), turned.shaft);
    bench.come_up();
    found = motor_found(bench, 5.0);
  }
  StageBench bench(w, turned.motor, inverter_of_24_v(), turned.shaft);
  store(SectorsPort<0x20000>(bench.chip.flash), turned.block(found, 31.842, 15.0));
  bench.come_up();
  ASSERT_TRUE(bench.status().has_parameters);
  bench.chip.periods(1200);  // the zeros of the current sensors
  const auto constants = board::constants_of(turned.drive, 10'000);
  int low_sides_only = 0;
  bench.observes = [&] {
    const motor::Triple d = bench.duties();
    if (bench.is_on() && d[0] + d[1] + d[2] == 0.0) ++low_sides_only;
  };
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                           .mode = Mode::current,
                           .current = per_unit(2.0, constants.current_base)}),
            protocol::Refusal::none);
  bench.chip.periods(100);
  EXPECT_EQ(bench.status().mode, Mode::current) << protocol::fault_text(bench.status().fault).name << " "
                                                << bench.status().fault_limit;
  EXPECT_GE(low_sides_only, 39) << "2 ms of low sides charge the bootstrap supplies before the first voltage";
  double torque = 0.0;
  bench.observes = [&] { torque += bench.sample().torque_nm / 100.0; };
  bench.chip.periods(100);
  EXPECT_NEAR(torque, 2.0 * turned.drive.torque_constant_nm_a, 0.03 * 2.0 * turned.drive.torque_constant_nm_a);
  bench.observes = nullptr;
  expect_loop_within(bench, 1000);
  EXPECT_EQ(bench.command({.kind = protocol::CommandKind::disarm}), protocol::Refusal::none);
  EXPECT_FALSE(bench.is_on());
  bench.chip.periods(8000);  // it comes to rest
  constexpr double kWanted = 80.0;  // rad/s
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                           .mode = Mode::velocity,
                           .velocity = per_unit(kWanted, constants.velocity_base)}),
            protocol::Refusal::none);
  run_with_host(bench, 0.4);
  EXPECT_EQ(bench.status().mode, Mode::velocity);
  EXPECT_NEAR(bench.rotor.speed_rad_s(), kWanted, 0.05 * kWanted);
  bench.expect_no_violation();
}

TEST(BoardStage, ABreakOpensTheSwitchesWithoutTheProcessorAndStopsTheMeasurement) {
  NucleoBench bench;
  bench.come_up();
  const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 6.0);
  ASSERT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  bench.chip.periods(3000);
  ASSERT_TRUE(bench.is_on());
  bench.chip.tim1.trip();
  EXPECT_FALSE(bench.is_on()) << "before an instruction runs";
  bench.chip.tim1.break_input = false;
  bench.chip.periods(10);
  EXPECT_FALSE(bench.is_on());
  EXPECT_EQ(bench.get<protocol::CommissioningProgress>(Kind::commissioning_state).state,
            CommissioningState::drive_fault);
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "amplifier_fault");
  EXPECT_EQ(bench.status().fault_limit, static_cast<int>(protocol::StageFault::driver));
  EXPECT_EQ(bench.command({.kind = protocol::CommandKind::clear_fault}), protocol::Refusal::none);
  bench.chip.periods(300);
  EXPECT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  bench.chip.periods(3000);
  EXPECT_TRUE(bench.is_on()) << "the flag of the break was cleared";
  bench.expect_no_violation();
}

// Schematic and sources of the ODrive v3.6: shunts of 0.5 milliohm in legs B and C, a divider by 19 at the bus.
StageWiring odrive() {
  StageWiring w;
  w.image = std::string(FLEXSPLINE_BOARDS) + "/odrive_v36/odrive.elf";
  w.written = {.address = 0x08004000,
               .sectors = {{1, 0, 0x4000}, {2, 0x4000, 0x4000}, {3, 0x8000, 0x4000, false}, {4, 0xC000, 0x10000, false}}};
  w.channels = {1, 2, 3};
  w.currents = {0, 10, 11};
  w.has_shunt = {false, true, true};
  w.full_scale_a = 1.65 / (40.0 * 0.5e-3);
  w.bus = 6;
  w.bus_full_scale_v = 62.7;
  w.temperature = 15;
  w.temperature_share = 3.3 / (10.0 + 3.3);  // 25 degrees Celsius
  w.counts = 8192;
  return w;
}
struct OdriveBench : StageBench {
  explicit OdriveBench(const motor::MotorParameters& motor = some_motor(), const motor::ShaftParameters& shaft = {},
                       double supply_v = 24.0)
      : StageBench(odrive(), motor, inverter(supply_v), shaft) {
    driver_is_on = [this] { return chip.spi3.is_good(); };
    encoder = [this](std::uint32_t counts) {
      chip.tim3.move_to(counts);
      chip.ports[3].words[0x10] = chip.spi3.is_good() ? 1U << 2 : 0U;  // its fault line
    };
    chip.ports[3].words[0x10] = 1U << 2;
  }
  static motor::InverterParameters inverter(double supply_v) {
    motor::InverterParameters i = inverter_of_24_v();
    i.supply_v = supply_v;
    i.dead_time_s = 0.24e-6;
    return i;
  }
  // Shares of the period of both switches of the brake resistor, and the time from one's end to the other's begin.
  double brake_high() const { return std::max(0.0, 1.0 - double(chip.tim2.at(0x40)) / chip.tim2.at(0x2C)); }
  double brake_gap_us() const {
    return (double(chip.tim2.at(0x40)) - double(chip.tim2.at(0x3C))) / (2.0 * chip.clock.apb1_hz()) * 1e6;
  }
};

TEST(BoardOdrive, SetsItsGateDriverUpAndHoldsAllSwitchesOpen) {
  OdriveBench bench;
  bench.come_up();
  Chip& chip = bench.chip;
  EXPECT_EQ(chip.clock.core_hz(), 168e6);
  EXPECT_TRUE(chip.ports[1].high(12)) << "its enable";
  EXPECT_EQ(chip.spi3.control(0), (21U << 6) | (1U << 4)) << "overcurrent at 0.73 V, latched; six inputs";
  EXPECT_EQ(chip.spi3.control(1), 2U << 2) << "amplifiers of 40";
  EXPECT_LE(chip.spi3.clock_hz(chip.clock.apb1_hz()), 10e6);
  EXPECT_FALSE(chip.tim1.outputs_on());
  EXPECT_NEAR((chip.tim1.at(0x44) & 0x7F) / timer_hz(chip), 240e-9, 10e-9);
  for (const std::uint32_t channel : {1U, 2U, 3U}) {
    EXPECT_EQ(chip.tim1.at(0x20) >> (4 * (channel - 1)) & 15, 5U) << "active high, both";
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, false));
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, true));
  }
  const double instant = chip.tim1.trigger_us(timer_hz(chip)) + chip.converter.sample_us(chip.clock.apb2_hz());
  EXPECT_NEAR(instant, chip.tim1.top_us(timer_hz(chip)), 0.01) << "held in the middle of the low sides' time";
  EXPECT_EQ(bench.brake_high(), 0.0);
  EXPECT_EQ(bench.status().mode, Mode::idle);
  bench.expect_no_violation();
}

TEST(BoardOdrive, WithAGateDriverThatDoesNotHoldItsSettingsItNeverSwitchesOn) {
  for (const bool absent : {false, true}) {
    OdriveBench bench;
    (absent ? bench.chip.spi3.is_absent : bench.chip.spi3.forgets) = true;
    bench.come_up();
    const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 6.0);
    bench.ask(Kind::commissioning_begin, begin_of(setup));
    bench.chip.periods(10);
    EXPECT_FALSE(bench.chip.tim1.outputs_on());
    EXPECT_EQ(bench.status().fault_limit, static_cast<int>(protocol::StageFault::driver));
  }
}

TEST(BoardOdrive, MeasuresAMotorWithTwoShunts) {
  OdriveBench bench;
  bench.come_up();
  const auto stage = bench.get<protocol::CommissioningStage>(Kind::commissioning_stage);
  EXPECT_TRUE(stage.two_sensors);
  expect_measured(bench, some_motor(), 8.0);
}

TEST(BoardOdrive, ItsMotorTurnsAndAnOvercurrentOfTheDriverIsAFaultThatAResetEnds) {
  const Turned turned(odrive());
  control::MotorSettings found;
  {
    OdriveBench bench(turned.motor, turned.shaft);
    bench.come_up();
    found = motor_found(bench, 8.0);
  }
  OdriveBench bench(turned.motor, turned.shaft);
  store(SectorsPort<0x4000>(bench.chip.flash), turned.block(found, 82.5, 40.0));
  bench.come_up();
  ASSERT_TRUE(bench.status().has_parameters);
  bench.chip.periods(1200);
  const auto constants = board::constants_of(turned.drive, 10'000);
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                           .mode = Mode::velocity,
                           .velocity = per_unit(-80.0, constants.velocity_base)}),
            protocol::Refusal::none);
  run_with_host(bench, 0.4);
  EXPECT_NEAR(bench.rotor.speed_rad_s(), -80.0, 4.0);
  expect_loop_within(bench, 1000);
  bench.chip.spi3.overcurrent = true;
  bench.chip.periods(2);
  bench.chip.spi3.overcurrent = false;
  bench.chip.periods(4);
  EXPECT_FALSE(bench.chip.tim1.outputs_on());
  const auto status = bench.status();
  EXPECT_EQ(protocol::fault_text(status.fault).name, "amplifier_fault");
  EXPECT_EQ(status.fault_limit, static_cast<int>(protocol::StageFault::driver));
  bench.chip.periods(50);
  EXPECT_TRUE(bench.chip.spi3.is_good()) << "the reset of its latch";
  EXPECT_EQ(bench.chip.spi3.control(0), (21U << 6) | (1U << 4)) << "its settings stay";
  bench.expect_no_violation();
}

TEST(BoardOdrive, ABusAboveItsLimitGoesIntoTheBrakeResistorWithADeadTime) {
  for (const double volt : {48.0, 52.5, 55.0}) {
    OdriveBench bench(some_motor(), {}, volt);
    bench.come_up();
    bench.chip.periods(10);
    const double wanted = volt < 51.0 ? 0.0 : std::min(0.9, 0.9 * (volt - 51.0) / 3.0);
    EXPECT_NEAR(bench.brake_high(), wanted, 0.02) << volt;
    if (wanted > 0.0) {
      EXPECT_NEAR(bench.brake_gap_us(), 0.5, 0.02);
    }
    EXPECT_FALSE(bench.is_on());
    bench.expect_no_violation();
  }
}

}  // namespace
}  // namespace flexspline::tests
