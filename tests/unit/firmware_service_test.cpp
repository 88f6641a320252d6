// What a host may ask of a drive, on the twin: the service with the application, flash memory and plant behind it.
#include "firmware/service.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <random>
#include <vector>

#include "hil/board/drive_setup.hpp"
#include "hil/twin/factory_block.hpp"
#include "shared/protocol/excitation_requests.hpp"
#include "shared/protocol/texts.hpp"
#include "tests/support/service_host.hpp"

namespace flexspline::firmware_service_test {
namespace {

using protocol::Code;
using protocol::CommandKind;
using protocol::Kind;
using protocol::Mode;
using protocol::Refusal;
using tests::ServiceHost;
using twin::TwinDrive;
using Bytes = std::vector<std::uint8_t>;

const plant::Drive& demo() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}
// The demo's drive with more friction: another block for the same drive.
Bytes other_block(double scale = 1.1) {
  plant::Drive drive = demo();
  for (plant::Effect& effect : drive.effects)
    if (effect.type == "viscous_friction") effect.parameter("coefficient").value *= scale;
  return twin::factory_block(drive);
}
struct Bench {
  TwinDrive drive{{.drive = demo()}};
  ServiceHost host{drive};
  Bench() {
    drive.run(200);
    EXPECT_EQ(host.identify(), Code::done);
  }
};

TEST(Service, ServesNothingButIdentifyUntilTheMajorVersionsAgree) {
  TwinDrive drive({.drive = demo(), .serial = "SN-7"});
  ServiceHost host(drive);
  drive.run(200);
  EXPECT_EQ(host.code(Kind::status), Code::wrong_version);
  EXPECT_EQ(host.code(Kind::command, protocol::Command{.kind = CommandKind::arm, .mode = Mode::velocity}),
            Code::wrong_version);
  const protocol::Message m = host.ask(Kind::identify, protocol::Hello{protocol::kMajor + 1, 0});
  protocol::Identity id;
  EXPECT_EQ(protocol::take_payload(m.content(), id), Code::done);
  EXPECT_EQ(id.major, protocol::kMajor);
  EXPECT_EQ(id.firmware_key, protocol::FirmwareKey::development);
  EXPECT_EQ(id.tick_hz, 20'000U);
  EXPECT_EQ(id.block_bytes, TwinDrive::Store::kCapacity);
  EXPECT_STREQ(reinterpret_cast<const char*>(id.serial.data()), "SN-7");
  EXPECT_EQ(host.code(Kind::status), Code::wrong_version) << "another major";
  EXPECT_EQ(host.code(Kind::identify, protocol::Hello{protocol::kMajor, 99}), Code::done) << "a later minor";
  EXPECT_EQ(host.code(Kind::status), Code::done);
  drive.service().disconnected();
  EXPECT_EQ(host.code(Kind::status), Code::wrong_version) << "a new host";
}

TEST(Service, NamesTheEffectsOfItsImage) {
  Bench b;
  protocol::Effects effects;
  ASSERT_EQ(protocol::take_payload(b.host.ask(Kind::effects).content(), effects), Code::done);
  using Model = decltype(firmware::Parameters::model);
  EXPECT_TRUE(effects.has(Model::number_of<effects::ViscousFriction>()));
  std::size_t count = 0;
  for (int n = 0; n < 256; ++n) count += effects.has(static_cast<std::uint8_t>(n)) ? 1 : 0;
  std::size_t expected = 0;
  Model{}.for_each([&]<class Effect>(auto&) { ++expected; });
  EXPECT_EQ(count, expected);
}

TEST(Service, RefusesByCodeWhatItDoesNotKnow) {
  Bench b;
  for (const int kind : {0x00, 0x0F, 0x43, 0x6F})
    EXPECT_EQ(b.host.code(static_cast<Kind>(kind)), Code::unknown_request) << kind;
  EXPECT_EQ(b.host.code(Kind::status, protocol::Reason{}), Code::wrong_length);
  EXPECT_EQ(b.host.code(Kind::command), Code::wrong_length);
  EXPECT_EQ(b.host.code(Kind::block_read, protocol::BlockRead{protocol::Which::previous, 0}), Code::no_block);
  protocol::Command c;
  c.current = INT32_MIN;
  EXPECT_EQ(b.host.code(Kind::command, c), Code::wrong_value);
  protocol::Subscription s;
  s.every = 0;
  s.count = 1;
  EXPECT_EQ(b.host.code(Kind::telemetry, s), Code::wrong_value);
}

TEST(Service, FlashesABlockReadsItBackAndRestoresTheOneBefore) {
  Bench b;
  const Bytes made = twin::factory_block(demo()), other = other_block();
  ASSERT_NE(made, other);
  EXPECT_EQ(b.host.read(protocol::Which::active), made);
  EXPECT_EQ(b.host.flash(other), Code::done);
  EXPECT_EQ(b.host.read(protocol::Which::active), other);
  EXPECT_EQ(b.host.read(protocol::Which::previous), made);
  const protocol::Status s = b.host.status();
  EXPECT_TRUE(s.has_parameters);
  EXPECT_EQ(s.sequence, 5U);
  EXPECT_EQ(s.active, (protocol::StoredBlock{static_cast<std::uint32_t>(other.size()), model::crc32(other)}));
  EXPECT_EQ(b.host.code(Kind::block_restore, protocol::BlockRestore{5}), Code::done);
  EXPECT_EQ(b.host.read(protocol::Which::active), made);
  EXPECT_EQ(b.host.code(Kind::block_restore, protocol::BlockRestore{5}), Code::done) << "asked again";
  EXPECT_EQ(b.host.read(protocol::Which::active), made) << "and done once";
  EXPECT_EQ(b.host.code(Kind::block_restore, protocol::BlockRestore{1}), Code::wrong_value);
}

TEST(Service, WhatWasFlashedIsThereAtTheNextStart) {
  const auto file = std::filesystem::temp_directory_path() / "flexspline_service_test.flash";
  std::filesystem::remove(file);
  const Bytes other = other_block();
  {
    TwinDrive drive({.drive = demo(), .flash_file = file});
    ServiceHost host(drive);
    drive.run(200);
    host.identify();
    EXPECT_EQ(host.flash(other), Code::done);
    // Staged and never committed.
    host.code(Kind::block_begin, protocol::BlockBegin{1000, 1});
    host.code(Kind::block_chunk, protocol::Chunk{0, {1, 2, 3, 4}, 4});
  }
  TwinDrive drive({.drive = demo(), .flash_file = file});
  ServiceHost host(drive);
  drive.run(200);
  host.identify();
  EXPECT_EQ(host.read(protocol::Which::active), other);
  EXPECT_EQ(host.status().store, protocol::StoreState::good);
  EXPECT_TRUE(host.status().has_parameters);
  std::filesystem::remove(file);
}

TEST(Service, AFactoryResetErasesBothBlocksOfADriveThatStandsAndIsNotArmed) {
  Bench b;
  ASSERT_EQ(b.host.flash(twin::factory_block(demo())), Code::done);
  ASSERT_EQ(b.host.arm(protocol::Mode::velocity).refusal, protocol::Refusal::none);
  EXPECT_EQ(b.host.code(Kind::block_erase_all), Code::armed);
  b.host.command({.kind = protocol::CommandKind::disarm});
  b.drive.run(200);
  EXPECT_EQ(b.host.code(Kind::block_erase_all), Code::done);
  const protocol::Status s = b.host.status();
  EXPECT_EQ(s.active.bytes, 0U);
  EXPECT_EQ(s.previous.bytes, 0U);
  EXPECT_TRUE(s.has_parameters) << "until the next start";
  EXPECT_EQ(b.host.flash(twin::factory_block(demo())), Code::done);
}

TEST(Service, ABlockThatIsDamagedOrForAnotherTickRateIsRefusedAndTheOldOneStaysInUse) {
  Bench b;
  const Bytes made = b.host.read(protocol::Which::active);
  std::uint32_t reason = 0;
  Bytes damaged = other_block();
  damaged[300] ^= 1;
  EXPECT_EQ(b.host.flash(damaged, &reason), Code::invalid);
  EXPECT_EQ(reason, static_cast<std::uint32_t>(model::BlockFault::wrong_checksum));
  const auto d = board::constants_of(demo(), 10'000);
  const board::Block slow(board::parameters_of(demo(), board::setup_of(demo(), d)), d);
  Bytes other_rate;
  for (const std::byte byte : slow.bytes()) other_rate.push_back(static_cast<std::uint8_t>(byte));
  EXPECT_EQ(b.host.flash(other_rate, &reason), Code::invalid);
  EXPECT_EQ(reason, static_cast<std::uint32_t>(model::BlockFault::other_tick_rate));
  EXPECT_EQ(b.host.read(protocol::Which::active), made);
  EXPECT_EQ(b.host.arm(Mode::velocity).refusal, Refusal::none);
}

TEST(Service, NothingThatTheDriveComputesWithChangesWhileItIsArmed) {
  Bench b;
  const Bytes other = other_block();
  ASSERT_EQ(b.host.flash(other), Code::done);
  // Staged while idle, then armed.
  ASSERT_EQ(b.host.code(Kind::block_begin, protocol::BlockBegin{8, 0}), Code::done);
  ASSERT_EQ(b.host.arm(Mode::velocity).refusal, Refusal::none);
  EXPECT_EQ(b.host.code(Kind::block_begin, protocol::BlockBegin{8, 0}), Code::armed);
  EXPECT_EQ(b.host.code(Kind::block_chunk, protocol::Chunk{0, {1, 2, 3, 4}, 4}), Code::armed);
  EXPECT_EQ(b.host.code(Kind::block_commit), Code::armed);
  EXPECT_EQ(b.host.code(Kind::block_restore, protocol::BlockRestore{2}), Code::armed);
  protocol::Excitation e;
  e.ticks = 100, e.line_count = 1, e.limit = 1000, e.rate = 1;
  EXPECT_EQ(b.host.code(Kind::excitation, e), Code::armed);
  EXPECT_EQ(b.host.code(Kind::excitation_use), Code::not_begun);
  EXPECT_EQ(b.host.command({.kind = CommandKind::disarm}).mode, Mode::idle);
  EXPECT_EQ(b.host.code(Kind::excitation, e), Code::done);
}

TEST(Service, AHostThatGoesSilentIsNoticedAndAFaultHasToBeClearedFirst) {
  Bench b;
  ASSERT_EQ(b.host.arm(Mode::velocity).mode, Mode::velocity);
  b.drive.run(20'000 / 5);
  protocol::Status s = b.host.status();
  EXPECT_EQ(protocol::fault_text(s.fault).name, "host_lost");
  EXPECT_EQ(s.mode, Mode::fault);
  EXPECT_EQ(b.host.arm(Mode::velocity).refusal, Refusal::fault);
  EXPECT_EQ(b.host.command({.kind = CommandKind::clear_fault}).mode, Mode::boot);
  b.drive.run(100);
  EXPECT_EQ(b.host.arm(Mode::velocity).refusal, Refusal::none);
}

TEST(Service, AnExcitationSentByTheHostRunsWithTheNumbersThatTheHostDerived) {
  Bench b;
  const auto d = board::constants_of(demo());
  control::ExcitationSetup<double> setup;
  setup.amplitude = 40.0, setup.frequency_hz = 2.0, setup.ticks = 20'000, setup.fade_ticks = 5'000;
  setup.limit = 60.0, setup.slope_limit = 1e4;
  setup = control::multi_sine(setup, {.seed = 5, .first = 1, .last = 9});
  const auto c = control::Excitation::derive<fixed::Fixed>(setup, d.velocity_base, d);
  ASSERT_TRUE(protocol::send_excitation(
      c, false, [&](Kind kind, const auto& payload) { return b.host.code(kind, payload) == Code::done; }));
  protocol::Subscription s;
  s.every = 1;
  s.channels = {protocol::Channel::set_velocity};
  s.count = 1;
  ASSERT_EQ(b.host.code(Kind::telemetry, s), Code::done);
  ASSERT_EQ(b.host.arm(Mode::excitation).mode, Mode::excitation);
  for (int i = 0; i < 15 && b.drive.status().mode == firmware::Mode::excitation; ++i) {
    for (int k = 0; k < 1'500; ++k) {
      b.drive.tick();
      protocol::Message m;
      while (b.drive.service().next(m)) b.host.frames.push_back(m);
    }
    b.host.command({});
  }
  EXPECT_EQ(b.host.status().mode, Mode::idle) << "it ends by itself";
  std::vector<std::int32_t> seen;
  for (const protocol::Message& m : b.host.frames)
    EXPECT_TRUE(protocol::for_each_frame(
        m, [&](auto&, auto, auto words) { seen.push_back(static_cast<std::int32_t>(words[0])); }));
  // The same excitation on the host, tick for tick from where the drive began.
  control::Excitation::State<fixed::Fixed> state;
  control::Excitation::start<fixed::Fixed>(state, c);
  std::size_t at = 0;
  while (at < seen.size() && seen[at] == 0) ++at;
  std::vector<std::int32_t> expected;
  for (std::uint32_t tick = 0; tick < setup.ticks; ++tick)
    expected.push_back(control::Excitation::update<fixed::Fixed>(state, c, {}).raw);
  std::size_t zeros = 0;
  while (expected[zeros] == 0) ++zeros;
  ASSERT_GT(seen.size(), at + expected.size() - zeros - 10);
  for (std::size_t i = zeros; i + 10 < expected.size(); ++i) ASSERT_EQ(seen[at + i - zeros], expected[i]) << i;
}

TEST(Service, TelemetryComesWithoutAGapAndWhatASlowHostMissesIsCounted) {
  Bench b;
  protocol::Subscription s;
  s.every = 20;
  s.count = 6;
  for (std::size_t i = 0; i < s.count; ++i) s.channels[i] = static_cast<protocol::Channel>(5 + i);
  ASSERT_EQ(b.host.code(Kind::telemetry, s), Code::done);
  std::uint32_t next = 0, frames = 0, lost = 0, messages = 0;
  const auto fetch = [&] {
    protocol::Message m;
    while (b.drive.service().next(m)) {
      ++messages;
      EXPECT_TRUE(protocol::for_each_frame(m, [&](const protocol::FrameHead& head, std::uint32_t i, auto words) {
        EXPECT_EQ(words.size(), 6U);
        lost += head.sequence + i - next;
        next = head.sequence + i + 1;
        ++frames;
      }));
    }
  };
  for (int k = 0; k < 20'000; ++k) {
    b.drive.tick();
    fetch();
  }
  EXPECT_EQ(frames, 1000U);
  EXPECT_EQ(lost, 0U);
  EXPECT_EQ(messages, 500U) << "two frames of six channels have room in a report";
  // A host that does not look for two seconds; the ring of 2048 words holds 256 frames of eight.
  b.drive.run(40'000);
  EXPECT_EQ(b.host.status().dropped, 2000U - 256U);
  for (const protocol::Message& m : b.host.frames) EXPECT_TRUE(m.is_unasked());
  b.host.frames.clear();
}

// A slow decimation does not make a monitor wait for a full report.
TEST(Service, AFrameWaitsNoLongerThanTenMillisecondsForItsReport) {
  Bench b;
  protocol::Subscription s;
  s.every = 2'000;
  s.count = 1;
  ASSERT_EQ(b.host.code(Kind::telemetry, s), Code::done);
  int messages = 0;
  for (int k = 0; k < 20'000; ++k) {
    b.drive.tick();
    protocol::Message m;
    while (b.drive.service().next(m)) ++messages;
  }
  EXPECT_EQ(messages, 10);
}

Bytes known_kinds() {
  return {0x01, 0x02, 0x03, 0x10, 0x11, 0x12, 0x13, 0x14, 0x20, 0x21, 0x22, 0x23, 0x24, 0x30};
}
// Requests that are nearly right: kinds and lengths that exist, small numbers among random ones.
protocol::Message some_request(std::mt19937& random) {
  constexpr std::uint8_t kLengths[] = {2, 0, 0, 8, 16, 0, 2, 5, 24, 51, 20, 14, 0, 5};
  const std::size_t which = random() % known_kinds().size();
  protocol::Message m;
  m.kind = random() % 50 == 0 ? static_cast<std::uint8_t>(random()) : known_kinds()[which];
  m.number = static_cast<std::uint8_t>(random());
  m.length = random() % 20 == 0 ? static_cast<std::uint8_t>(random() % 61) : kLengths[which];
  for (auto& byte : m.payload) byte = static_cast<std::uint8_t>(random() % 2 == 0 ? random() % 5 : random());
  return m;
}

TEST(Service, NothingThatAHostSendsArmsADriveFromAFault) {
  Bench b;
  b.drive.rig().inject(board::Injection::motor_encoder_stale);
  b.drive.run(100);
  ASSERT_EQ(b.host.status().mode, Mode::fault);
  std::mt19937 random(11);
  for (int i = 0; i < 20'000; ++i) {
    protocol::Message m = some_request(random);
    b.drive.service().take(m);
    b.drive.tick();
    ASSERT_FALSE(is_armed(b.drive.status().mode)) << i;
    ASSERT_EQ(b.drive.rig().current_a(), 0.0);
    while (b.drive.service().next(m)) {
    }
  }
}

TEST(Service, WhateverAHostSendsCurrentAndVelocityStayWithinTheLimitsOfTheParameters) {
  Bench b;
  std::mt19937 random(12);
  std::uint64_t armed_ticks = 0;
  double most_current = 0.0, most_velocity = 0.0;
  for (int i = 0; i < 30'000; ++i) {
    protocol::Message m = some_request(random);
    if (random() % 3 == 0) {
      // Clears, arms and sets more often than chance alone would.
      protocol::Command c;
      c.kind = static_cast<CommandKind>(random() % 5);
      c.mode = static_cast<Mode>(random() % 8);
      c.compensate = random() % 2 == 0;
      c.stream = random() % 2 == 0;
      c.position = static_cast<std::int64_t>((std::uint64_t{random()} << 32) | random()) >> (random() % 40);
      c.velocity = static_cast<std::int32_t>(random());
      c.acceleration = static_cast<std::int32_t>(random());
      c.current = static_cast<std::int32_t>(random());
      m = protocol::request(Kind::command, 1, c);
    }
    b.drive.service().take(m);
    const int ticks = 1 + static_cast<int>(random() % 8);
    for (int k = 0; k < ticks; ++k) {
      b.drive.tick();
      armed_ticks += is_armed(b.drive.status().mode) ? 1 : 0;
      most_current = std::max(most_current, std::abs(b.drive.rig().current_a()));
      most_velocity = std::max(most_velocity, std::abs(b.drive.rig().truth().motor_velocity));
    }
    while (b.drive.service().next(m)) {
    }
  }
  std::printf("armed for %.2f s, at most %.3f A and %.1f rad/s\n", static_cast<double>(armed_ticks) / 20'000.0,
              most_current, most_velocity);
  EXPECT_GT(armed_ticks, 2'000U);
  EXPECT_LE(most_current, demo().current_limit_a * 1.001);
  EXPECT_LE(most_velocity, 1.25 * demo().rated_velocity_rad_s);
}

}  // namespace
}  // namespace flexspline::firmware_service_test
