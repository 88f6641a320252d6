// A power cut can leave bits that read one way at one start and another way at the next. Long histories of the
// parameter store with cuts anywhere, and such bits: nothing is lost but the operation that was cut.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <random>
#include <set>
#include <vector>

#include "shared/storage/parameter_store.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/flash_model.hpp"
#include "tests/support/write_once_model.hpp"

namespace flexspline::store_weak_bits_test {
namespace {

using storage::StoreError;
using tests::CutAt;
using tests::PowerCut;
using Bytes = std::vector<std::uint8_t>;
// Bits that are programmed one by one, and double words that are written once.
struct Bits {
  static constexpr std::size_t kSector = 320;
  using Cells = tests::FlashCells<kSector>;
  using Flash = tests::FlashModel<kSector>;
};
struct DoubleWords {
  static constexpr std::size_t kSector = 576;
  using Cells = tests::OnceCells<kSector>;
  using Flash = tests::OnceFlash<kSector>;
};

Bytes block_named(std::uint8_t name) {
  Bytes bytes(12);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(name + i * i);
  return bytes;
}
std::uint32_t validate(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != 12) return 1;
  const Bytes wanted = block_named(bytes[0]);
  return std::equal(wanted.begin(), wanted.end(), bytes.begin()) ? 0 : 2;
}

// One drive, with such a memory: which blocks its store may start with, as far as is known from what was done.
template <class Memory>
class History {
  using Flash = typename Memory::Flash;
  using Store = storage::ParameterStore<Flash>;

 public:
  explicit History(std::uint64_t seed) : random_(seed) { cells_.weakens = true; }

  // A start, an action, and most often a cut somewhere in it. False where something else is active than may be.
  bool step() {
    Flash flash(cells_, random_());
    Store store(flash);
    store.boot(validate);
    const int active = name_of(store.active());
    if (!may_be_.contains(active)) return false;
    if (random_() % 8 == 0) return true;  // another start
    const bool cut = random_() % 16 != 0;
    if (cut) flash.cut(random_() % 10, static_cast<CutAt>(random_() % 3));
    try {
      if (random_() % 3 != 0) {
        commit(store, active);
      } else {
        restore(store);
      }
    } catch (const PowerCut&) {
      ++cuts_;
    }
    return true;
  }
  std::size_t cuts() const { return cuts_; }

 private:
  static int name_of(std::span<const std::uint8_t> bytes) {
    return bytes.empty() ? kNone : validate(bytes) == 0 ? bytes[0] : kDamaged;
  }
  void commit(Store& store, int active) {
    const auto name = static_cast<std::uint8_t>(++last_);
    const Bytes block = block_named(name);
    if (store.begin(block.size(), model::crc32(block)) != StoreError::none) return;
    may_be_ = {active};  // the other is erased
    if (store.write(0, block) != StoreError::none) return;
    may_be_.insert(name);
    std::uint32_t reason = 0;
    if (store.commit(validate, reason) == StoreError::none) may_be_ = {name};
  }
  void restore(Store& store) {
    const int before = name_of(store.previous());
    std::uint32_t reason = 0;
    if (before != kNone) may_be_.insert(before);
    if (store.restore(validate, reason) == StoreError::none) may_be_ = {before};
  }

  static constexpr int kNone = -1, kDamaged = -2;
  std::mt19937_64 random_;
  typename Memory::Cells cells_;
  std::set<int> may_be_{kNone};
  std::uint8_t last_ = 0;
  std::size_t cuts_ = 0;
};

template <class Memory>
void cut_histories(const char* memory) {
  const std::size_t wanted = tests::in_campaign<std::size_t>(200'000, 1'000'000);
  std::size_t cuts = 0;
  std::uint64_t seed = 0;
  for (; cuts < wanted;) {
    History<Memory> history(++seed);
    for (int k = 0; k < 400; ++k) ASSERT_TRUE(history.step()) << "seed " << seed << ", step " << k;
    cuts += history.cuts();
  }
  std::printf("power cuts of the store with weak %s: %zu, seeds 1 to %llu\n", memory, cuts,
              static_cast<unsigned long long>(seed));
}

TEST(StoreWithWeakBits, LosesNothingButTheOperationThatWasCut) {
  cut_histories<Bits>("bits");
}
TEST(StoreWithWeakBits, LosesNothingButTheOperationThatWasCutInAMemoryOfDoubleWordsThatAreWrittenOnce) {
  cut_histories<DoubleWords>("double words");
}

}  // namespace
}  // namespace flexspline::store_weak_bits_test
