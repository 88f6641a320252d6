#include "host/drive_link/drive/session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "hil/twin/factory_block.hpp"
#include "hil/twin/twin_drive.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/drive/dataset_writer.hpp"
#include "host/drive_link/drive/recorder.hpp"
#include "host/drive_link/drive/silence.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/loopback.hpp"
#include "tests/support/two_ampere_drive.hpp"

namespace flexspline::drive::drive_session_test {
namespace {

using protocol::Code;
using protocol::Kind;

const plant::Drive& demo() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}
Bytes other_block() {
  plant::Drive drive = demo();
  for (plant::Effect& effect : drive.effects)
    if (effect.type == "viscous_friction") effect.parameter("coefficient").value *= 1.2;
  return twin::factory_block(drive);
}

using tests::open_session;
using Loss = tests::OnAnswer;
// Loses the first `times` answers of a kind.
Loss lose(Kind kind, int times) {
  return [kind, times](const protocol::Message& m) mutable { return m.request() == kind && times-- > 0; };
}
std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Session, IdentifiesTheDriveAndReadsItsBlock) {
  twin::TwinDrive drive({.drive = demo(), .serial = "SN-9"});
  Session session = open_session(drive);
  EXPECT_EQ(session.serial(), "SN-9");
  EXPECT_EQ(session.board(), "twin");
  EXPECT_EQ(session.read_block(protocol::Which::active), twin::factory_block(demo()));
  EXPECT_TRUE(session.read_block(protocol::Which::previous).empty());
}

TEST(Session, FlashesThroughLostAnswersOfEveryKind) {
  for (const Kind kind : {Kind::identify, Kind::block_chunk, Kind::block_commit, Kind::status, Kind::block_read}) {
    twin::TwinDrive drive({.drive = demo()});
    Session session = open_session(drive, lose(kind, 1));
    const Bytes block = other_block();
    session.write_block(block);
    EXPECT_TRUE(std::ranges::equal(drive.store().active(), block)) << static_cast<int>(kind);
    EXPECT_EQ(drive.store().sequence(), 5U) << "once, and not twice";
  }
}

TEST(Session, ADriveThatHasJustStartedIsAskedAgainUntilItsShaftIsSeenToStand) {
  for (const Kind kind : {Kind::block_begin, Kind::block_erase_all}) {
    int times = 3;
    twin::TwinDrive drive({.drive = demo()});
    Session session = open_session(drive, [&](protocol::Message& m) {
      if (m.request() == kind && times-- > 0) m.code = static_cast<std::uint8_t>(protocol::Code::moving);
      return false;
    });
    if (kind == Kind::block_begin) session.write_block(other_block());
    if (kind == Kind::block_erase_all) session.erase_all_blocks();
    EXPECT_LE(times, 0) << static_cast<int>(kind);
  }
  // One that turns refuses in the end.
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive, [](protocol::Message& m) {
    if (m.request() == Kind::block_begin) m.code = static_cast<std::uint8_t>(protocol::Code::moving);
    return false;
  });
  EXPECT_NE(error_of([&] { session.write_block(other_block()); }).find("the shaft turns"), std::string::npos);
}

TEST(Session, ARestoreWhoseAnswerGotLostIsDoneOnce) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive, lose(Kind::block_restore, 1));
  session.write_block(other_block());
  session.restore();
  EXPECT_TRUE(std::ranges::equal(drive.store().active(), twin::factory_block(demo())));
  EXPECT_EQ(drive.store().sequence(), 7U);
}

TEST(Session, ADriveThatDoesNotAnswerIsAnErrorThatSaysWhatToDo) {
  twin::TwinDrive drive({.drive = demo()});
  EXPECT_NE(
      error_of([&] { open_session(drive, [](const auto&) { return true; }); }).find("loopback: nothing there answers"),
      std::string::npos);
}

TEST(Session, WhatTheDriveRefusesIsSaidInWords) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive);
  Bytes damaged = other_block();
  damaged[200] ^= 1;
  EXPECT_NE(error_of([&] { session.write_block(damaged); }).find("validator refused the block"), std::string::npos);
  EXPECT_NE(error_of([&] { session.restore(); }).find("no valid block before"), std::string::npos);
  session.command({.kind = protocol::CommandKind::arm, .mode = protocol::Mode::velocity});
  EXPECT_NE(error_of([&] { session.write_block(other_block()); }).find("disarm it first"), std::string::npos);
  EXPECT_NE(error_of([&] {
              session.command({.kind = protocol::CommandKind::set, .mode = protocol::Mode::current});
            }).find("another mode"),
            std::string::npos);
  session.stop();
  EXPECT_EQ(session.status().mode, protocol::Mode::idle);
}

planning::Plan plan_of(planning::Run run) {
  planning::Plan plan;
  plan.runs.push_back(std::move(run));
  return plan;
}

TEST(Recorder, RecordsARunAndLeavesTheDriveAtRest) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive);
  const Scales scales = scales_of(session);
  planning::Run run;
  run.name = "sine", run.waveform = planning::Waveform::sine;
  run.amplitude = 40.0, run.frequency_hz = 2.0, run.duration_s = 1.5;
  const planning::Plan plan = plan_of(run);
  const Recording r = Recorder(session, scales, plan).record(run, {});
  EXPECT_TRUE(r.complete) << r.ended;
  EXPECT_EQ(r.lost, 0U);
  EXPECT_GE(r.time_s.size(), 1500U);
  EXPECT_LE(r.time_s.size(), 1600U);
  EXPECT_EQ(session.status().mode, protocol::Mode::idle);
  // The position is the integral of the command: a sine of 40 rad/s at 2 Hz swings by 6.37 rad.
  double most = 0.0, set = 0.0, least = 0.0;
  for (std::size_t k = 0; k < r.time_s.size(); ++k) {
    most = std::max(most, r.motor_position_rad[k] - r.motor_position_rad.front());
    least = std::min(least, r.motor_position_rad[k] - r.motor_position_rad.front());
    set = std::max(set, r.command[k]);
    EXPECT_NEAR(r.output_position_rad[k], r.motor_position_rad[k] / 100.0, 0.003);
  }
  EXPECT_NEAR(set, 40.0, 0.1);
  EXPECT_NEAR(most - least, 6.37, 0.4);
}

TEST(Recorder, PositionsOfALinearAxisAreInMetres) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive);
  Scales scales = scales_of(session);
  // As the block of an axis with a pitch of 10 mm; its velocities stay what they are.
  scales.header.axis = 1;
  scales.constants.turn_angle_scale = kTurn / 0.01;
  planning::Run run;
  run.name = "sine", run.waveform = planning::Waveform::sine;
  run.amplitude = 40.0, run.frequency_hz = 2.0, run.duration_s = 1.5;
  planning::Plan plan = plan_of(run);
  plan.limits.velocity_rad_s = 40.0;
  const Recording r = Recorder(session, scales, plan).record(run, {});
  EXPECT_TRUE(r.complete) << r.ended;
  const auto [least, most] = std::ranges::minmax(r.motor_position_rad);
  EXPECT_NEAR(most - least, 6.37 / kTurn * 0.01, 0.4 / kTurn * 0.01);
  for (std::size_t k = 0; k < r.time_s.size(); ++k)
    EXPECT_NEAR(r.output_position_rad[k], r.motor_position_rad[k] / 100.0, 0.003 / kTurn * 0.01);
}

TEST(Recorder, SetPointsOfALinearAxisAreInMetres) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive);
  Scales scales = scales_of(session);
  scales.constants.turn_angle_scale = kTurn / 0.01;
  planning::Run run;
  run.mode = planning::Mode::position, run.waveform = planning::Waveform::zero;
  run.offset = 0.02, run.duration_s = 10.0;
  PositionMotion motion(run, {}, scales);
  motion.start_at(0);
  EXPECT_NEAR(std::ldexp(static_cast<double>(motion.at(5.0, 0.02).position), -32), 2.0, 1e-9) << "turns";
}

TEST(Recorder, OnlyWhatADriveMeasuresIsInItsFile) {
  Recording r;
  r.run.name = "run";
  r.time_s = {0.0}, r.current_a = {1.0}, r.motor_position_rad = {2.0}, r.output_position_rad = {3.0};
  r.torque_nm = {4.0}, r.temperature_c = {5.0}, r.command = {6.0};
  const Scales scales = *scales_of(twin::factory_block(demo()));
  const std::string all = csv_of(r, scales, {});
  EXPECT_NE(all.find("output_position_rad,torque_nm,temperature_c"), std::string::npos) << all;
  EXPECT_NE(all.find("\n0,1,2,3,4,5,6\n"), std::string::npos) << all;
  EXPECT_NE(all.find("# motor_position_zero: absolute\n# output_position_zero: absolute\n"), std::string::npos) << all;
  const std::string few =
      csv_of(r, scales, {}, {.output = false, .torque = false, .knows_turn = false, .knows_output = false});
  EXPECT_NE(few.find("motor_position_rad,temperature_c"), std::string::npos) << few;
  EXPECT_NE(few.find("\n0,1,2,5,6\n"), std::string::npos) << few;
  EXPECT_NE(few.find("# motor_position_zero: none\n"), std::string::npos) << few;
  EXPECT_EQ(few.find("output_position_zero"), std::string::npos) << few;
  const std::string unknown = csv_of(r, scales, {}, {.knows_turn = false, .knows_output = false});
  EXPECT_NE(unknown.find("# output_position_zero: none\n"), std::string::npos) << unknown;
}

TEST(Recorder, WhatADriveMeasuresIsInItsBlock) {
  const Measures both = measures_of(twin::factory_block(demo()));
  EXPECT_TRUE(both.output);
  EXPECT_TRUE(both.torque);
  deployment::PackOptions options;
  options.samples = 300;
  options.tick_hz = 20'000;
  options.settings = "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 4096\n";
  const Measures none = measures_of(deployment::pack(tests::two_ampere_drive(), options).bytes);
  EXPECT_FALSE(none.output);
  EXPECT_FALSE(none.torque);
}

TEST(Recorder, StopsWhenItIsToldToAndBrakesTheShaft) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive);
  const Scales scales = scales_of(session);
  planning::Run run;
  run.name = "long", run.waveform = planning::Waveform::square;
  run.amplitude = 100.0, run.frequency_hz = 0.1, run.duration_s = 30.0;
  const planning::Plan plan = plan_of(run);
  int asked = 0;
  const Recording r = Recorder(session, scales, plan).record(run, {[&] { return ++asked > 300; }, {}});
  EXPECT_FALSE(r.complete);
  EXPECT_EQ(r.ended, "interrupted");
  EXPECT_EQ(session.status().mode, protocol::Mode::idle);
  EXPECT_EQ(session.status().fault, 0U);
  EXPECT_LT(std::abs(drive.rig().truth().motor_velocity), 2.0) << "braked, not coasting";
}

TEST(Recorder, AVelocityBeyondThePlansLimitEndsTheRun) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = open_session(drive);
  const Scales scales = scales_of(session);
  planning::Run run;
  run.name = "current", run.mode = planning::Mode::current, run.waveform = planning::Waveform::zero;
  run.offset = 1.3, run.duration_s = 10.0;
  planning::Plan plan = plan_of(run);
  plan.limits.travel_rad = 0.5;
  const Recording r = Recorder(session, scales, plan).record(run, {});
  EXPECT_FALSE(r.complete);
  EXPECT_NE(r.ended.find("travel of the output"), std::string::npos) << r.ended;
  // With a limit of velocity the drive guards itself and the run ends by its time or its travel.
  plan.limits.velocity_rad_s = 20.0;
  plan.limits.travel_rad = 0.0;
  plan.runs[0].duration_s = run.duration_s = 1.0;
  const Recording guarded = Recorder(session, scales, plan).record(run, {});
  EXPECT_TRUE(guarded.complete) << guarded.ended;
}

TEST(DriveSilence, IsCountedWhileTheHostListensAndNotWhileItStandsStill) {
  using std::chrono::milliseconds;
  Silence::Clock::time_point now;
  Silence silence(milliseconds(100), now);
  const auto wait = [&](milliseconds took, bool heard) { silence.waited(milliseconds(5), heard, now += took); };
  for (int k = 0; k < 20; ++k) wait(milliseconds(5), false);
  EXPECT_FALSE(silence.is_too_long()) << "100 ms are not more than 100 ms";
  wait(milliseconds(5), false);
  EXPECT_TRUE(silence.is_too_long());
  wait(milliseconds(1), true);
  EXPECT_FALSE(silence.is_too_long());
  // Stopped for an hour within one wait.
  wait(std::chrono::hours(1), false);
  EXPECT_FALSE(silence.is_too_long());
  // Waits that end early, as on a line with noise, count as long as they take.
  for (int k = 0; k < 80; ++k) wait(milliseconds(1), false);
  EXPECT_FALSE(silence.is_too_long());
  for (int k = 0; k < 20; ++k) wait(milliseconds(1), false);
  EXPECT_TRUE(silence.is_too_long());
}

}  // namespace
}  // namespace flexspline::drive::drive_session_test
