// The lock of the parameters on the real image: memory of the key, random numbers, time and stack of a verification.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/board/drive_bench.hpp"
#include "tests/support/signing_key.hpp"

namespace flexspline::tests {
namespace {

using protocol::Code;
using protocol::Kind;
using protocol::PairingAction;
using protocol::PairingState;

class Host {
 public:
  explicit Host(DriveBench& bench) : bench_(bench) {
    const protocol::Message m = bench.bus.ask(Kind::identify, protocol::Hello{});
    EXPECT_EQ(protocol::take_payload(m.content(), id), Code::done);
  }
  protocol::Nonce challenge() {
    protocol::PairingChallenge c;
    EXPECT_EQ(protocol::take_payload(bench_.bus.ask(Kind::pairing_challenge).content(), c), Code::done);
    return c.nonce;
  }
  Code answer(const SigningKey& key, PairingAction action, const protocol::Nonce& nonce) {
    const auto message = protocol::pairing_message(action, {id.board, id.serial}, nonce, key.public_key);
    const ed25519::Signature signature = key.sign(message.bytes);
    protocol::PairingPart part{0, key.public_key};
    EXPECT_EQ(bench_.bus.code(Kind::pairing_part, part), Code::done);
    for (std::uint8_t half = 0; half < 2; ++half) {
      part.part = static_cast<std::uint8_t>(half + 1);
      std::copy_n(signature.begin() + 32 * half, 32, part.bytes.begin());
      EXPECT_EQ(bench_.bus.code(Kind::pairing_part, part), Code::done);
    }
    return bench_.bus.code(Kind::pairing_answer, protocol::PairingAnswer{action});
  }
  PairingState state() {
    protocol::Pairing known;
    EXPECT_EQ(protocol::take_payload(bench_.bus.ask(Kind::pairing).content(), known), Code::done);
    return known.state;
  }
  protocol::Identity id;

 private:
  DriveBench& bench_;
};

void expect_no_violation(const DriveBench& bench) {
  for (const std::string& what : bench.chip.machine.violations()) ADD_FAILURE() << what;
}

TEST(BoardPairing, IsKeptOverAPowerCycleAndRefusesAFactoryResetUntilTheChallengeIsAnswered) {
  const SigningKey key(1);
  DriveBench bench("dac");
  bench.come_up();
  bench.chip.ticks(200);
  Host host(bench);
  EXPECT_EQ(host.state(), PairingState::not_paired);
  const protocol::Nonce first = host.challenge();
  ASSERT_EQ(host.answer(key, PairingAction::pair, first), Code::done);
  EXPECT_EQ(host.state(), PairingState::open);
  // Start-up paints the stack (boards/cortex_m4/start.cpp); an interrupt takes less than a quarter of it.
  const std::uint32_t bottom = bench.chip.machine.symbol("stack_bottom"), top = bench.chip.machine.symbol("stack_top");
  std::uint32_t free = bottom;
  while (free < top && bench.chip.machine.word(free) == 0xA5A5A5A5) free += 4;
  std::printf("application, a verification: %u bytes of stack of %u\n", top - free, top - bottom);
  EXPECT_GT(free - bottom, (top - bottom) / 4);
  EXPECT_FALSE(bench.chip.watchdog.bit);

  DriveBench again("dac");
  again.chip.flash.bytes = bench.chip.flash.bytes;
  again.come_up();
  again.chip.ticks(200);
  Host next(again);
  EXPECT_EQ(next.id.pairing, PairingState::locked);
  const int erases = again.chip.flash.erases;
  EXPECT_EQ(again.bus.code(Kind::block_erase_all, protocol::Empty{}), Code::locked);
  EXPECT_EQ(again.bus.code(Kind::block_begin, protocol::BlockBegin{100, 1}), Code::locked);
  EXPECT_EQ(again.chip.flash.erases, erases);
  // The model's random numbers are the same at each start; the number of the start is not.
  const protocol::Nonce second = next.challenge();
  EXPECT_NE(second, first);
  EXPECT_EQ(next.answer(key, PairingAction::open, first), Code::wrong_signature) << "of the start before";
  again.chip.ticks(25'000);
  EXPECT_EQ(next.answer(SigningKey(2), PairingAction::open, next.challenge()), Code::other_key);
  EXPECT_EQ(next.answer(key, PairingAction::open, next.challenge()), Code::done);
  EXPECT_EQ(again.bus.code(Kind::block_erase_all, protocol::Empty{}), Code::done);
  EXPECT_EQ(again.chip.flash.erases, erases + 2) << "the key's sector is never erased";
  EXPECT_EQ(next.state(), PairingState::open);
  expect_no_violation(bench);
  expect_no_violation(again);
}

TEST(BoardPairing, AGeneratorOfRandomNumbersThatIsDeadLeavesChallengesThatNeverRepeat) {
  DriveBench bench("dac");
  bench.chip.random.is_dead = true;
  bench.come_up();
  bench.chip.ticks(200);
  Host host(bench);
  const protocol::Nonce first = host.challenge();
  EXPECT_NE(host.challenge(), first);
  expect_no_violation(bench);
}

TEST(BoardPairing, AnImageThatWasBuiltForItEndsThePairingOfALostKey) {
  DriveBench bench("dac");
  bench.come_up();
  bench.chip.ticks(200);
  Host host(bench);
  ASSERT_EQ(host.answer(SigningKey(1), PairingAction::pair, host.challenge()), Code::done);
  DriveBench rescued("dac-forget");
  rescued.chip.flash.bytes = bench.chip.flash.bytes;
  rescued.come_up();
  EXPECT_EQ(Host(rescued).state(), PairingState::not_paired);
  // It is kept by the product's own image, and the block is what it was.
  DriveBench after("dac");
  after.chip.flash.bytes = rescued.chip.flash.bytes;
  after.come_up();
  EXPECT_EQ(Host(after).state(), PairingState::not_paired);
  EXPECT_GT(after.bus.status().active.bytes, 0U);
  expect_no_violation(rescued);
}

TEST(BoardPairing, AnArmedDriveDoesNotVerifyAndStaysArmed) {
  DriveBench bench("dac");
  bench.come_up();
  bench.chip.ticks(200);
  Host host(bench);
  const protocol::Nonce nonce = host.challenge();
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm, .mode = protocol::Mode::velocity}).refusal,
            protocol::Refusal::none);
  EXPECT_EQ(host.answer(SigningKey(1), PairingAction::pair, nonce), Code::armed);
  EXPECT_EQ(bench.bus.code(Kind::pairing_challenge, protocol::Empty{}), Code::armed);
  EXPECT_EQ(bench.bus.status().mode, protocol::Mode::velocity);
  expect_no_violation(bench);
}

}  // namespace
}  // namespace flexspline::tests
