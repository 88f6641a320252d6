// What a drive takes of a packed block: everything that its tick needs, and nothing that is outside its bounds.
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "shared/model/block_texts.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::drive_block_test {
namespace {

using model::BlockFault;
using model::BlockVerdict;
using Bytes = std::vector<std::uint8_t>;

// With everything that a drive can have: two encoders, a torque sensor, an excitation of several lines.
control::DriveSetup<double> full_setup() {
  auto setup = demo_setup();
  control::ExcitationSetup<double> e;
  e.amplitude = 0.1;
  e.frequency_hz = 2.0;
  e.ticks = 20'000;
  e.fade_ticks = 1000;
  e.limit = 0.15;
  e.slope_limit = 50.0;
  e.velocity_limit = 150.0;
  e.overspeed = 200.0;
  setup.excitation = control::composite(e);
  return setup;
}
Bytes packed(const control::DriveSetup<double>& setup) {
  const Block block = demo_block(setup);
  const auto* first = reinterpret_cast<const std::uint8_t*>(block.bytes().data());
  return {first, first + block.bytes().size()};
}
BlockVerdict checked(const Bytes& bytes) {
  return control::check_for_drive(bytes, kTickHz);
}
Bytes sealed(Bytes bytes) {
  const std::uint32_t crc = model::crc32(std::span<const std::uint8_t>(bytes).first(bytes.size() - 4));
  for (std::size_t i = 0; i < 4; ++i) bytes[bytes.size() - 4 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
  return bytes;
}
Bytes with(Bytes bytes, std::size_t at, std::int64_t number, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    bytes.at(at + i) = static_cast<std::uint8_t>(static_cast<std::uint64_t>(number) >> (8 * i));
  return sealed(std::move(bytes));
}
// Where an entry's coefficients begin, by its kind.
std::map<std::uint16_t, std::pair<std::size_t, std::size_t>> entries(const Bytes& bytes) {
  std::map<std::uint16_t, std::pair<std::size_t, std::size_t>> found;
  model::for_each_entry(bytes, [&](std::uint16_t kind, std::span<const std::uint8_t> entry) {
    found[kind] = {static_cast<std::size_t>(entry.data() - bytes.data()), entry.size()};
  });
  return found;
}

// A field as README.md of shared/model has it: bytes in the block, and bounds. Numbers with an exponent are marked.
struct Expected {
  int bytes;
  std::int64_t low, high;
};
constexpr std::int64_t kWord = 0x7FFFFFFF, kWide = INT64_MAX, kTwo = std::int64_t{1} << 28;
constexpr Expected word{4, -kWord, kWord}, positive{4, 1, kWord}, limit{4, 1, kTwo}, flag{4, 0, 1};
constexpr Expected share{8, 0, kWide}, wide{8, -kWide, kWide}, order{8, -(kWide >> 1), kWide >> 1};
constexpr Expected factor{8, 0, std::int64_t{1} << 50}, speed{8, 1, (std::int64_t{1} << 47) - 1};
constexpr Expected position{8, -(std::int64_t{1} << 62), std::int64_t{1} << 62};
constexpr Expected counts{4, 4, 1 << 24}, converter{4, -32767, 32767}, ticks{4, 1, kWord}, short_ticks{4, 1, 65535};
constexpr Expected gain{0, -40, 32}, step{0, -40, 60}, distance{0, -60, 30}, part{4, 0, 1 << 27};
std::vector<Expected> row(std::initializer_list<std::pair<Expected, int>> parts) {
  std::vector<Expected> all;
  for (const auto& [field, times] : parts) all.insert(all.end(), static_cast<std::size_t>(times), field);
  return all;
}
using model::Section;
const std::map<Section, std::vector<Expected>>& sections() {
  static const std::map<Section, std::vector<Expected>> all = {
      {Section::general, row({{{4, 1, 1 << 20}, 1}, {flag, 3}})},
      {Section::motor_encoder, row({{counts, 1}, {share, 1}})},
      {Section::output_encoder, row({{counts, 1}, {share, 1}})},
      {Section::encoder_filter, row({{step, 1}, {share, 5}, {gain, 1}})},
      {Section::output_filter, row({{step, 1}, {share, 5}, {gain, 1}})},
      {Section::disturbance, row({{gain, 1}, {share, 1}, {limit, 1}})},
      {Section::torsion, row({{share, 6}, {gain, 4}, {order, 1}, {gain, 2}})},
      {Section::torque_ripple_filter, row({{step, 1}, {order, 1}, {limit, 1}, {part, 2}})},
      {Section::sensors, row({{gain, 1},
                              {word, 1},
                              {converter, 2},
                              {gain, 1},
                              {word, 1},
                              {converter, 2},
                              {gain, 1},
                              {word, 1},
                              {converter, 2},
                              {gain, 2}})},
      {Section::loops, row({{distance, 1},
                            {gain, 1},
                            {share, 1},
                            {limit, 1},
                            {positive, 1},
                            {limit, 1},
                            {positive, 1},
                            {limit, 2},
                            {positive, 1},
                            {gain, 2},
                            {limit, 1}})},
      {Section::trajectory, row({{position, 2}, {speed, 2}, {distance, 2}, {factor, 2}})},
      {Section::feedforward, row({{gain, 3},
                                  {order, 1},
                                  {wide, 1},
                                  {gain, 1},
                                  {limit, 2},
                                  {flag, 1},
                                  {gain, 1},
                                  {word, 2},
                                  {flag, 1},
                                  {step, 1},
                                  {word, 3},
                                  {gain, 1},
                                  {step, 1}})},
      {Section::excitation, row({{{4, 0, 4}, 1},
                                 {flag, 1},
                                 {{4, 0, 32}, 1},
                                 {wide, 2},
                                 {{4, 0, kWord}, 2},
                                 {share, 1},
                                 {limit, 1},
                                 {wide, 1},
                                 {word, 6},
                                 {gain, 1}})},
      {Section::excitation_lines, row({{{4, 0, 32767}, 1}, {{4, 0, 0xFFFFFFFF}, 1}, {gain, 1}})},
      {Section::safety, row({{positive, 7}, {ticks, 3}, {short_ticks, 2}, {{4, 0, 65535}, 1}})},
      {Section::residual_map, row({{positive, 7}, {factor, 1}})},
      {Section::following, row({{speed, 1}, {positive, 1}, {{4, 0, kWord}, 2}, {short_ticks, 1}})},
      {Section::rates, row({{flag, 1}})},
  };
  return all;
}

class DriveBlock : public testing::Test {
 protected:
  // With an encoder at the output, and without one: between them all sections.
  static const std::vector<Bytes>& blocks() {
    static const std::vector<Bytes> all = [] {
      auto without = full_setup();
      without.output_counts = 0;
      return std::vector<Bytes>{packed(full_setup()), packed(without)};
    }();
    return all;
  }
  static void refused(const Bytes& bytes, std::uint16_t kind, int field, const std::string& what) {
    const BlockVerdict v = checked(bytes);
    EXPECT_EQ(v.fault, BlockFault::wrong_coefficient) << what << ": " << model::text_of(v.fault);
    EXPECT_EQ(v.kind, kind) << what;
    EXPECT_EQ(v.field, field) << what;
  }
};

TEST_F(DriveBlock, HasEverythingThatADriveNeedsAndIsReadBackToTheSameNumbers) {
  for (const Bytes& bytes : blocks()) {
    const BlockVerdict v = checked(bytes);
    ASSERT_TRUE(v.good()) << model::text_of(v.fault) << ", kind " << v.kind << ", field " << v.field;
    auto read = std::make_unique<firmware::Parameters>();
    control::load_for_drive(bytes, *read);
    const Block again(*read, demo_constants());
    ASSERT_EQ(again.bytes().size(), bytes.size());
    EXPECT_EQ(std::memcmp(again.bytes().data(), bytes.data(), bytes.size()), 0);
  }
  auto derived = board::parameters_of(demo_drive(), full_setup());
  auto read = std::make_unique<firmware::Parameters>();
  control::load_for_drive(blocks()[0], *read);
  EXPECT_EQ(read->loops.torque_limit, derived.loops.torque_limit);
  EXPECT_EQ(read->trajectory.change, derived.trajectory.change);
  EXPECT_EQ(read->feedforward.lead_velocity.near, derived.feedforward.lead_velocity.near);
  EXPECT_EQ(read->excitation.lines[2].amplitude.factor, derived.excitation.lines[2].amplitude.factor);
  EXPECT_EQ(read->safety.torque_same_ticks, derived.safety.torque_same_ticks);
  EXPECT_EQ(read->torque.lowest, derived.torque.lowest);
}

TEST_F(DriveBlock, EachFieldIsRefusedBeyondEachOfItsBounds) {
  std::set<Section> met;
  for (const Bytes& bytes : blocks()) {
    const auto where = entries(bytes);
    for (const auto& [section, fields] : sections()) {
      const auto kind = static_cast<std::uint16_t>(section);
      if (!where.contains(kind)) continue;
      met.insert(section);
      std::size_t at = where.at(kind).first;
      for (std::size_t i = 0; i < fields.size(); ++i) {
        const Expected& e = fields[i];
        const int field = static_cast<int>(i);
        const std::string what = "section " + std::to_string(kind) + ", field " + std::to_string(i);
        if (e.bytes == 0) {
          refused(with(bytes, at, 1, 4), kind, field, what + ": not normal");
          refused(with(bytes, at, (std::int64_t{1} << 30) + 1, 4), kind, field, what + ": not normal");
          refused(with(with(bytes, at, std::int64_t{1} << 30, 4), at + 4, e.low - 1, 4), kind, field, what);
          refused(with(with(bytes, at, std::int64_t{1} << 30, 4), at + 4, e.high + 1, 4), kind, field, what);
          refused(with(with(bytes, at, 0, 4), at + 4, 1, 4), kind, field, what + ": zero with an exponent");
          at += 8;
          continue;
        }
        const auto count = static_cast<std::size_t>(e.bytes);
        const auto bits = static_cast<std::uint64_t>(e.high);
        if (e.high != 0xFFFFFFFF)
          refused(with(bytes, at, static_cast<std::int64_t>(bits + 1), count), kind, field, what);
        if (e.high != 0xFFFFFFFF)
          refused(with(bytes, at, static_cast<std::int64_t>(static_cast<std::uint64_t>(e.low) - 1), count), kind, field,
                  what);
        // At its bounds it is a number like others, though it may contradict one of them.
        for (const std::int64_t good : {e.low, e.high})
          EXPECT_NE(checked(with(bytes, at, good, count)).fault, BlockFault::wrong_coefficient) << what;
        at += count;
      }
      if (section != Section::excitation_lines) {
        EXPECT_EQ(at, where.at(kind).first + where.at(kind).second) << kind;
      }
    }
  }
  EXPECT_EQ(met.size(), sections().size());
}

TEST_F(DriveBlock, NumbersThatContradictEachOtherAreRefused) {
  const Bytes& bytes = blocks()[0];
  const auto where = entries(bytes);
  const auto at = [&](Section section, std::size_t offset) {
    return where.at(static_cast<std::uint16_t>(section)).first + offset;
  };
  const auto expect_unlike = [&](Section section, std::size_t offset, std::int64_t number, std::size_t count) {
    const BlockVerdict v = checked(with(bytes, at(section, offset), number, count));
    EXPECT_EQ(v.fault, BlockFault::unlike_coefficients) << static_cast<int>(section) << ": " << model::text_of(v.fault);
    EXPECT_EQ(v.kind, static_cast<std::uint16_t>(section));
  };
  // Counts of 2^56 other than the reciprocal says.
  expect_unlike(Section::motor_encoder, 0, 1 << 24, 4);
  expect_unlike(Section::motor_encoder, 4, 5, 8);
  expect_unlike(Section::motor_encoder, 4, INT64_MAX, 8);
  expect_unlike(Section::output_encoder, 0, 4, 4);
  // A converter whose lowest share is above its highest.
  expect_unlike(Section::sensors, 12, 32767, 4);
  // A velocity limit above the overspeed.
  expect_unlike(Section::loops, 24, std::int64_t{1} << 28, 4);
  // A lowest position above the highest; a change so small that 8192 turns are not enough to stop in.
  const Bytes above = with(with(bytes, at(Section::trajectory, 0), 1, 8), at(Section::trajectory, 8), 0, 8);
  EXPECT_EQ(checked(above).fault, BlockFault::unlike_coefficients);
  expect_unlike(Section::trajectory, 24, 1, 8);
  // Fades longer than the excitation; a guard without a limit.
  expect_unlike(Section::excitation, 32, 10'001, 4);
  expect_unlike(Section::excitation, 68, 0, 4);
  // Amplitudes and limits of the guard beyond two bases: the sum of two would leave the range of a value.
  for (const std::size_t place : {56, 60, 64})
    for (const std::int64_t number : {(std::int64_t{1} << 28) + 1, -(std::int64_t{1} << 28) - 1})
      expect_unlike(Section::excitation, place, number, 4);
  for (const std::size_t place : {68, 72}) expect_unlike(Section::excitation, place, (std::int64_t{1} << 28) + 1, 4);
  expect_unlike(Section::residual_map, 4, 1, 4);
}

TEST_F(DriveBlock, IsRefusedWhereABitIsOtherOrBytesAreMissing) {
  Bytes bytes = blocks()[0];
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const std::uint8_t before = bytes[at];
    bytes[at] ^= static_cast<std::uint8_t>(1 << (at % 8));
    ASSERT_FALSE(checked(bytes).good()) << at;
    bytes[at] = static_cast<std::uint8_t>(~before);
    ASSERT_FALSE(checked(bytes).good()) << at;
    bytes[at] = before;
  }
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    ASSERT_FALSE(checked({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}).good());
  EXPECT_TRUE(checked(bytes).good());
}

// Any section left out is missed; the others alone are no drive.
TEST_F(DriveBlock, WithoutOneOfItsSectionsIsNoneForADriveThoughGoodToSimulateWith) {
  for (const Bytes& bytes : blocks()) {
    for (const auto& [kind, place] : entries(bytes)) {
      if (kind < 0x100) continue;
      Bytes less = bytes;
      const auto first = less.begin() + static_cast<std::ptrdiff_t>(place.first - 8);
      less.erase(first, first + static_cast<std::ptrdiff_t>(place.second + 8));
      less[6] = static_cast<std::uint8_t>(less[6] - 1);
      less =
          with(with(less, 8, static_cast<std::int64_t>(less.size()), 4), 8, static_cast<std::int64_t>(less.size()), 4);
      const bool optional = kind == static_cast<std::uint16_t>(Section::excitation) ||
                            kind == static_cast<std::uint16_t>(Section::excitation_lines) ||
                            kind == static_cast<std::uint16_t>(Section::following) ||
                            kind == static_cast<std::uint16_t>(Section::rates);
      EXPECT_EQ(checked(less).fault, optional ? BlockFault::none : BlockFault::missing_section) << kind;
      auto model = std::make_unique<model::DriveModel<N>>();
      EXPECT_TRUE(control::load(less, *model).good());
    }
  }
  EXPECT_EQ(control::check_for_drive(blocks()[0], 16'000).fault, BlockFault::other_tick_rate);
}

// Whatever the bytes, as long as the checksum fits: a verdict; and what is taken runs.
TEST_F(DriveBlock, OfRandomBytesNeverDoesHarm) {
  std::mt19937 random(7001);
  int taken = 0;
  for (int k = 0; k < 3000; ++k) {
    Bytes bytes = blocks()[static_cast<std::size_t>(k % 2)];
    for (int change = 0; change < 2; ++change)
      bytes[84 + random() % (bytes.size() - 88)] = static_cast<std::uint8_t>(random());
    bytes = sealed(bytes);
    if (!checked(bytes).good()) continue;
    ++taken;
    if (taken % 20 != 0) continue;
    VirtualDrive drive({.drive = demo_drive(), .seed = 1}, Block(bytes));
    drive.run(60);
    drive.command(arm_velocity(20.0));
    run_with_host(drive, 0.01);
  }
  EXPECT_GT(taken, 100);
}

TEST_F(DriveBlock, StatesItsLengthAtTheStartOfAPage) {
  const Block block = demo_block();
  std::vector<std::byte> page(16384, std::byte{0xFF});
  EXPECT_EQ(firmware::block_bytes(page), 0u);
  std::memcpy(page.data(), block.bytes().data(), block.bytes().size());
  EXPECT_EQ(firmware::block_bytes(page), block.bytes().size());
  EXPECT_EQ(firmware::check_block({page.data(), block.bytes().size()}, kTickHz), firmware::BlockFinding::none);
  EXPECT_EQ(firmware::check_block(page, kTickHz), firmware::BlockFinding::wrong_length);
  EXPECT_EQ(firmware::block_bytes({page.data(), 600}), 0u);
}

}  // namespace
}  // namespace flexspline::tests::drive_block_test
