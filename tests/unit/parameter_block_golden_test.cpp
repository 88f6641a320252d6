// Parameter blocks that were written by earlier versions are read, and the format does not follow the order of members.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "shared/control/drive_block.hpp"
#include "shared/fixed/system.hpp"
#include "tests/same_bits/adversarial.hpp"
#include "tests/same_bits/drive_parts.hpp"

namespace flexspline::tests::parameter_block_golden_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using fixed::Fixed;

std::ifstream golden(const std::string& name) {
  return std::ifstream(std::string(FLEXSPLINE_SOURCE_DIR) + "/tests/unit/golden/" + name);
}
Bytes golden_block(const std::string& name) {
  std::ifstream in = golden(name);
  Bytes bytes;
  for (std::string line; std::getline(in, line);)
    for (std::size_t i = 0; i + 1 < line.size(); i += 2)
      bytes.push_back(static_cast<std::uint8_t>(std::stoi(line.substr(i, 2), nullptr, 16)));
  return bytes;
}
// The entries of a block, by kind.
std::map<std::uint16_t, Bytes> entries_of(const Bytes& block) {
  std::map<std::uint16_t, Bytes> entries;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    entries[kind].insert(entries[kind].end(), bytes.begin(), bytes.end());
  });
  return entries;
}
// Parameters by the number of the effect.
std::map<std::size_t, std::vector<double>> golden_parameters() {
  std::ifstream in = golden("parameter_block_v1_all_effects.txt");
  std::map<std::size_t, std::vector<double>> all;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::size_t number = 0;
    std::string name;
    words >> number >> name;
    for (double value = 0.0; words >> value;) all[number].push_back(value);
  }
  return all;
}

// The coefficients have to be those that are derived from the parameters: two fields of a kind that changed places
// would be another model.
TEST(GoldenBlock, OfVersion1GivesEveryEffectTheCoefficientsThatWereWritten) {
  const Bytes block = golden_block("parameter_block_v1_all_effects.hex");
  const auto parameters = golden_parameters();
  const auto drive = std::make_unique<model::DriveModel<Fixed>>();
  const auto verdict = control::load(block, *drive);
  ASSERT_TRUE(verdict.good()) << static_cast<int>(verdict.fault) << " at " << verdict.entry;
  std::size_t compared = 0;
  drive->for_each([&]<class Effect>(const auto& places) {
    const auto number = model::DriveModel<Fixed>::number_of<Effect>();
    if (!parameters.contains(number)) return;  // of a later version
    ASSERT_EQ(places.count, 1) << Effect::kInfo.name;
    const auto expected = Effect::template derive<Fixed>(parameters.at(number).data(), same_bits::drive());
    // As bytes of the model, so that every member is compared. Both were zero before they were filled.
    using Coefficients = typename Effect::template Coefficients<Fixed>;
    Bytes ours(model::kLargestBlock), theirs(model::kLargestBlock);
    model::BlockWriter ours_writer(ours), theirs_writer(theirs);
    for (auto* writer : {&ours_writer, &theirs_writer}) writer->begin({});
    ours_writer.add<Coefficients>(1, places.coefficients[0]);
    theirs_writer.add<Coefficients>(1, expected);
    EXPECT_EQ(ours, theirs) << Effect::kInfo.name;
    ++compared;
  });
  EXPECT_EQ(compared, parameters.size());
}

TEST(GoldenBlock, OfVersion1IsWrittenAgainByteByByte) {
  const Bytes block = golden_block("parameter_block_v1_all_effects.hex");
  const auto parameters = golden_parameters();
  Bytes again(model::kLargestBlock);
  model::BlockWriter writer(again);
  writer.begin(model::header_of(block));
  effects::for_each_effect([&]<class Effect>(std::size_t number) {
    if constexpr (!Effect::kInfo.host_only)
      if (parameters.contains(number))
        writer.add(static_cast<std::uint16_t>(number),
                   Effect::template derive<Fixed>(parameters.at(number).data(), same_bits::drive()));
  });
  control::add_settings(writer, same_bits::settings());
  again.resize(writer.end());
  const auto theirs = entries_of(block), ours = entries_of(again);
  ASSERT_EQ(ours.size(), theirs.size());
  for (const auto& [kind, bytes] : theirs) EXPECT_EQ(ours.at(kind), bytes) << "entry of kind " << kind;
}

TEST(GoldenBlock, OfVersion1ForADriveIsTakenByADrive) {
  const Bytes block = golden_block("parameter_block_v1_drive.hex");
  const auto verdict = control::check_for_drive(block, 20'000);
  ASSERT_TRUE(verdict.good()) << static_cast<int>(verdict.fault);
  const auto parameters = std::make_unique<control::DriveParameters<Fixed>>();
  control::load_for_drive(block, *parameters);
  Bytes again(model::kLargestBlock);
  model::BlockWriter writer(again);
  writer.begin(model::header_of(block));
  control::add_settings(writer, *parameters);
  again.resize(writer.end());
  const auto theirs = entries_of(block), ours = entries_of(again);
  std::size_t sections = 0;
  for (const auto& [kind, bytes] : theirs) {
    if (kind < 0x100 || kind >= model::kFirstNote) continue;
    ++sections;
    ASSERT_TRUE(ours.contains(kind)) << kind;
    EXPECT_EQ(ours.at(kind), bytes) << "section " << kind;
  }
  EXPECT_EQ(sections, ours.size());
}

// Two structs with the same fields in the order of the block, and their members in different orders.
struct InOneOrder {
  Fixed::Value first{};
  Fixed::Gain second{};
  bool third = false;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(first), c(second), c(third);
  }
};
struct InAnother {
  bool third = false;
  Fixed::Gain second{};
  std::int64_t not_in_a_block = 7;
  Fixed::Value first{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(first), c(second), c(third);
  }
};

TEST(Fields, TheOrderOfABlockIsThatOfFieldsAndNotThatOfMembers) {
  InOneOrder a;
  a.first.raw = -12345;
  static_cast<fixed::Gain&>(a.second) = Fixed::gain(0.375);
  a.third = true;
  Bytes room(64);
  model::Writer writer(room);
  model::write_fields(writer, a);
  ASSERT_EQ(writer.size(), 16u);
  InAnother b;
  ASSERT_EQ(model::read_fields(std::span(room).first(16), b).fault, model::FieldFault::none);
  EXPECT_EQ(b.first.raw, -12345);
  EXPECT_EQ(b.second.mantissa, a.second.mantissa);
  EXPECT_EQ(b.second.exponent, a.second.exponent);
  EXPECT_TRUE(b.third);
  EXPECT_EQ(b.not_in_a_block, 7);
  Bytes again(64);
  model::Writer other(again);
  model::write_fields(other, b);
  EXPECT_EQ(again, room);
}

TEST(Fields, AWrongFieldIsNamedByItsPlaceAndAShortOrLongEntryByItsLength) {
  InOneOrder a;
  static_cast<fixed::Gain&>(a.second) = Fixed::gain(0.375);
  Bytes room(16);
  model::Writer writer(room);
  model::write_fields(writer, a);
  room[12] = 2;  // neither true nor false
  const auto wrong = model::read_fields(room, a);
  EXPECT_EQ(wrong.fault, model::FieldFault::field);
  EXPECT_EQ(wrong.field, 2);
  room[12] = 1;
  EXPECT_EQ(model::read_fields(std::span(room).first(12), a).fault, model::FieldFault::length);
  room.resize(20);
  EXPECT_EQ(model::read_fields(room, a).fault, model::FieldFault::length);
}

}  // namespace
}  // namespace flexspline::tests::parameter_block_golden_test
