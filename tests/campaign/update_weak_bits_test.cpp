// Long histories of updates with power cuts anywhere and bits that read differently at each start: images that are
// confirmed, that hang, that are downloaded twice. Nothing is lost but the operation that was cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <random>
#include <set>
#include <string>

#include "tests/support/campaign_size.hpp"
#include "tests/support/update_bench.hpp"
#include "tests/support/write_once_model.hpp"

namespace flexspline::update_weak_bits_test {
namespace {

using boot::Slot;
using boot::Start;
using tests::CutAt;
using tests::PowerCut;

// Bits that are programmed one by one, and double words that are written once.
struct Bits {
  using Cells = tests::SlotCells;
  using Flash = tests::SlotFlash;
};
struct DoubleWords {
  using Cells = tests::OnceCells<tests::kSlotBytes, boot::kImageSectors>;
  using Flash = tests::OnceFlash<tests::kSlotBytes, boot::kImageSectors>;
};

// One drive, with such a memory: which images may be started, as far as is known from what was done.
template <class Memory>
class UpdateHistory {
  using SlotFlash = typename Memory::Flash;
  using TestSlots = boot::Slots<SlotFlash>;

 public:
  explicit UpdateHistory(std::uint64_t seed) : random_(seed) {
    SlotFlash flash(cells_);
    TestSlots slots(flash, tests::kTestBoard);
    tests::download(slots, image_of(confirmed_));
    slots.resume();
    slots.confirm();
    slots.resume();
    cells_.weakens = true;
  }

  // A start, what the application or a host does then, and most often a power cut somewhere in it. What is wrong, or
  // nothing.
  std::string step() {
    SlotFlash flash(cells_, random_());
    if (random_() % 16 != 0) {
      // Most operations are in copies of images; those of the journal are few.
      const std::size_t longest[] = {4, 40, 400};
      flash.cut(random_() % longest[random_() % 3], static_cast<CutAt>(random_() % 3));
    }
    try {
      TestSlots slots(flash, tests::kTestBoard);
      ++starts_;
      const Start start = slots.resume();
      if (const std::string wrong = started(slots, start); !wrong.empty()) return wrong;
      if (start == Start::trial && !hangs(pending_)) confirm(flash);
      if (random_() % 3 == 0) return load(flash);
    } catch (const PowerCut&) {
      ++cuts_;
    }
    return {};
  }
  std::size_t cuts() const { return cuts_; }
  std::size_t updates() const { return updates_; }
  std::size_t taken_back() const { return taken_back_; }

 private:
  static constexpr std::uint8_t kNone = 0;
  // A counter that rises slowly with the name.
  static std::uint16_t counter_of(std::uint8_t name) { return name / 8; }
  static bool hangs(std::uint8_t name) { return name % 4 == 3; }
  static std::vector<std::uint8_t> image_of(std::uint8_t name) {
    return tests::image_named(name, 42, tests::kTestBoard, counter_of(name));
  }
  static std::uint8_t name_of(const TestSlots& slots) {
    const auto image = slots.image(Slot::application);
    boot::ImageHeader header;
    if (boot::read_image(image, header) != boot::ImageFinding::none) return kNone;
    return std::ranges::equal(image, image_of(header.version.major)) ? header.version.major : kNone;
  }

  // The boot loader decided what runs: what is decided stays.
  std::string started(const TestSlots& slots, Start start) {
    const std::uint8_t name = name_of(slots);
    if (start == Start::none) return "nothing to start";
    const bool may_be = name == confirmed_ || (name == pending_ && pending_ != kNone);
    if (!may_be)
      return "starts " + std::to_string(name) + ", not " + std::to_string(confirmed_) + " or " +
             std::to_string(pending_);
    if (slots.security_counter() > counter_of(name)) return "an image with a smaller counter is started";
    if (slots.security_counter() < counter_) return "the counter falls";
    counter_ = slots.security_counter();
    if (start == Start::trial) return name == pending_ ? "" : "a confirmed image is on trial";
    if (name == confirmed_ && is_certain_ && starts_ <= TestSlots::kTrials)
      return "an update that was complete is taken back after " + std::to_string(starts_) + " starts";
    if (name == confirmed_ && pending_ != kNone) ++taken_back_;
    if (name == pending_) ++updates_;
    confirmed_ = name;
    pending_ = kNone;
    is_certain_ = false;
    return {};
  }
  // Another object, as it is another program.
  void confirm(SlotFlash& flash) {
    TestSlots application(flash, tests::kTestBoard);
    if (!application.on_trial()) return;
    is_certain_ = false;
    if (!application.confirm()) return;
    confirmed_ = pending_;
    pending_ = kNone;
    ++updates_;
  }
  // By the boot loader, which a host requested.
  std::string load(SlotFlash& flash) {
    TestSlots slots(flash, tests::kTestBoard);
    slots.keep_counter();
    // Every eighth time an old one. Names are used again after 250 updates, with the counter back at zero: the drive
    // refuses those, and the history ends there.
    const bool old = random_() % 8 == 0;
    const auto name = static_cast<std::uint8_t>(old ? 1 + random_() % last_ : last_ + 1);
    if (name == confirmed_) return {};
    if (!old && last_ < 250) ++last_;
    is_certain_ = false;  // begin() takes back what was not confirmed
    if (slots.begin() != boot::SlotError::none) return "the download does not begin";
    pending_ = kNone;
    const auto image = image_of(name);
    if (const auto error = slots.write(image); error != boot::SlotError::none)
      return counter_of(name) < slots.security_counter() ? "" : "the download is refused";
    if (counter_of(name) < slots.security_counter()) return "an image with a smaller counter is taken";
    pending_ = name;
    if (slots.finish() != boot::SlotError::none) return "the image is refused";
    starts_ = 0;
    is_certain_ = true;
    return {};
  }

  std::mt19937_64 random_;
  typename Memory::Cells cells_;
  std::uint8_t confirmed_ = 1;
  std::uint8_t pending_ = kNone;  // may be started as well
  bool is_certain_ = false;       // ... and has to be: its download was complete
  std::uint8_t last_ = 1;
  std::size_t starts_ = 0;  // since that download
  std::uint16_t counter_ = 0;
  std::size_t cuts_ = 0, updates_ = 0, taken_back_ = 0;
};

template <class Memory>
void cut_updates(const char* memory) {
  // A loss at one cut in 10,000 stays hidden in 40,000 cuts with a probability of exp(-4) = 2 %, one in 250,000 in all
  // of them.
  const std::size_t wanted = tests::in_campaign<std::size_t>(40'000, 1'000'000);
  std::size_t cuts = 0, updates = 0, taken_back = 0;
  std::uint64_t seed = 0;
  for (; cuts < wanted;) {
    UpdateHistory<Memory> history(++seed);
    for (int k = 0; k < 400; ++k) {
      const std::string wrong = history.step();
      ASSERT_EQ(wrong, "") << "seed " << seed << ", step " << k << ", after " << cuts + history.cuts() << " cuts";
    }
    cuts += history.cuts();
    updates += history.updates();
    taken_back += history.taken_back();
  }
  std::printf("power cuts of updates with weak %s: %zu, seeds 1 to %llu; %zu updates done, %zu taken back\n", memory,
              cuts, static_cast<unsigned long long>(seed), updates, taken_back);
  EXPECT_GT(updates, wanted / 100);
  EXPECT_GT(taken_back, wanted / 1000);
}

TEST(UpdateWithWeakBits, LosesNothingButTheOperationThatWasCut) {
  cut_updates<Bits>("bits");
}
TEST(UpdateWithWeakBits, LosesNothingButTheOperationThatWasCutInAMemoryOfDoubleWordsThatAreWrittenOnce) {
  cut_updates<DoubleWords>("double words");
}

}  // namespace
}  // namespace flexspline::update_weak_bits_test
