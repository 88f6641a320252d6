// A boot loader that demands signatures: what is not signed by its key, or was rolled back, is refused, and the image
// that ran before still starts.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "hil/twin/machine.hpp"
#include "host/drive_link/firmware/signing.hpp"
#include "shared/boot/development_key.hpp"
#include "tests/support/update_bench.hpp"

namespace flexspline::boot_trust_test {
namespace {

using boot::ImageFinding;
using boot::Slot;
using boot::SlotError;
using boot::Start;
using tests::SlotCells;
using tests::SlotFlash;
using LoaderSlots = boot::Slots<SlotFlash, boot::SignedBy<boot::kDevelopmentKey>>;
using Octets = std::vector<std::uint8_t>;

const firmware_files::KeyPair& development_key() {
  static const firmware_files::KeyPair pair = firmware_files::development_key_pair();
  return pair;
}
Octets signed_image(std::uint8_t name, std::uint16_t counter = 0,
                    const firmware_files::KeyPair& key = development_key()) {
  Octets image = tests::image_named(name);
  key.sign(image, counter);
  return image;
}

// A drive's memory, from one start to the next.
class Drive {
 public:
  // The version that a start of the boot loader finds; zero where it finds none.
  std::uint8_t start(Start& how) {
    SlotFlash flash(cells);
    LoaderSlots slots(flash, tests::kTestBoard);
    how = slots.resume();
    boot::ImageHeader header;
    if (how == Start::none || boot::read_image(slots.image(Slot::application), header) != ImageFinding::none) return 0;
    return header.version.major;
  }
  std::uint8_t start() {
    Start how{};
    return start(how);
  }
  // The application says that it does well; it knows nothing of signatures.
  void confirm() {
    SlotFlash flash(cells);
    tests::TestSlots application(flash, tests::kTestBoard);
    if (application.on_trial()) {
      EXPECT_TRUE(application.confirm());
    }
  }
  // What the boot loader says to it.
  ImageFinding download(const Octets& image) {
    SlotFlash flash(cells);
    LoaderSlots slots(flash, tests::kTestBoard);
    slots.keep_counter();
    if (const ImageFinding finding = slots.check_start(image); finding != ImageFinding::none) return finding;
    return tests::download(slots, image) ? ImageFinding::none : slots.finding();
  }
  void install(const Octets& image) {
    ASSERT_EQ(download(image), ImageFinding::none);
    Start how{};
    ASSERT_NE(start(how), 0);
    ASSERT_EQ(how, Start::trial);
    confirm();
  }
  std::uint16_t counter() {
    SlotFlash flash(cells);
    return LoaderSlots(flash, tests::kTestBoard).security_counter();
  }
  void put(Slot slot, const Octets& image) {
    std::copy(image.begin(), image.end(), cells.sectors[static_cast<std::size_t>(slot)].begin());
  }
  SlotCells cells;
};

TEST(BootTrust, WhatIsNotSignedByTheKeyIsRefusedAndTheOldImageStillStarts) {
  Drive drive;
  drive.install(signed_image('a'));
  EXPECT_EQ(drive.download(tests::image_named('b')), ImageFinding::not_signed);
  EXPECT_EQ(drive.start(), 'a');
  EXPECT_EQ(drive.download(signed_image('b', 0, firmware_files::new_key_pair())), ImageFinding::not_signed);
  EXPECT_EQ(drive.start(), 'a');
  // The program or the header was changed, and the checksums made to fit.
  for (const bool program : {true, false}) {
    Octets image = signed_image('b');
    boot::ImageHeader header;
    ASSERT_EQ(boot::read_image(image, header), ImageFinding::none);
    if (program) {
      image.back() ^= 1;
      header.crc = model::crc32(std::span(image).subspan(boot::kHeaderBytes));
    } else {
      header.security_counter = 9;
    }
    boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
    EXPECT_EQ(drive.download(image), ImageFinding::not_signed);
    EXPECT_EQ(drive.start(), 'a');
  }
  drive.install(signed_image('c'));
  EXPECT_EQ(drive.start(), 'c');
}

TEST(BootTrust, AnImageWithASmallerCounterIsRefusedOnceALargerOneWasConfirmed) {
  Drive drive;
  drive.install(signed_image('a', 1));
  drive.install(signed_image('b', 3));
  // Also where the boot loader was entered by request, without a start in between.
  EXPECT_EQ(drive.download(signed_image('c', 2)), ImageFinding::rolled_back);
  EXPECT_EQ(drive.counter(), 3);
  EXPECT_EQ(drive.start(), 'b');
  EXPECT_EQ(drive.download(signed_image('a', 1)), ImageFinding::rolled_back) << "the old one itself";
  EXPECT_EQ(drive.start(), 'b');
  drive.install(signed_image('c', 3));
  EXPECT_EQ(drive.start(), 'c') << "the same counter is taken";
  drive.install(signed_image('d', 4));
  EXPECT_EQ(drive.start(), 'd');
  EXPECT_EQ(drive.counter(), 4);
}

TEST(BootTrust, AnImageOnTrialDoesNotRaiseTheCounterAndIsTakenBack) {
  Drive drive;
  drive.install(signed_image('a', 1));
  EXPECT_EQ(drive.start(), 'a');
  ASSERT_EQ(drive.download(signed_image('b', 5)), ImageFinding::none);
  Start how{};
  for (int trial = 0; trial < 3; ++trial) {
    EXPECT_EQ(drive.start(how), 'b');
    EXPECT_EQ(how, Start::trial);
    EXPECT_EQ(drive.counter(), 1);
  }
  EXPECT_EQ(drive.start(how), 'a') << "it never confirmed itself";
  EXPECT_EQ(how, Start::application);
  EXPECT_EQ(drive.counter(), 1);
  drive.install(signed_image('c', 1));
  EXPECT_EQ(drive.start(), 'c');
}

// Whoever writes the flash past the boot loader: an application that was broken into.
TEST(BootTrust, WhatWasWrittenPastTheBootLoaderIsNotStarted) {
  Drive drive;
  drive.install(signed_image('a', 2));
  EXPECT_EQ(drive.start(), 'a');
  drive.install(signed_image('b', 2));
  EXPECT_EQ(drive.start(), 'b');
  const SlotCells good = drive.cells;
  drive.put(Slot::application, tests::image_named('x'));
  EXPECT_EQ(drive.start(), 'b') << "the download is still there";
  drive.cells = good;
  // A download with a journal that asks for its installation.
  SlotFlash flash(drive.cells);
  tests::TestSlots application(flash, tests::kTestBoard);
  ASSERT_TRUE(tests::download(application, tests::image_named('x', 42, tests::kTestBoard, 2)));
  EXPECT_EQ(drive.start(), 'b');
  EXPECT_EQ(drive.start(), 'b');
  // An older image, rightly signed, is not started either.
  drive.put(Slot::application, signed_image('c', 1));
  EXPECT_EQ(drive.start(), 'b') << "its copy in the other slot, whose counter is large enough";
  drive.put(Slot::application, signed_image('c', 1));
  drive.put(Slot::old, signed_image('d', 1));
  EXPECT_EQ(drive.start(), 0);
  drive.install(signed_image('e', 2));
  EXPECT_EQ(drive.start(), 'e');
}

// A drive whose boot loader was replaced by one that demands signatures.
TEST(BootTrust, AnApplicationFromBeforeSignaturesIsReplacedByASignedOne) {
  Drive drive;
  drive.put(Slot::application, tests::image_named('a'));
  EXPECT_EQ(drive.start(), 0);
  drive.install(signed_image('b', 1));
  EXPECT_EQ(drive.start(), 'b');
  EXPECT_EQ(drive.counter(), 1);
}

TEST(BootTrust, TheCounterOutlastsWordsThatAreWornOrHalfWritten) {
  Drive drive;
  auto& words = drive.cells.sectors[boot::kCounterSector];
  drive.install(signed_image('a', 7));
  EXPECT_EQ(drive.start(), 'a');
  EXPECT_EQ(drive.counter(), 7);
  // Half of a word of counter 0x0109 was written: it has too few zeros and does not count, but is not blank either.
  words[4] = 0x0D;
  EXPECT_EQ(drive.counter(), 7);
  drive.install(signed_image('b', 8));
  EXPECT_EQ(drive.start(), 'b');
  EXPECT_EQ(drive.counter(), 8);
  // All words are used: the drive still starts and takes updates.
  for (std::size_t i = 0; i < boot::kCounterBytes; i += 4)
    if (std::all_of(words.begin() + i, words.begin() + i + 4, [](std::uint8_t b) { return b == 0xFF; })) words[i] = 0;
  drive.install(signed_image('c', 9));
  EXPECT_EQ(drive.start(), 'c');
  EXPECT_EQ(drive.download(signed_image('d', 7)), ImageFinding::rolled_back);
}

TEST(BootTrust, TheTwinTakesSignedImagesAlone) {
  twin::Machine machine({}, true);
  ASSERT_TRUE(machine.start()) << "the factory's image";
  auto& slots = machine.slots();
  const Octets plain = twin::twin_image({.version = {0, 2}, .is_signed = false});
  EXPECT_EQ(slots.check_start(plain), ImageFinding::not_signed);
  EXPECT_FALSE(tests::download(slots, plain));
  EXPECT_TRUE(machine.start());
  EXPECT_EQ(machine.version(), twin::kFactoryVersion);
  EXPECT_TRUE(tests::download(slots, twin::twin_image({.version = {0, 3}})));
  EXPECT_TRUE(machine.start());
  EXPECT_EQ(machine.version(), (boot::Version{0, 3}));
}

// Its images were not signed, and it had no sector for the counter.
TEST(BootTrust, TheMemoryOfAnOlderTwinStartsAnewWithTheFactorysImage) {
  const auto file = std::filesystem::temp_directory_path() / ("flexspline-older-" + std::to_string(getpid()));
  std::ofstream(file, std::ios::binary) << std::string(boot::kSlots * twin::ImageFlash::kSectorBytes, 'x');
  for (int start = 0; start < 2; ++start) {
    twin::Machine machine(file, true);
    EXPECT_TRUE(machine.start());
    EXPECT_EQ(machine.version(), twin::kFactoryVersion);
  }
  std::ofstream(file, std::ios::binary) << "something else";
  EXPECT_THROW(twin::Machine(file, true), std::runtime_error);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace flexspline::boot_trust_test
