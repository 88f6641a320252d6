// The lock of the parameters by a pairing key, without a drive: challenges, answers, time.
#include "firmware/parameter_lock.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/pairing_host.hpp"

namespace flexspline::tests::parameter_lock_test {
namespace {

using protocol::Code;
using protocol::PairingAction;
using protocol::PairingState;

// A drive that is paired and locked.
struct Paired {
  PairingCells cells;
  LockBench bench{cells};
  Paired() {
    EXPECT_EQ(bench.answer(owner(), PairingAction::pair), Code::done);
    bench.lock.close();
  }
};

TEST(ParameterLock, IsOffUntilTheDriveIsPaired) {
  PairingCells cells;
  LockBench bench(cells);
  EXPECT_EQ(bench.lock.state(), PairingState::not_paired);
  EXPECT_TRUE(bench.writes());
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::not_paired);
  EXPECT_EQ(bench.lock.remove(), Code::not_paired);
}

TEST(ParameterLock, IsPairedByTheKeyThatSignedAndOpensForItAlone) {
  PairingCells cells;
  LockBench bench(cells);
  // The key of one, the signature of another: the host cannot sign with the key that it names.
  PairingAnswerOf mixed = answer_of(SigningKey(2), PairingAction::pair, bench.drive, bench.challenge());
  mixed.key = owner().public_key;
  EXPECT_EQ(bench.give(mixed, PairingAction::pair), Code::wrong_signature);
  EXPECT_EQ(bench.lock.state(), PairingState::not_paired);
  bench.pass(2);
  EXPECT_EQ(bench.answer(owner(), PairingAction::pair), Code::done);
  EXPECT_EQ(bench.lock.state(), PairingState::open);
  bench.lock.close();
  EXPECT_FALSE(bench.writes());
  EXPECT_EQ(bench.answer(SigningKey(2), PairingAction::open), Code::other_key);
  EXPECT_EQ(bench.answer(SigningKey(2), PairingAction::pair), Code::locked);
  EXPECT_FALSE(bench.writes());
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  EXPECT_TRUE(bench.writes());
  EXPECT_EQ(bench.lock.info().key, owner().public_key);
}

TEST(ParameterLock, TakesAnAnswerOnceForItsOwnChallengeDriveAndAction) {
  Paired drive;
  LockBench& bench = drive.bench;
  const PairingAnswerOf first = answer_of(owner(), PairingAction::open, bench.drive, bench.challenge());
  EXPECT_EQ(bench.give(first, PairingAction::open), Code::done);
  // A host that lost the answer repeats its request.
  EXPECT_EQ(bench.give(first, PairingAction::open), Code::done);
  bench.lock.close();
  EXPECT_EQ(bench.give(first, PairingAction::open), Code::wrong_signature) << "without a challenge";
  bench.challenge();
  EXPECT_EQ(bench.give(first, PairingAction::open), Code::wrong_signature) << "for another challenge";
  bench.pass(2);
  const protocol::DriveName other{bench.drive.board, {'s', '2'}};
  EXPECT_EQ(bench.give(answer_of(owner(), PairingAction::open, other, bench.challenge()), PairingAction::open),
            Code::wrong_signature)
      << "for another drive";
  bench.pass(4);
  EXPECT_EQ(bench.give(answer_of(owner(), PairingAction::pair, bench.drive, bench.challenge()), PairingAction::open),
            Code::wrong_signature)
      << "for another action";
  EXPECT_FALSE(bench.writes());
}

TEST(ParameterLock, TakesNoAnswerWithOneWrongBit) {
  Paired drive;
  LockBench& bench = drive.bench;
  // Each byte of the signature once, another bit of it each time.
  for (std::size_t i = 0; i < ed25519::kSignatureBytes; ++i) {
    PairingAnswerOf answer = answer_of(owner(), PairingAction::open, bench.drive, bench.challenge());
    answer.signature[i] ^= static_cast<std::uint8_t>(1U << (i % 8));
    EXPECT_EQ(bench.give(answer, PairingAction::open), Code::wrong_signature) << i;
    EXPECT_FALSE(bench.writes()) << i;
    bench.pass(65);
  }
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
}

TEST(ParameterLock, WaitsTwiceAsLongAfterEachFurtherWrongSignature) {
  Paired drive;
  LockBench& bench = drive.bench;
  for (const double seconds : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 64.0}) {
    PairingAnswerOf wrong = answer_of(owner(), PairingAction::open, bench.drive, bench.challenge());
    wrong.signature[40] ^= 1;
    EXPECT_EQ(bench.give(wrong, PairingAction::open), Code::wrong_signature);
    bench.pass(seconds - 0.01);
    protocol::PairingChallenge none;
    EXPECT_EQ(bench.lock.challenge(bench.tick, none), Code::wait) << seconds;
    EXPECT_EQ(bench.give(wrong, PairingAction::open), Code::wait) << seconds;
    EXPECT_EQ(bench.lock.info().wait_ms, 10U);
    bench.pass(0.02);
  }
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  EXPECT_EQ(bench.lock.info().wait_ms, 0U);
}

TEST(ParameterLock, ClosesAMinuteAfterTheLastRequestThatWroteAndWhenTheLinkIsLost) {
  Paired drive;
  LockBench& bench = drive.bench;
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  for (int i = 0; i < 5; ++i) {
    bench.pass(59);
    EXPECT_TRUE(bench.writes()) << i;
  }
  bench.pass(61);
  EXPECT_FALSE(bench.writes());
  EXPECT_EQ(bench.lock.state(), PairingState::locked);
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  bench.lock.close();
  EXPECT_FALSE(bench.writes());
}

TEST(ParameterLock, IsExchangedAndEndedByWhoOpenedItAndNothingElseIsAskedForThat) {
  Paired drive;
  LockBench& bench = drive.bench;
  const SigningKey next(3);
  EXPECT_EQ(bench.answer(next, PairingAction::pair), Code::locked);
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::done);
  EXPECT_EQ(bench.answer(next, PairingAction::pair), Code::done);
  bench.lock.close();
  EXPECT_EQ(bench.answer(owner(), PairingAction::open), Code::other_key);
  EXPECT_EQ(bench.answer(next, PairingAction::open), Code::done);
  EXPECT_EQ(bench.lock.remove(), Code::done);
  EXPECT_EQ(bench.lock.state(), PairingState::not_paired);
  LockBench after(drive.cells);
  EXPECT_EQ(after.lock.state(), PairingState::not_paired);
}

TEST(ParameterLock, NeverAsksTheSameTwiceInAStartOrOverManyStarts) {
  PairingCells cells;
  std::set<protocol::Nonce> seen;
  for (int start = 0; start < 300; ++start) {
    LockBench bench(cells);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(seen.insert(bench.challenge()).second) << start;
  }
}

TEST(ParameterLock, GivesNoChallengeWhereItsNumberCannotBeRecorded) {
  PairingCells cells;
  LockBench bench(cells);
  bench.flash.fail_from_now();
  protocol::PairingChallenge none;
  EXPECT_EQ(bench.lock.challenge(bench.tick, none), Code::pairing_full);
  EXPECT_EQ(none.nonce, protocol::Nonce{});
}

}  // namespace
}  // namespace flexspline::tests::parameter_lock_test
