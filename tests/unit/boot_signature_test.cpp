// Ed25519 on the drive: the vectors of RFC 8032, signatures that a careless verification accepts, and libsodium's
// judgement of a thousand.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "host/drive_link/firmware/signing.hpp"
#include "shared/boot/development_key.hpp"
#include "shared/boot/signature/ed25519.hpp"
#include "tests/support/signature_cases.hpp"

namespace flexspline::tests::boot_signature_test {
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

// RFC 8032, 7.1, TEST 1024: a message of 1,023 bytes, eight blocks of the hash.
constexpr const char* kLongMessage =
    "08b8b2b733424243760fe426a4b54908632110a66c2f6591eabd3345e3e4eb98fa6e264bf09efe12ee50f8f54e9f77b1e355f6c5"
    "0544e23fb1433ddf73be84d879de7c0046dc4996d9e773f4bc9efe5738829adb26c81b37c93a1b270b20329d658675fc6ea534e0"
    "810a4432826bf58c941efb65d57a338bbd2e26640f89ffbc1a858efcb8550ee3a5e1998bd177e93a7363c344fe6b199ee5d02e82"
    "d522c4feba15452f80288a821a579116ec6dad2b3b310da903401aa62100ab5d1a36553e06203b33890cc9b832f79ef80560ccb9"
    "a39ce767967ed628c6ad573cb116dbefefd75499da96bd68a8a97b928a8bbc103b6621fcde2beca1231d206be6cd9ec7aff6f6c9"
    "4fcd7204ed3455c68c83f4a41da4af2b74ef5c53f1d8ac70bdcb7ed185ce81bd84359d44254d95629e9855a94a7c1958d1f8ada5"
    "d0532ed8a5aa3fb2d17ba70eb6248e594e1a2297acbbb39d502f1a8c6eb6f1ce22b3de1a1f40cc24554119a831a9aad6079cad88"
    "425de6bde1a9187ebb6092cf67bf2b13fd65f27088d78b7e883c8759d2c4f5c65adb7553878ad575f9fad878e80a0c9ba63bcbcc"
    "2732e69485bbc9c90bfbd62481d9089beccf80cfe2df16a2cf65bd92dd597b0707e0917af48bbb75fed413d238f5555a7a569d80"
    "c3414a8d0859dc65a46128bab27af87a71314f318c782b23ebfe808b82b0ce26401d2e22f04d83d1255dc51addd3b75a2b1ae078"
    "4504df543af8969be3ea7082ff7fc9888c144da2af58429ec96031dbcad3dad9af0dcbaaaf268cb8fcffead94f3c7ca495e056a9"
    "b47acdb751fb73e666c6c655ade8297297d07ad1ba5e43f1bca32301651339e22904cc8c42f58c30c04aafdb038dda0847dd988d"
    "cda6f3bfd15c4b4c4525004aa06eeff8ca61783aacec57fb3d1f92b0fe2fd1a85f6724517b65e614ad6808d6f6ee34dff7310fdc"
    "82aebfd904b01e1dc54b2927094b2db68d6f903b68401adebf5a7e08d78ff4ef5d63653a65040cf9bfd4aca7984a74d371459867"
    "80fc0b16ac451649de6188a7dbdf191f64b5fc5e2ab47b57f7f7276cd419c17a3ca8e1b939ae49e488acba6b965610b5480109c8"
    "b17b80e1b7b750dfc7598d5d5011fd2dcc5600a32ef5b52a1ecc820e308aa342721aac0943bf6686b64b2579376504ccc493d97e"
    "6aed3fb0f9cd71a43dd497f01f17c0e2cb3797aa2a2f256656168e6c496afc5fb93246f6b1116398a346f1a641f3b041e989f791"
    "4f90cc2c7fff357876e506b50d334ba77c225bc307ba537152f3f1610e4eafe595f6d9d90d11faa933a15ef1369546868a7f3a45"
    "a96768d40fd9d03412c091c6315cf4fde7cb68606937380db2eaaa707b4c4185c32eddcdd306705e4dc1ffc872eeee475a64dfac"
    "86aba41c0618983f8741c5ef68d3a101e8a3b8cac60c905c15fc910840b94c00a0b9d0";

TEST(BootSignature, TheVectorOfTheRfcWithALongMessageIsAcceptedAndNoByteOfItIsLeftOut) {
  const SignatureCase good{
      array_from_hex<32>("278117fc144c72340f67d0f2316e8386ceffbf2b2428c9c51fef7c597f1d426e"),
      array_from_hex<64>(
          "0aab4c900501b3e24d7cdf4663326a3a87df5e4843b2cbdb67cbf6e460fec350aa5371b1508f9f4528ecea23c436d9"
          "4b5e8fcd4f681e30a6ac00a9704a188a03"),
      from_hex(kLongMessage)};
  ASSERT_EQ(good.message.size(), 1023U);
  EXPECT_TRUE(good.drive_accepts());
  EXPECT_EQ(
      firmware_files::KeyPair(array_from_hex<32>("f5e5767cf153319517630f226876b86c8160cc583bc013744c6bf255f5cc0ee5"))
          .public_key(),
      good.key);
  for (std::size_t at = 0; at < good.message.size(); at += 73) {
    SignatureCase bad = good;
    bad.message[at] ^= 1;
    EXPECT_FALSE(bad.drive_accepts()) << at;
  }
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
}  // namespace flexspline::tests::boot_signature_test
