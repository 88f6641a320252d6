// A host that opens a paired drive, over a line that loses answers.
#include "host/drive_link/drive/pairing.hpp"

#include <gtest/gtest.h>

#include <string>

#include "hil/twin/factory_block.hpp"
#include "tests/support/loopback.hpp"
#include "tests/support/pairing_host.hpp"

namespace flexspline::tests::drive_pairing_test {
namespace {

using drive::PairingSigner;
using protocol::PairingState;

PairingSigner signer_of(unsigned char seed, const std::string& name) {
  const SigningKey key(seed);
  return {name, key.public_key, [key](std::span<const std::uint8_t> message) { return key.sign(message); }};
}
template <class Act>
std::string error_of(Act act) {
  try {
    act();
  } catch (const drive::DriveError& error) {
    return error.what();
  }
  return "";
}

TEST(DrivePairing, OpensForAWriteAndLocksAgainThoughEachThirdAnswerIsLost) {
  const plant::Drive demo = plant::demo_plant().drive;
  twin::TwinDrive twin({.drive = demo});
  int answers = 0;
  // A host asks once for an erase, which may take seconds.
  drive::Session session = open_session(
      twin, [&](protocol::Message& m) { return m.request() != protocol::Kind::block_begin && ++answers % 3 == 0; });
  const std::optional<PairingSigner> owner = signer_of(1, "owner.key");
  drive::pair(session, *owner);
  drive::lock(session);
  const auto block = twin::factory_block(demo);
  EXPECT_NE(error_of([&] { session.write_block(block); }).find("locked by a pairing key"), std::string::npos);
  {
    const drive::Unlocked unlocked(session, owner);
    EXPECT_EQ(drive::pairing_of(session).state, PairingState::open);
    session.write_block(block);
  }
  EXPECT_EQ(drive::pairing_of(session).state, PairingState::locked);
}

TEST(DrivePairing, SaysWhichKeyIsWantedAndWhichOneWasGiven) {
  twin::TwinDrive twin({.drive = plant::demo_plant().drive});
  drive::Session session = open_session(twin);
  const std::optional<PairingSigner> owner = signer_of(1, "owner.key"), other = signer_of(2, "other.key");
  EXPECT_EQ(error_of([&] { drive::require_access(session, {}); }), "");
  EXPECT_NE(error_of([&] { drive::require_access(session, owner); }).find("owner.key opens nothing"),
            std::string::npos);
  drive::pair(session, *owner);
  const std::string wrong = error_of([&] { drive::require_access(session, other); });
  EXPECT_NE(wrong.find("paired with the key " + drive::fingerprint(owner->public_key)), std::string::npos) << wrong;
  EXPECT_NE(wrong.find("other.key has the key " + drive::fingerprint(other->public_key)), std::string::npos) << wrong;
  EXPECT_NE(error_of([&] { drive::require_access(session, {}); }).find("--pairing-key"), std::string::npos);
  EXPECT_EQ(error_of([&] { drive::require_access(session, owner); }), "");
}

TEST(DrivePairing, FirmwareThatIsOlderHasNoLock) {
  twin::TwinDrive twin({.drive = plant::demo_plant().drive});
  drive::Session session = open_session(twin, [](protocol::Message& m) {
    if (m.request() == protocol::Kind::identify) m.payload[1] = 4, m.length = 51;
    return false;
  });
  EXPECT_EQ(session.identity().pairing, PairingState::not_stated);
  EXPECT_EQ(drive::pairing_of(session).state, PairingState::not_stated);
  EXPECT_EQ(error_of([&] { drive::require_access(session, {}); }), "");
  EXPECT_NE(error_of([&] { drive::pair(session, signer_of(1, "owner.key")); }).find("older than pairing"),
            std::string::npos);
}

}  // namespace
}  // namespace flexspline::tests::drive_pairing_test
