// Parameter blocks: what goes in comes out, and nothing that is not as it should be is taken.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/deployment/sha256.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/block_texts.hpp"

namespace flexspline::tests::deployment_block_test {
namespace {

using deployment::PackError;
using deployment::PackOptions;
using fixed::Fixed;
using model::BlockFault;
using model::BlockVerdict;

constexpr std::size_t kFirstEntry = 12 + 2 * 32 + 2 * 4 + 17 * 8 + 7 * 4;
constexpr std::size_t kFirstBase = 12 + 2 * 32 + 2 * 4;
constexpr std::size_t kFirstLimit = kFirstBase + 17 * 8;

// A drive of the report's class with these effects at their usual sizes; "torque_ripple:3" has order three.
model::Model drive_with(const std::vector<std::string>& effects) {
  model::Model m;
  m.name = "test-drive";
  m.drive.gear_ratio.value = 100.0;
  m.drive.torque_constant_nm_a.value = 0.0543;
  m.drive.rated_current_a.value = 2.0;
  m.drive.rated_velocity_rad_s.value = 200.0;
  m.drive.rated_torque_nm.value = 40.0;
  m.drive.temperature_reference_c.value = 30.0;
  for (const std::string& name : effects) {
    const catalogue::Entry& entry = catalogue::get(name.substr(0, name.find(':')));
    model::Effect effect = catalogue::blank_effect(entry, m.drive.axis);
    effect.id = name;
    for (std::size_t p = 0; p < entry.parameters.size(); ++p) effect.parameters[p].value = entry.parameters[p].usual;
    if (name.find(':') != std::string::npos) effect.parameters[0].value = std::stod(name.substr(name.find(':') + 1));
    m.effects.push_back(effect);
  }
  return m;
}
const std::vector<std::string> kSome = {"inertia",       "viscous_friction", "coulomb_friction",   "stribeck_gaussian",
                                        "torque_ripple", "linear_stiffness", "structural_damping", "kinematic_error",
                                        "lugre_friction"};
PackOptions quick() {
  PackOptions options;
  options.samples = 300;
  return options;
}

struct Read {
  BlockVerdict verdict;
  model::BlockHeader header;
  std::unique_ptr<model::DriveModel<Fixed>> drive = std::make_unique<model::DriveModel<Fixed>>();
};
Read read(const std::vector<std::uint8_t>& bytes) {
  Read r;
  r.verdict = control::load(bytes, *r.drive);
  if (r.verdict.good()) r.header = model::header_of(bytes);
  return r;
}
// With a checksum that fits again.
std::vector<std::uint8_t> sealed(std::vector<std::uint8_t> bytes) {
  const std::uint32_t crc = model::crc32(std::span<const std::uint8_t>(bytes).first(bytes.size() - 4));
  for (std::size_t i = 0; i < 4; ++i) bytes[bytes.size() - 4 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
  return bytes;
}
template <class T>
std::vector<std::uint8_t> with(std::vector<std::uint8_t> bytes, std::size_t at, T number) {
  auto bits = static_cast<std::uint64_t>(number);
  for (std::size_t i = 0; i < sizeof(T); ++i, bits >>= 8) bytes.at(at + i) = static_cast<std::uint8_t>(bits);
  return sealed(std::move(bytes));
}

class Block : public testing::Test {
 protected:
  static const std::vector<std::uint8_t>& good() {
    static const auto bytes = deployment::pack(drive_with(kSome), quick()).bytes;
    return bytes;
  }
  static void refused(const std::vector<std::uint8_t>& bytes, BlockFault fault, const std::string& what) {
    const Read r = read(bytes);
    EXPECT_EQ(r.verdict.fault, fault) << what << ": " << model::text_of(r.verdict.fault);
  }
};

TEST_F(Block, ChecksumAndHashAreThePublishedOnes) {
  const std::string digits = "123456789";
  const std::vector<std::uint8_t> bytes(digits.begin(), digits.end());
  EXPECT_EQ(model::crc32(bytes), 0xCBF43926U);
  const std::string abc = "abc";
  EXPECT_EQ(deployment::sha256(std::vector<std::uint8_t>(abc.begin(), abc.end())),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(deployment::sha256({}), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const std::string two = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
  EXPECT_EQ(deployment::sha256(std::vector<std::uint8_t>(two.begin(), two.end())),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST_F(Block, IsReadBackToTheModelThatItWasMadeFrom) {
  const model::Model m = drive_with(kSome);
  const auto back = deployment::unpack(good());
  ASSERT_TRUE(back.model);
  EXPECT_TRUE(back.coefficients_follow);
  EXPECT_EQ(back.model->name, m.name);
  EXPECT_EQ(back.model->drive.gear_ratio.value, m.drive.gear_ratio.value);
  EXPECT_EQ(back.model->drive.rated_current_a.value, m.drive.rated_current_a.value);
  EXPECT_FALSE(back.model->drive.pitch_m.value);
  ASSERT_EQ(back.model->effects.size(), m.effects.size());
  for (const model::Effect& effect : m.effects) {
    const model::Effect* again = back.model->find(effect.id);
    ASSERT_NE(again, nullptr) << effect.id;
    for (std::size_t p = 0; p < effect.parameters.size(); ++p)
      EXPECT_EQ(again->parameters[p].value, effect.parameters[p].value) << effect.id;
  }
  EXPECT_EQ(deployment::pack(*back.model, quick()).bytes, good());
}

// The drive computes with what the host derived: the same torques, tick by tick, as with coefficients that never were
// in a block.
TEST_F(Block, OfEveryEffectGivesTheBitsOfItsCoefficients) {
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (entry.info->host_only) continue;
    const auto drive = deployment::from_block(read(good()).header.bases);
    std::vector<double> usual;
    for (const auto& p : entry.parameters) usual.push_back(p.usual != 0.0 ? p.usual : 0.01);
    std::vector<std::uint8_t> bytes(model::kLargestBlock);
    model::BlockWriter writer(bytes);
    writer.begin(read(good()).header);
    const auto derived = std::make_unique<model::DriveModel<Fixed>>();
    effects::for_each_effect([&]<class Effect>(std::size_t number) {
      if constexpr (!Effect::kInfo.host_only) {
        if (number != entry.id) return;
        const auto c = Effect::template derive<Fixed>(usual.data(), drive);
        writer.add(static_cast<std::uint16_t>(number), c);
        derived->add<Effect>(c);
      }
    });
    bytes.resize(writer.end());
    const Read r = read(bytes);
    ASSERT_TRUE(r.verdict.good()) << entry.name() << ": " << model::text_of(r.verdict.fault) << r.verdict.field;
    for (int k = 0; k < 50; ++k) {
      effects::Inputs<Fixed> in;
      in.angle.raw = in.output_angle.raw = std::int64_t{1} << 25 << (k % 7);
      for (Fixed::Value* x : {&in.velocity, &in.direction, &in.acceleration, &in.output_velocity, &in.output_direction,
                              &in.output_acceleration, &in.torsion, &in.torsion_rate, &in.torsion_direction, &in.torque,
                              &in.current, &in.temperature})
        x->raw = (k % 5 - 2) * (1 << 26) + 12345 * k;
      const auto a = r.drive->tick(in), b = derived->tick(in);
      ASSERT_EQ(a.motor.raw, b.motor.raw) << entry.name();
      ASSERT_EQ(a.transmission.raw, b.transmission.raw) << entry.name();
      ASSERT_EQ(a.load.raw, b.load.raw) << entry.name();
    }
  }
}

TEST_F(Block, IsRefusedWhereOneBitIsOther) {
  auto bytes = good();
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      bytes[at] ^= static_cast<std::uint8_t>(1 << bit);
      ASSERT_FALSE(read(bytes).verdict.good()) << "byte " << at << ", bit " << bit;
      bytes[at] ^= static_cast<std::uint8_t>(1 << bit);
    }
  EXPECT_TRUE(read(bytes).verdict.good());
}

TEST_F(Block, IsRefusedWhereItIsCutOffOrLonger) {
  for (std::size_t size = 0; size < good().size(); size += 3)
    ASSERT_FALSE(read({good().begin(), good().begin() + static_cast<std::ptrdiff_t>(size)}).verdict.good()) << size;
  auto longer = good();
  longer.push_back(0);
  refused(longer, BlockFault::wrong_length, "a byte more");
  refused(std::vector<std::uint8_t>(model::kLargestBlock + 1), BlockFault::too_long, "too long");
  refused({}, BlockFault::too_short, "nothing");
}

// With a checksum that fits, so that each field is judged by itself.
TEST_F(Block, EachFieldOfTheHeaderIsJudged) {
  refused(with(good(), 0, std::uint32_t{0}), BlockFault::wrong_magic, "magic");
  refused(with(good(), 4, std::uint16_t{2}), BlockFault::unknown_version, "version");
  refused(with(good(), 8, std::uint32_t{77}), BlockFault::wrong_length, "length");
  refused(with(good(), 6, std::uint16_t{65}), BlockFault::too_many_entries, "entries");
  refused(with(good(), 6, std::uint16_t{1}), BlockFault::wrong_length, "fewer entries than there are");
  refused(with(good(), 6, std::uint16_t{60}), BlockFault::entry_cut_off, "more entries than there are");
  refused(with(good(), 12, std::uint8_t{7}), BlockFault::wrong_name, "a bell in a name");
  refused(with(good(), 12 + 20, std::uint8_t{'x'}), BlockFault::wrong_name, "a letter behind the end");
  refused(with(good(), 12 + 64, std::uint32_t{2}), BlockFault::wrong_header, "axis");
  refused(with(good(), 12 + 68, std::uint32_t{1} << 31), BlockFault::wrong_header, "encoder");
  for (std::size_t base = 0; base < 17; ++base) {
    const std::size_t at = kFirstBase + 8 * base;
    refused(with(good(), at, std::int32_t{1}), BlockFault::wrong_base, "not normal");
    refused(with(good(), at + 4, std::int32_t{101}), BlockFault::wrong_base, "exponent");
    refused(with(good(), at + 4, std::int32_t{-101}), BlockFault::wrong_base, "exponent");
    const Read negative = read(with(good(), at, -(std::int32_t{1} << 29)));
    // A reference temperature alone may be below zero.
    EXPECT_EQ(negative.verdict.fault, base == 3 ? BlockFault::none : BlockFault::wrong_base) << base;
    if (base != 3) {
      EXPECT_EQ(negative.verdict.field, static_cast<int>(4 + base));
    }
  }
  for (std::size_t limit = 0; limit < 7; ++limit) {
    const std::size_t at = kFirstLimit + 4 * limit;
    for (const std::int32_t wrong : {std::int32_t{0}, std::int32_t{-1}, (std::int32_t{2} << 27) + 1, INT32_MIN})
      refused(with(good(), at, wrong), BlockFault::wrong_limit, "limit");
    EXPECT_EQ(read(with(good(), at, std::int32_t{0})).verdict.field, static_cast<int>(21 + limit));
  }
  refused(with(good(), kFirstLimit + 8, std::int32_t{2} << 27), BlockFault::wrong_limit, "velocity above overspeed");
}

TEST_F(Block, EachEntryAndCoefficientIsJudged) {
  const std::size_t at = kFirstEntry;  // inertia: one weight
  refused(with(good(), at, std::uint16_t{63}), BlockFault::missing_effect, "a number without an effect");
  refused(with(good(), at, std::uint16_t{38}), BlockFault::missing_effect, "an effect that no drive can run");
  refused(with(good(), at, std::uint16_t{2}), BlockFault::too_often, "viscous friction twice");
  refused(with(good(), at, std::uint16_t{0x1FE}), BlockFault::unknown_entry, "a section that is none");
  refused(with(good(), at, std::uint16_t{0x11E}), BlockFault::unknown_entry,
          "a motor whose current loop has the units of earlier builds");
  refused(with(good(), at + 2, std::uint16_t{1}), BlockFault::unknown_entry, "what has to be zero");
  refused(with(good(), at + 4, std::uint32_t{1} << 20), BlockFault::entry_cut_off, "length");
  refused(with(good(), at, std::uint16_t{10}), BlockFault::entry_of_wrong_length, "too short for that effect");
  refused(with(good(), at + 8, INT32_MIN), BlockFault::wrong_coefficient, "a weight without a magnitude");
  EXPECT_EQ(read(with(good(), at, std::uint16_t{63})).verdict.entry, 0);
  EXPECT_EQ(read(with(good(), at, std::uint16_t{63})).verdict.kind, 63);
  // Stribeck: two weights and a ratio; it is the fourth entry, behind three of 12 bytes.
  const std::size_t ratio = at + 3 * 12 + 8 + 8;
  refused(with(good(), ratio, std::int32_t{1} << 28), BlockFault::wrong_coefficient, "not normal");
  refused(with(good(), ratio, (std::int32_t{1} << 30) + 1), BlockFault::wrong_coefficient, "not normal");
  refused(with(good(), ratio + 4, std::int32_t{61}), BlockFault::wrong_coefficient, "exponent");
  refused(with(good(), ratio + 4, std::int32_t{-41}), BlockFault::wrong_coefficient, "exponent");
  refused(with(good(), ratio, std::int32_t{0}), BlockFault::wrong_coefficient, "zero has no exponent");
  const BlockVerdict v = read(with(good(), ratio, std::int32_t{1})).verdict;
  EXPECT_EQ(v.entry, 3);
  EXPECT_EQ(v.field, 2);
  EXPECT_EQ(v.kind, 6);
}

// Whatever the bytes, as long as the checksum fits: a verdict, and no coefficient outside its bounds in use.
TEST_F(Block, OfRandomBytesNeverDoesHarm) {
  std::mt19937 random(3);
  int taken = 0;
  for (int k = 0; k < 3000; ++k) {
    auto bytes = good();
    for (int change = 0; change < 3; ++change)
      bytes[kFirstBase + random() % (bytes.size() - kFirstBase - 4)] = static_cast<std::uint8_t>(random());
    const Read r = read(sealed(bytes));
    if (!r.verdict.good()) continue;
    ++taken;
    effects::Inputs<Fixed> in;
    in.velocity.raw = in.torsion.raw = in.torque.raw = 1 << 27;
    r.drive->tick(in);
    r.drive->tick(in);
  }
  EXPECT_GT(taken, 10);
}

struct InertiaAlone {
  static constexpr std::string_view kNames = "inertia";
};

TEST_F(Block, IsForTheEffectsOfItsImage) {
  PackOptions options = quick();
  options.image = {"inertia", "viscous_friction"};
  EXPECT_THROW(deployment::pack(drive_with({"coulomb_friction"}), options), PackError);
  const auto bytes = deployment::pack(drive_with({"inertia", "viscous_friction"}), options).bytes;
  using Small = model::DriveModel<Fixed, model::TheseEffects<1>>;
  Small small;
  EXPECT_EQ(control::load(bytes, small).fault, BlockFault::missing_effect);
  model::DriveModel<Fixed, model::NamedEffects<InertiaAlone>> chosen;
  EXPECT_EQ(control::load(bytes, chosen).fault, BlockFault::missing_effect);
}

TEST(Pack, SaysWhyAModelDoesNotFit) {
  const auto reason = [](const model::Model& m) -> std::string {
    try {
      deployment::pack(m, quick());
    } catch (const PackError& error) {
      return error.what();
    }
    return "it fits";
  };
  EXPECT_EQ(reason(drive_with({"inertia"})), "it fits");
  model::Model m = drive_with({"viscous_friction"});
  m.effects[0].parameters[0].value.reset();
  EXPECT_NE(reason(m).find("no value for viscous_friction.coefficient"), std::string::npos);
  m = drive_with({"viscous_friction"});
  m.drive.rated_velocity_rad_s.value.reset();
  EXPECT_NE(reason(m).find("rated_velocity_rad_s"), std::string::npos);
  m = drive_with({"viscous_friction"});
  m.effects[0].parameters[0].value = 10.0;
  EXPECT_NE(reason(m).find("viscous_friction does not fit: "), std::string::npos) << reason(m);
  EXPECT_NE(reason(drive_with({"preisach_hysteresis"})).find("too large for a drive"), std::string::npos);
  EXPECT_NE(reason(drive_with(
                       {"torque_ripple:1", "torque_ripple:2", "torque_ripple:3", "torque_ripple:4", "torque_ripple:5"}))
                .find("no place"),
            std::string::npos);
  PackOptions options = quick();
  options.bound = 1e-15;
  EXPECT_THROW(deployment::pack(drive_with(kSome), options), deployment::BoundError);
}

// Torques far above the ratings take wider bases, and more of them where the torque itself grows.
TEST(Pack, WidensTheBasesOfTorqueWhereAModelNeedsIt) {
  model::Model m = drive_with({"coulomb_friction"});
  EXPECT_EQ(deployment::pack(m, quick()).torque_scale, 1.0);
  m.effects[0].parameters[0].value = 25.0 * 0.4;
  EXPECT_EQ(deployment::pack(m, quick()).torque_scale, 2.0);
}

TEST(Pack, ProvesItsParts) {
  PackOptions options = quick();
  options.encoder_counts = 4096;
  const auto packed = deployment::pack(drive_with({"coulomb_friction", "dahl_hysteresis"}), options);
  std::set<std::string> kinds;
  for (const auto& part : packed.proof) {
    kinds.insert(part.kind);
    EXPECT_TRUE(part.bound >= 0.0 && part.bound < 1e4) << part.part;
    if (part.kind == "error") continue;
    if (part.part == "coulomb_friction") {
      EXPECT_NEAR(part.bound, 0.045, 1e-6);
    }
    // The bound of its own law, two newton metres.
    if (part.part == "dahl_hysteresis") {
      EXPECT_NEAR(part.bound, 2.0, 1e-4);
    }
  }
  EXPECT_EQ(kinds,
            (std::set<std::string>{"interval", "invariant", "range", "measured_error", "impulse_response", "error"}));
  EXPECT_LT(packed.max_error_share_of_rated, 1e-6);
  EXPECT_GT(packed.max_error_share_of_rated, 0.0);
}

TEST_F(Block, LongIdsThatBeginAlikeStayDifferent) {
  model::Model m = drive_with({"inertia", "viscous_friction", "coulomb_friction"});
  const std::string beginning(63, 'a');
  m.effects[0].id = beginning + "\u00e9 one";
  m.effects[1].id = beginning + "\u00e9 two";
  const auto unpacked = deployment::unpack(deployment::pack(m, quick()).bytes);
  ASSERT_TRUE(unpacked.model);
  ASSERT_EQ(unpacked.model->effects.size(), 3u);
  // No character of two bytes is cut in two.
  EXPECT_EQ(unpacked.model->effects[0].id, beginning);
  EXPECT_EQ(unpacked.model->effects[1].id, beginning.substr(0, 62) + "~2");
}

TEST_F(Block, TorquesThatNoBasesHoldAreRefusedWithTheLargestThatTheyHold) {
  model::Model m = drive_with({"inertia", "coulomb_friction"});
  m.effects[1].parameters[0].value = 200.0 * 0.4;
  try {
    deployment::pack(m, quick());
    FAIL() << "packed";
  } catch (const PackError& error) {
    EXPECT_NE(std::string(error.what()).find("up to 128 times the rated one"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flexspline::tests::deployment_block_test
