// Ed25519 on the drive: the vectors of RFC 8032, signatures that a careless verification accepts, and libsodium's
// judgement of a thousand.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "host/firmware/signing.hpp"
#include "shared/boot/development_key.hpp"
#include "shared/boot/signature/ed25519.hpp"
#include "tests/support/signature_cases.hpp"

namespace flexspline::testing {
namespace {

struct Vector {
  const char *secret, *key, *message, *signature;
};
// RFC 8032, 7.1: tests 1 to 3 and SHA(abc), whose message is the SHA-512 of "abc".
constexpr Vector kVectors[] = {{"9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60",
                                "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a", "",
                                "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39"
                                "701cf9b46bd25bf5f0595bbe24655"
                                "141438e7a100b"},
                               {"4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
                                "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
                                "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f36"
                                "13d0f11d8c387b2eaeb4302aeeb00"
                                "d291612bb0c00"},
                               {"c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
                                "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
                                "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f7"
                                "60984dc6594a7c15e9716ed28dc02"
                                "7beceea1ec40a"},
                               {"833fe62409237b9d62ec77587520911e9a759cec1d19755b7da901b96dca3d42",
                                "ec172b93ad5e563bf4932c70e1245034c35467ef2efd4d64ebf819683467e2bf",
                                "ddaf35a193617abacc417349ae20413112e6fa4e89a97ea20a9eeee64b55d39a2192992a274fc1a836ba3c"
                                "23a3feebbd454d4423643ce80e2a9"
                                "ac94fa54ca49f",
                                "dc2a4459e7369633a52b1bf277839a00201009a3efbf3ecb69bea2186c26b58909351fc9ac90b3ecfdfbc7"
                                "c66431e0303dca179c138ac17ad9b"
                                "ef1177331a704"}};

SignatureCase case_of(const Vector& v) {
  return {array_from_hex<32>(v.key), array_from_hex<64>(v.signature), from_hex(v.message)};
}

TEST(BootSignature, TheVectorsOfTheRfcAreAccepted) {
  for (const Vector& v : kVectors) {
    EXPECT_TRUE(case_of(v).drive_accepts()) << v.message;
    EXPECT_EQ(firmware_files::KeyPair(array_from_hex<32>(v.secret)).public_key(), array_from_hex<32>(v.key));
  }
  EXPECT_EQ(firmware_files::development_key_pair().public_key(), boot::kDevelopmentKey);
}

TEST(BootSignature, TheHashIsThatOfTheStandardHoweverItsMessageIsDivided) {
  const std::string abc = "abc";
  ed25519::Sha512 hash;
  hash.add(std::vector<std::uint8_t>(abc.begin(), abc.end()));
  const auto digest = hash.finish();
  EXPECT_TRUE(std::ranges::equal(digest, from_hex(kVectors[3].message)));
  std::vector<std::uint8_t> message;
  for (std::size_t n = 0; n <= 260; ++n) {
    ed25519::Sha512 parts;
    parts.add(std::span(message).first(n / 3));
    parts.add(std::span(message).subspan(n / 3));
    std::array<std::uint8_t, 64> expected{};
    crypto_hash_sha512(expected.data(), message.data(), message.size());
    ASSERT_EQ(parts.finish(), expected) << n;
    message.push_back(static_cast<std::uint8_t>(n * n + 1));
  }
}

TEST(BootSignature, EveryBitOfKeyAndSignatureCounts) {
  const SignatureCase good = case_of(kVectors[2]);
  for (std::size_t bit = 0; bit < 8 * (32 + 64); bit += 3) {
    SignatureCase c = good;
    std::uint8_t& byte = bit < 256 ? c.key[bit / 8] : c.signature[(bit - 256) / 8];
    byte ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_FALSE(c.drive_accepts()) << bit;
  }
  for (std::size_t bit = 0; bit < 16; ++bit) {
    SignatureCase c = good;
    c.message[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    EXPECT_FALSE(c.drive_accepts()) << bit;
  }
  SignatureCase c = good;
  c.message.pop_back();
  EXPECT_FALSE(c.drive_accepts());
  c.message = good.message;
  c.message.push_back(0);
  EXPECT_FALSE(c.drive_accepts());
}

// Without the check of its range, S + L is a second signature of the same message.
TEST(BootSignature, ANumberSThatIsNotBelowTheOrderIsRefused) {
  SignatureCases cases(11);
  for (int i = 0; i < 5; ++i) {
    EXPECT_FALSE(cases.with_longer_s().drive_accepts());
    SignatureCase c = cases.good();
    EXPECT_TRUE(c.drive_accepts());
    c.set_s(kGroupOrder);
    EXPECT_FALSE(c.drive_accepts());
    c.set_s({0xFF, 0xFF});
    EXPECT_FALSE(c.drive_accepts());
  }
}

TEST(BootSignature, KeysOfSmallOrderAndEncodingsThatAreNotCanonicalAreRefused) {
  SignatureCases cases(12);
  for (const char* text : kSmallOrder) {
    ed25519::Point point;
    EXPECT_FALSE(ed25519::decode_key(array_from_hex<32>(text), point)) << text;
    // With A of small order and S = 0, R = -k A is one of eight points: some message would have a signature.
    SignatureCase c = cases.good();
    c.key = array_from_hex<32>(text);
    c.set_s({});
    for (const char* r : kSmallOrder) {
      c.set_r(array_from_hex<32>(r));
      EXPECT_FALSE(c.drive_accepts()) << text << " " << r;
    }
  }
  for (std::size_t i = 0; i < kSmallOrder.size(); ++i) {
    ed25519::Point point;
    EXPECT_EQ(ed25519::decode(array_from_hex<32>(kSmallOrder[i]), point), i < 8) << "only the canonical ones";
    if (i < 8) {
      EXPECT_TRUE(point.has_small_order());
    }
  }
  // p + 3 is no canonical y, 3 is one of a point.
  ed25519::Point point;
  EXPECT_TRUE(ed25519::decode(Bytes32{3}, point));
  EXPECT_FALSE(
      ed25519::decode(array_from_hex<32>("f0ffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f"), point));
  EXPECT_FALSE(ed25519::decode(Bytes32{2}, point)) << "no point has this y";
}

// The equation holds, but R is of small order or not canonical.
TEST(BootSignature, APointRThatIsOfSmallOrderOrNotCanonicalIsRefused) {
  SignatureCases cases(13);
  for (const char* r : kSmallOrder) {
    const SignatureCase c = cases.with_r_of_small_order(r);
    EXPECT_FALSE(c.drive_accepts()) << r;
    EXPECT_FALSE(c.libsodium_accepts()) << r;
  }
}

// Seven of eight such signatures are valid by the equation that is multiplied by eight alone.
TEST(BootSignature, TheEquationIsTheOneWithoutCofactorAsInLibsodium) {
  SignatureCases cases(14);
  int accepted = 0;
  for (int i = 0; i < 48; ++i) {
    const SignatureCase c = cases.with_key_of_mixed_order();
    EXPECT_EQ(c.drive_accepts(), c.libsodium_accepts());
    accepted += c.drive_accepts() ? 1 : 0;
  }
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 24);
}

TEST(BootSignature, LibsodiumJudgesAThousandSignaturesAsTheDriveDoes) {
  const Agreement agreement = agreement_with_libsodium(1008, 1);
  EXPECT_EQ(agreement.differ, std::vector<std::string>{});
  EXPECT_EQ(agreement.by_kind.size(), 16U);
  EXPECT_EQ(agreement.by_kind.at("good"), (std::array<std::size_t, 2>{63, 0}));
  EXPECT_EQ(agreement.by_kind.at("S + L"), (std::array<std::size_t, 2>{0, 63}));
}

// Arithmetic of the field where carries are rare: next to zero, p and 2^256.
TEST(BootSignature, ArithmeticHoldsNextToTheEdgesOfItsWords) {
  using ed25519::Field;
  std::vector<Field> numbers;
  for (const std::uint32_t low : {0U, 1U, 18U, 19U, 37U, 38U, 0xFFFFFFDAU, 0xFFFFFFECU, 0xFFFFFFEDU, 0xFFFFFFFFU})
    for (const std::uint32_t high : {0U, 0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFFU})
      for (const std::uint32_t between : {0U, 0xFFFFFFFFU})
        numbers.push_back({{low, between, between, between, between, between, between, high}});
  for (const Field& a : numbers) {
    EXPECT_EQ(a * a.inverse(), a.is_zero() ? Field{} : ed25519::kOne);
    EXPECT_TRUE(ed25519::is_less(a.canonical(), Field::kPrime));
    for (const Field& b : numbers) {
      EXPECT_EQ((a + b) - b, a);
      EXPECT_EQ((a - b) + b, a);
      EXPECT_EQ((a + b) * (a - b), a * a - b * b);
    }
  }
}

}  // namespace
}  // namespace flexspline::testing
