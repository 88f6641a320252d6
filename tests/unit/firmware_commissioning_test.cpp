// Commissioning as a state of the drive, on the twin with a three-phase motor: who may begin it, what ends it, what is
// left. What it measures: tests/campaign/commissioning_test.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hil/twin/factory_block.hpp"
#include "host/drive_link/deployment/commissioning_settings.hpp"
#include "host/drive_link/drive/motor_block.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/protocol/texts.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/pairing_host.hpp"
#include "tests/support/service_host.hpp"

namespace flexspline::tests::firmware_commissioning_test {
namespace {

using protocol::Code;
using protocol::CommissioningState;
using protocol::Kind;
using protocol::Mode;
using protocol::Refusal;

const plant::Drive& demo() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}

deployment::CommissioningSetup setup_for(const protocol::CommissioningStage& stage) {
  deployment::CommissioningSetup s;
  s.current_full_scale_a = 1e-3 * stage.current_full_scale_ma;
  s.bus_full_scale_v = 1e-3 * stage.bus_full_scale_mv;
  s.pwm_hz = stage.pwm_hz;
  s.timer_counts = static_cast<int>(stage.timer_counts);
  s.current_a = 3.5;
  s.bus_v = 48.0;
  return s;
}
protocol::CommissioningBegin begin_of(const deployment::CommissioningSetup& setup) {
  const auto s = deployment::commissioning_settings(setup);
  return {s.least_bus, s.current,         s.most_current, s.most_voltage, s.voltage_ramp, s.slow_step,
          s.fast_step, s.most_shaft_step, s.step_ramp,    s.most_travel,  s.most_periods, s.stated_pole_pairs};
}

struct Bench {
  explicit Bench(const std::string& fault = "", std::uint64_t seed = 1, bool three_phase = true) {
    board::ThreePhaseParameters motor = board::drawn_motor(demo(), seed);
    if (!fault.empty()) {
      EXPECT_TRUE(board::add_wiring_fault(motor, fault)) << fault;
    }
    start({.drive = demo(), .three_phase = three_phase, .motor = motor});
  }
  void start(twin::TwinSetup setup) {
    setup.flash = &flash;
    setup.pairing = &pairing;
    host.reset();
    drive = std::make_unique<twin::TwinDrive>(setup);
    host = std::make_unique<ServiceHost>(*drive);
    drive->run(200);
    EXPECT_EQ(host->identify(), Code::done);
  }
  firmware::ThreePhaseStage& stage() { return drive->rig().three_phase()->stage(); }
  template <class T>
  T ask(Kind kind) {
    T payload;
    EXPECT_EQ(protocol::take_payload(host->ask(kind).content(), payload), Code::done);
    return payload;
  }
  protocol::CommissioningProgress progress() { return ask<protocol::CommissioningProgress>(Kind::commissioning_state); }
  deployment::CommissioningSetup setup() {
    return setup_for(ask<protocol::CommissioningStage>(Kind::commissioning_stage));
  }
  protocol::Message begin(const protocol::CommissioningBegin& request) {
    return host->ask(Kind::commissioning_begin, request);
  }
  Code begin() { return static_cast<Code>(begin(begin_of(setup())).code); }
  Refusal refusal(const protocol::Message& m) {
    protocol::CommandAnswer answer;
    EXPECT_EQ(protocol::take_payload(m.content(), answer), Code::done);
    return answer.refusal;
  }
  // Asks, as a host does, until it is over.
  protocol::CommissioningProgress finish() {
    for (;;) {
      const auto now = progress();
      if (now.state != CommissioningState::runs) return now;
      drive->run(400);
    }
  }
  bool is_off() {
    drive->run(1);
    return !stage().commissions() && drive->status().mode != Mode::commissioning;
  }

  twin::FlashFile flash;
  twin::PairingFile pairing;
  std::unique_ptr<twin::TwinDrive> drive;
  std::unique_ptr<ServiceHost> host;
};

TEST(FirmwareCommissioning, FindsTheMotorThatTheTwinDrew) {
  for (std::uint64_t seed = 1; seed <= tests::in_campaign<std::uint64_t>(2, 4); ++seed) {
    Bench bench("", seed);
    const auto setup = bench.setup();
    ASSERT_EQ(bench.begin(), Code::done);
    const auto end = bench.finish();
    ASSERT_EQ(end.state, CommissioningState::done)
        << seed << " " << deployment::commissioning_fault_text(end.fault).name << int{end.phase};
    const auto found = deployment::commissioning_findings(setup, bench.stage().commissioning().result());
    const board::ThreePhaseParameters& truth = bench.drive->rig().three_phase()->parameters();
    const auto& g = truth.sensors.gain;
    const double gain = 3.0 / (1.0 / g[0] + 1.0 / g[1] + 1.0 / g[2]);  // what all sensors have in common
    const double ohm = truth.motor.resistance_ohm + truth.inverter.on_resistance_ohm;
    EXPECT_NEAR(found.resistance_ohm * gain, ohm, 0.03 * ohm) << seed;
    EXPECT_NEAR(found.inductance_d_h * gain, truth.motor.inductance_d_h, 0.05 * truth.motor.inductance_d_h) << seed;
    EXPECT_NEAR(found.inductance_q_h * gain, truth.motor.inductance_q_h, 0.05 * truth.motor.inductance_q_h) << seed;
    EXPECT_NEAR(found.flux_vs, truth.motor.flux_vs, 0.02 * truth.motor.flux_vs) << seed;
    EXPECT_EQ(found.pole_pairs, truth.motor.pole_pairs) << seed;
    EXPECT_EQ(found.reversed, truth.wiring.motor_phase[1] == 2) << seed;
    const double wired = found.reversed ? -truth.offset_turns : truth.offset_turns, off = found.offset_turns - wired;
    EXPECT_NEAR(360.0 * (off - std::round(off)), 0.0, 3.0) << seed;
    std::printf("seed %d: R %+.2f %%, Ld %+.2f %%, Lq %+.2f %%, flux %+.2f %%, angle %+.2f deg, %.1f s\n",
                static_cast<int>(seed), 100.0 * (found.resistance_ohm * gain / ohm - 1.0),
                100.0 * (found.inductance_d_h * gain / truth.motor.inductance_d_h - 1.0),
                100.0 * (found.inductance_q_h * gain / truth.motor.inductance_q_h - 1.0),
                100.0 * (found.flux_vs / truth.motor.flux_vs - 1.0), 360.0 * (off - std::round(off)),
                end.periods / setup.pwm_hz);
    EXPECT_EQ(bench.drive->status().mode, Mode::idle);
    EXPECT_TRUE(bench.is_off());
  }
}

struct Expected {
  const char* fault;
  const char* named;
  int phase;  // 0: none is named
};
TEST(FirmwareCommissioning, EachWiringFaultOfTheTwinIsNamedWithItsPhase) {
  constexpr Expected kAll[] = {{"phase-open-a", "phase_open", 1},
                               {"phase-open-b", "phase_open", 2},
                               {"phase-open-c", "phase_open", 3},
                               {"sensor-dead-a", "current_sum", 1},
                               {"sensor-dead-b", "current_sum", 2},
                               {"sensor-dead-c", "current_sum", 3},
                               {"short-to-ground-a", "short_to_ground", 1},
                               {"short-to-ground-b", "short_to_ground", 2},
                               {"short-to-ground-c", "short_to_ground", 3},
                               {"bad-contact-a", "resistances_differ", 1},
                               {"bad-contact-b", "resistances_differ", 2},
                               {"bad-contact-c", "resistances_differ", 3},
                               {"phases-swapped", "none", 0},
                               {"phases-shorted", "phases_shorted", 1},
                               {"not-connected", "not_connected", 0},
                               {"sensors-swapped", "sensor_order", 0},
                               {"encoder-stands", "encoder_stands", 0},
                               {"encoder-slips", "encoder_slips", 0},
                               {"bus-low", "bus_too_low", 0}};
  ASSERT_EQ(board::wiring_fault_names().size(), std::size(kAll));
  for (std::size_t i = 0; i < std::size(kAll); ++i) {
    // Of a fault that each phase can have one phase by turns, in the whole campaign all.
    const std::size_t kind = i / 3, phase = i % 3;
    if (kind < 4 && phase != kind % 3 && !tests::whole_campaigns()) continue;
    const Expected& e = kAll[i];
    Bench bench(e.fault);
    ASSERT_EQ(bench.begin(), Code::done) << e.fault;
    const auto end = bench.finish();
    EXPECT_EQ(deployment::commissioning_fault_text(end.fault).name, e.named) << e.fault;
    if (e.phase != 0) {
      EXPECT_EQ(int{end.phase}, e.phase) << e.fault;
    }
    EXPECT_EQ(bench.drive->status().mode, Mode::idle) << e.fault;
    EXPECT_TRUE(bench.is_off()) << e.fault;
  }
}

TEST(FirmwareCommissioning, OtherPolePairsThanStatedAreAFaultAndThoseThatWereMeasuredAreKept) {
  Bench bench;
  auto setup = bench.setup();
  setup.pole_pairs = bench.drive->rig().three_phase()->parameters().motor.pole_pairs + 1;
  EXPECT_EQ(bench.begin(begin_of(setup)).code, 0);
  const auto end = bench.finish();
  EXPECT_EQ(end.state, CommissioningState::fault);
  EXPECT_EQ(end.fault, control::commissioning::Fault::wrong_pole_pairs);
  EXPECT_EQ(bench.host->code(Kind::commissioning_result), Code::not_measured);
}

TEST(FirmwareCommissioning, ADriveWithoutAThreePhaseStageSaysSo) {
  Bench bench("", 1, false);
  for (const Kind kind :
       {Kind::commissioning_stage, Kind::commissioning_stop, Kind::commissioning_state, Kind::commissioning_result})
    EXPECT_EQ(bench.host->code(kind), Code::not_available);
  EXPECT_EQ(bench.host->code(Kind::commissioning_begin, protocol::CommissioningBegin{}), Code::not_available);
}

TEST(FirmwareCommissioning, ADriveThatIsLockedByAKeyDoesNotBeginAndAnswersTheRest) {
  Bench bench;
  protocol::Identity id;
  ASSERT_EQ(protocol::take_payload(bench.host->ask(Kind::identify, protocol::Hello{}).content(), id), Code::done);
  const auto challenge = bench.ask<protocol::PairingChallenge>(Kind::pairing_challenge);
  const auto answer = answer_of(owner(), protocol::PairingAction::pair, {id.board, id.serial}, challenge.nonce);
  for (const auto& part : answer.parts()) ASSERT_EQ(bench.host->code(Kind::pairing_part, part), Code::done);
  ASSERT_EQ(bench.host->code(Kind::pairing_answer, protocol::PairingAnswer{protocol::PairingAction::pair}), Code::done);
  ASSERT_EQ(bench.host->code(Kind::pairing_lock), Code::done);
  const auto request = begin_of(bench.setup());
  EXPECT_EQ(static_cast<Code>(bench.begin(request).code), Code::locked);
  EXPECT_FALSE(bench.stage().commissions());
  EXPECT_EQ(bench.progress().state, CommissioningState::none);
  EXPECT_EQ(bench.host->code(Kind::commissioning_stop), Code::done);
}

TEST(FirmwareCommissioning, RequestsOfOtherLengthsAndNumbersBeginNothing) {
  Bench bench;
  const protocol::Message good = protocol::request(Kind::commissioning_begin, 1, begin_of(bench.setup()));
  std::mt19937 random(3);
  for (std::uint8_t length = 0; length <= protocol::kMostPayload; ++length) {
    if (length == good.length) continue;
    protocol::Message m = good;
    m.length = length;
    EXPECT_EQ(static_cast<Code>(bench.host->ask(m).code), Code::wrong_length) << int{length};
  }
  for (const Kind kind :
       {Kind::commissioning_stage, Kind::commissioning_stop, Kind::commissioning_state, Kind::commissioning_result})
    EXPECT_EQ(static_cast<Code>(bench.host->ask(protocol::Message{static_cast<std::uint8_t>(kind), 1, 1, 0, {}}).code),
              Code::wrong_length);
  for (int i = 0; i < 2000; ++i) {
    protocol::Message m = good;
    for (std::size_t k = 0; k < m.length; ++k) m.payload[k] = static_cast<std::uint8_t>(random());
    EXPECT_EQ(static_cast<Code>(bench.host->ask(m).code), Code::wrong_value);
  }
  EXPECT_EQ(bench.drive->status().mode, Mode::idle);
  EXPECT_EQ(bench.progress().state, CommissioningState::none);
}

TEST(FirmwareCommissioning, AMotorThatWasNeverMeasuredIsNotArmed) {
  Bench bench;
  EXPECT_EQ(bench.host->arm(Mode::velocity).refusal, Refusal::not_commissioned);
  EXPECT_EQ(bench.drive->status().mode, Mode::idle);
}

TEST(FirmwareCommissioning, WhileItRunsArmingHomingAndWritingAreRefused) {
  Bench bench;
  ASSERT_EQ(bench.begin(), Code::done);
  EXPECT_EQ(bench.host->status().mode, Mode::commissioning);
  EXPECT_EQ(bench.host->arm(Mode::velocity).refusal, Refusal::commissioning);
  EXPECT_EQ(bench.refusal(bench.host->ask(Kind::home, protocol::Home{0})), Refusal::commissioning);
  EXPECT_EQ(bench.refusal(bench.begin(begin_of(bench.setup()))), Refusal::commissioning);
  EXPECT_EQ(bench.host->flash(twin::factory_block(demo())), Code::armed);
  EXPECT_EQ(bench.host->code(Kind::block_erase_all), Code::armed);
  EXPECT_EQ(bench.host->code(Kind::commissioning_result), Code::not_measured);
  EXPECT_TRUE(bench.stage().commissions());
}

TEST(FirmwareCommissioning, IsRefusedWhileArmedInAFaultAndWithNumbersOutsideItsBounds) {
  Bench bench;
  bench.start({.drive = demo(), .three_phase = true});  // with the motor that it was made with
  const auto good = begin_of(bench.setup());
  EXPECT_EQ(bench.host->arm(Mode::velocity).refusal, Refusal::none);
  EXPECT_EQ(bench.refusal(bench.begin(good)), Refusal::armed);
  EXPECT_EQ(bench.host->command({.kind = protocol::CommandKind::disarm}).refusal, Refusal::none);
  auto wrong = good;
  wrong.current = 0;
  EXPECT_EQ(static_cast<Code>(bench.begin(wrong).code), Code::wrong_value);
  wrong = good;
  wrong.most_current = bench.stage().settings().most_phase + 1;
  EXPECT_EQ(static_cast<Code>(bench.begin(wrong).code), Code::wrong_value) << "the board's limit holds";
  wrong = good;
  wrong.least_bus = bench.stage().settings().least_bus - 1;
  EXPECT_EQ(static_cast<Code>(bench.begin(wrong).code), Code::wrong_value) << "the board's limit holds";
  bench.drive->rig().inject(board::Injection::torque_out_of_range);
  bench.drive->run(100);
  ASSERT_EQ(bench.drive->status().mode, Mode::fault);
  EXPECT_EQ(bench.refusal(bench.begin(good)), Refusal::fault);
}

TEST(FirmwareCommissioning, AFaultOfThePowerStageEndsItAndIsNamed) {
  const std::pair<board::Injection, firmware::StageFault> cases[] = {
      {board::Injection::driver_fault, firmware::StageFault::driver},
      {board::Injection::thermistor_open, firmware::StageFault::thermistor_open}};
  for (const auto& [injection, named] : cases) {
    Bench bench;
    ASSERT_EQ(bench.begin(), Code::done);
    bench.drive->run(5'000);
    ASSERT_EQ(bench.progress().state, CommissioningState::runs);
    bench.drive->rig().inject(injection);
    bench.drive->run(firmware::periods_of(named) / 2 + 2);
    EXPECT_FALSE(bench.stage().commissions());
    EXPECT_EQ(bench.progress().state, CommissioningState::drive_fault);
    const auto status = bench.ask<protocol::Status>(Kind::status);
    EXPECT_EQ(status.mode, protocol::Mode::fault);
    EXPECT_EQ(protocol::fault_text(status.fault).name, "amplifier_fault");
    EXPECT_EQ(protocol::fault_text(status.fault, status.fault_limit).reason,
              protocol::stage_fault_text(static_cast<std::int32_t>(named)).reason);
    EXPECT_EQ(bench.refusal(bench.begin(begin_of(bench.setup()))), Refusal::fault);
  }
}

// The switches open within a tick, whatever ends it, and the reason can be read.
TEST(FirmwareCommissioning, AStopADisarmALostLinkASilentHostAndAProtectionOpenTheSwitches) {
  const auto ended = [](const char* what, auto&& act, CommissioningState expected, Mode mode) {
    Bench bench;
    ASSERT_EQ(bench.begin(), Code::done);
    bench.drive->run(5'000);
    ASSERT_EQ(bench.progress().state, CommissioningState::runs) << what;
    act(bench);
    EXPECT_TRUE(bench.is_off()) << what;
    EXPECT_EQ(bench.drive->status().mode, mode) << what;
    bench.host->identify();
    EXPECT_EQ(bench.progress().state, expected) << what;
    EXPECT_EQ(bench.drive->rig().three_phase()->power().motor().currents(0.0).q, 0.0) << what;
  };
  ended(
      "stop", [](Bench& b) { EXPECT_EQ(b.host->code(Kind::commissioning_stop), Code::done); },
      CommissioningState::stopped, Mode::idle);
  ended(
      "disarm", [](Bench& b) { b.host->command({.kind = protocol::CommandKind::disarm}); }, CommissioningState::stopped,
      Mode::idle);
  ended(
      "link", [](Bench& b) { b.drive->service().disconnected(), b.drive->run(1); }, CommissioningState::host_lost,
      Mode::idle);
  ended(
      "silence", [](Bench& b) { b.drive->run(10'001); }, CommissioningState::host_lost, Mode::idle);
  ended(
      "protection",
      [](Bench& b) { b.drive->rig().inject(board::Injection::temperature_out_of_range), b.drive->run(5); },
      CommissioningState::drive_fault, Mode::fault);
}

TEST(FirmwareCommissioning, TheDriveKeepsItsMotorOverAPowerCutAndFollowsWithIt) {
  for (std::uint64_t seed = 1; seed <= tests::in_campaign<std::uint64_t>(2, 4); ++seed) {
    Bench bench("", seed);
    const auto setup = bench.setup();
    const auto stage = bench.ask<protocol::CommissioningStage>(Kind::commissioning_stage);
    ASSERT_EQ(bench.begin(), Code::done);
    ASSERT_EQ(bench.finish().state, CommissioningState::done);
    const auto motor = deployment::motor_settings(setup, bench.stage().commissioning().result(),
                                                  std::ldexp(stage.shortest_pulse, -30), stage.encoder_counts, 1000.0);
    const drive::Bytes active = bench.host->read(protocol::Which::active);
    ASSERT_EQ(bench.host->flash(drive::with_motor(active, motor)), Code::done);
    const board::ThreePhaseParameters truth = bench.drive->rig().three_phase()->parameters();
    bench.start({.drive = demo(), .three_phase = true, .motor = truth});  // a power cut
    EXPECT_EQ(bench.stage().settings().pole_pairs, truth.motor.pole_pairs);
    bench.drive->run(2000);
    EXPECT_EQ(bench.host->arm(Mode::velocity).refusal, Refusal::none);
    protocol::Command set{.kind = protocol::CommandKind::set, .mode = Mode::velocity};
    set.velocity = std::int32_t{1} << 25;  // a quarter of the base
    for (int k = 0; k < 20; ++k) {
      EXPECT_EQ(bench.host->command(set).refusal, Refusal::none);
      bench.drive->run(500);
    }
    const double wanted = 0.25 * demo().rated_velocity_rad_s;
    EXPECT_EQ(bench.drive->status().mode, Mode::velocity) << int(bench.drive->status().fault.fault);
    EXPECT_NEAR(bench.drive->rig().truth().motor_velocity, wanted, 0.05 * wanted) << seed;
  }
}

TEST(FirmwareCommissioning, ABlockWithAMotorOutsideItsBoundsIsRefused) {
  const drive::Bytes made = twin::factory_block(demo());
  control::MotorSettings motor;
  motor.pole_pairs = 7;
  motor.encoder_counts = static_cast<std::uint32_t>(demo().sensors.motor_counts);
  motor.gain = {4096, 4096, 4096};
  const auto stage = board::three_phase_settings_of(demo());
  motor.current = stage.foc.current;
  motor.circle = stage.foc.circle;
  motor.resistance = motor.inductance_d = motor.inductance_q = motor.flux = 1;
  motor.bandwidth_mhz = 1'000'000;
  const auto fault_of = [&](auto&& change) {
    control::MotorSettings changed = motor;
    change(changed);
    return control::check_for_drive(drive::with_motor(made, changed), 20'000).fault;
  };
  using model::BlockFault;
  EXPECT_EQ(fault_of([](auto&) {}), BlockFault::none);
  EXPECT_EQ(fault_of([](auto& m) { m.pole_pairs = 0; }), BlockFault::wrong_coefficient);
  EXPECT_EQ(fault_of([](auto& m) { m.pole_pairs = 41; }), BlockFault::unlike_coefficients);
  EXPECT_EQ(fault_of([](auto& m) { m.gain.b = 9000; }), BlockFault::unlike_coefficients);
  EXPECT_EQ(fault_of([](auto& m) { m.current.voltage_exponent = 4; }), BlockFault::unlike_coefficients);
  EXPECT_EQ(fault_of([](auto& m) { m.current.d.half_period_gain_less_one = 1; }), BlockFault::unlike_coefficients);
  EXPECT_EQ(fault_of([](auto& m) { m.encoder_counts += 1; }), BlockFault::unlike_coefficients);
  EXPECT_EQ(control::motor_of(drive::with_motor(made, motor)).current.d.proportional, stage.foc.current.d.proportional);
  EXPECT_EQ(control::motor_of(made).pole_pairs, 0U);
  control::MotorSettings wrong = motor;
  wrong.gain.b = 9000;
  EXPECT_EQ(control::check_for_drive(drive::with_motor(made, wrong), 20'000, {}, control::kHasNoStage).fault,
            BlockFault::none)
      << "a drive without a stage passes over it";
  // Another model keeps it, and a backup of another drive does not bring its own; a drive without one takes that.
  EXPECT_EQ(drive::motor_of(drive::keeping_motor(made, drive::with_motor(made, motor))).pole_pairs, 7U);
  control::MotorSettings other = motor;
  other.pole_pairs = 5;
  const drive::Bytes backup = drive::with_motor(made, other);
  EXPECT_EQ(drive::motor_of(drive::keeping_motor(backup, drive::with_motor(made, motor))).pole_pairs, 7U);
  EXPECT_EQ(drive::keeping_motor(backup, made), backup);
  EXPECT_EQ(drive::keeping_motor(made, made), made);
}

}  // namespace
}  // namespace flexspline::tests::firmware_commissioning_test
