// A drive whose parameters are locked, on the twin: what a host may do without the key.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "hil/twin/factory_block.hpp"
#include "shared/protocol/access.hpp"
#include "shared/protocol/map_payloads.hpp"
#include "tests/support/pairing_host.hpp"
#include "tests/support/service_host.hpp"

namespace flexspline::tests::firmware_pairing_test {
namespace {

using protocol::Access;
using protocol::Code;
using protocol::Kind;
using protocol::Mode;
using protocol::PairingAction;
using protocol::PairingState;

const plant::Drive& demo() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}

struct Bench {
  twin::FlashFile flash;
  twin::PairingFile pairing;
  twin::TwinDrive drive{{.drive = demo(), .flash = &flash, .pairing = &pairing}};
  ServiceHost host{drive};
  Bench() { start(); }
  void start() {
    drive.run(200);
    identify();
  }
  void identify() {
    EXPECT_EQ(protocol::take_payload(host.ask(Kind::identify, protocol::Hello{}).content(), id), Code::done);
  }
  Code answer(const SigningKey& key, PairingAction action) {
    protocol::PairingChallenge c;
    const protocol::Message m = host.ask(Kind::pairing_challenge);
    if (protocol::take_payload(m.content(), c) != Code::done) return static_cast<Code>(m.code);
    for (const auto& part : answer_of(key, action, {id.board, id.serial}, c.nonce).parts())
      EXPECT_EQ(host.code(Kind::pairing_part, part), Code::done);
    return host.code(Kind::pairing_answer, protocol::PairingAnswer{action});
  }
  void pair() {
    EXPECT_EQ(answer(owner(), PairingAction::pair), Code::done);
    EXPECT_EQ(host.code(Kind::pairing_lock), Code::done);
  }
  PairingState state() {
    protocol::Pairing known;
    EXPECT_EQ(protocol::take_payload(host.ask(Kind::pairing).content(), known), Code::done);
    return known.state;
  }
  std::vector<std::uint8_t> block() { return twin::factory_block(demo()); }
  protocol::Identity id;
};

std::vector<std::uint8_t> bytes_of(const twin::FlashMemory& memory, std::size_t sector, std::size_t count) {
  const auto bytes = memory.bytes(sector).first(count);
  return {bytes.begin(), bytes.end()};
}

// All numbers that a request can have: a kind that is added is among them.
std::vector<Kind> kinds_of_requests() {
  std::vector<Kind> kinds;
  for (unsigned n = 0; n < protocol::kEndOfRequests; ++n) kinds.push_back(static_cast<Kind>(n));
  return kinds;
}

TEST(Pairing, EveryRequestThatWritesIsRefusedByALockedDriveAndNoOther) {
  Bench bench;
  bench.pair();
  std::vector<std::string> refused;
  for (const Kind kind : kinds_of_requests()) {
    const bool is_locked = bench.host.code(kind) == Code::locked;
    EXPECT_EQ(is_locked, protocol::access_of(kind) == Access::writes) << static_cast<int>(kind);
    if (is_locked) refused.push_back(std::to_string(static_cast<int>(kind)));
    if (kind == Kind::identify) EXPECT_EQ(bench.host.identify(), Code::done);
  }
  EXPECT_EQ(refused.size(), 8U)
      << "upload in three requests, restore, factory reset, residual map, end of the pairing, commissioning";
}

TEST(Pairing, WhateverElseALockedDriveIsSentItsMemoryAndItsBlockStay) {
  Bench bench;
  bench.pair();
  // The counter behind the records grows with challenges.
  constexpr std::size_t kRecordBytes = 4 * PairingStore::kCounterAt;
  const auto all = [&] {
    auto bytes = bytes_of(bench.flash, 0, twin::FlashFile::kSectorBytes);
    for (const auto& more :
         {bytes_of(bench.flash, 1, twin::FlashFile::kSectorBytes), bytes_of(bench.pairing, 0, kRecordBytes)})
      bytes.insert(bytes.end(), more.begin(), more.end());
    return bytes;
  };
  const auto before = all();
  const auto block = bench.host.read(protocol::Which::active);
  std::mt19937 random(5);
  for (int i = 0; i < 40; ++i)
    for (const Kind kind : kinds_of_requests()) {
      protocol::Message m{static_cast<std::uint8_t>(kind), 1, 0, 0, {}};
      m.length = static_cast<std::uint8_t>(random() % (protocol::kMostPayload + 1));
      // Small numbers are those that fields hold.
      for (std::uint8_t& byte : m.payload) byte = static_cast<std::uint8_t>(random() % (i % 2 == 0 ? 256 : 4));
      // A layout of its own length is served more often than by chance.
      if (kind == Kind::block_begin || kind == Kind::identify) m.length = kind == Kind::identify ? 2 : 8;
      bench.host.ask(m);
      if (kind == Kind::identify) EXPECT_EQ(bench.host.identify(), Code::done);
      if (kind == Kind::command && is_armed(bench.drive.status().mode))
        bench.host.command({.kind = protocol::CommandKind::disarm});
    }
  EXPECT_EQ(all(), before);
  bench.host.identify();
  EXPECT_EQ(bench.host.read(protocol::Which::active), block);
  EXPECT_EQ(bench.state(), PairingState::locked);
}

TEST(Pairing, LetsTheKeysOwnerWriteUntilTheHostIsAnotherOne) {
  Bench bench;
  bench.pair();
  EXPECT_EQ(bench.host.flash(bench.block()), Code::locked);
  ASSERT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  EXPECT_EQ(bench.state(), PairingState::open);
  EXPECT_EQ(bench.host.flash(bench.block()), Code::done);
  bench.identify();
  EXPECT_EQ(bench.id.pairing, PairingState::locked);
  EXPECT_EQ(bench.host.flash(bench.block()), Code::locked) << "a host that identifies itself anew";
  ASSERT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  bench.drive.service().disconnected();
  bench.identify();
  EXPECT_EQ(bench.host.code(Kind::block_erase_all), Code::locked) << "the link was lost";
}

TEST(Pairing, IsKeptByNewBlocksAFactoryResetAndThePowerThatGoes) {
  Bench bench;
  bench.pair();
  ASSERT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  EXPECT_EQ(bench.host.flash(bench.block()), Code::done);
  EXPECT_EQ(bench.host.code(Kind::block_erase_all), Code::done);
  twin::TwinDrive next({.drive = demo(), .flash = &bench.flash, .pairing = &bench.pairing});
  ServiceHost host(next);
  next.run(200);
  protocol::Identity id;
  EXPECT_EQ(protocol::take_payload(host.ask(Kind::identify, protocol::Hello{}).content(), id), Code::done);
  EXPECT_EQ(id.pairing, PairingState::locked);
  EXPECT_EQ(host.flash(bench.block()), Code::locked);
}

TEST(Pairing, TelemetryArmingSetPointsAndThePositionStayFree) {
  Bench bench;
  bench.pair();
  EXPECT_EQ(bench.host.code(Kind::home, protocol::Home{}), Code::done);
  EXPECT_EQ(bench.host.code(Kind::telemetry, protocol::Subscription{}), Code::done);
  EXPECT_EQ(bench.host.arm(Mode::velocity).refusal, protocol::Refusal::none);
  EXPECT_EQ(bench.host.command({.kind = protocol::CommandKind::set, .mode = Mode::velocity}).refusal,
            protocol::Refusal::none);
  // While it is armed a signature is not verified, whoever sends it.
  EXPECT_EQ(bench.host.code(Kind::pairing_challenge), Code::armed);
  EXPECT_EQ(bench.host.code(Kind::pairing_answer, protocol::PairingAnswer{}), Code::armed);
  EXPECT_EQ(bench.drive.status().mode, Mode::velocity);
}

}  // namespace
}  // namespace flexspline::tests::firmware_pairing_test
