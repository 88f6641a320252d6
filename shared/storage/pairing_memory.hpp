// The pairing key of a drive, and a counter for its challenges, in a sector that is never erased. README.md has the
// layout and why a power cut loses nothing but the operation that was cut.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/model/encoding.hpp"
#include "shared/storage/flash_port.hpp"

namespace flexspline::storage {

enum class PairingError : std::uint8_t {
  none,
  flash,  // the memory does not read back as written
  full,   // no room for another record
};

// Uses sector 0 of its port, of at least kBytes.
template <FlashPort Flash>
class PairingMemory {
 public:
  static constexpr std::size_t kKeyBytes = 32;
  using Key = std::array<std::uint8_t, kKeyBytes>;
  static constexpr std::size_t kRecords = 128, kRecordWords = 16;
  static constexpr std::size_t kCounterAt = kRecords * kRecordWords;  // words
  static constexpr std::size_t kCounterWords = 2048;
  static constexpr std::size_t kBytes = 4 * (kCounterAt + kCounterWords);
  static constexpr std::uint32_t kMostCounts = 32 * kCounterWords;
  static_assert(Flash::kSectorBytes >= kBytes);

  explicit constexpr PairingMemory(Flash& flash) : flash_(flash) {}

  // At each start, before the first tick: it may write. The last record may have been interrupted and then reads
  // differently at each start, so it is written again where it is valid, and made invalid where it is not.
  constexpr void boot() {
    used_ = 0;
    for (std::size_t r = 0; r < kRecords; ++r)
      if (!is_blank(r)) used_ = r + 1;
    if (used_ > 0) refresh_or_void(used_ - 1);
    is_paired_ = false;
    key_ = {};
    for (std::size_t r = 0; r < used_; ++r) {
      const std::uint32_t code = word(r, kCode);
      if (code != kPaired && code != kNotPaired) continue;
      // A record that was whole and is damaged: locked, with a key that no signature belongs to.
      const bool good = word(r, kCheck) == check_of(r);
      is_paired_ = !good || code == kPaired;
      key_ = good ? key_in(r) : Key{};
    }
    counted_ = false;
  }
  constexpr bool is_paired() const { return is_paired_; }
  // Zeros where there is none.
  constexpr const Key& key() const { return key_; }

  // Leaves room for the record that ends the pairing.
  constexpr PairingError pair(const Key& key) {
    if (used_ + 2 > kRecords) return PairingError::full;
    return record(kPaired, key);
  }
  constexpr PairingError remove() { return record(kNotPaired, {}); }

  // A number that no start had before; the same from the first call of a start on. False: all are used, or the memory
  // failed.
  constexpr bool start_number(std::uint32_t& number) {
    number = count_;
    if (counted_) return true;
    const std::uint32_t next = used_counts();
    if (next >= kMostCounts) return false;
    // All bits up to this one: those before it are zero already.
    const std::uint32_t value = ~std::uint32_t{0} << (next % 32) << 1;
    if (!put(kCounterAt + next / 32, value)) return false;
    counted_ = true;
    number = count_ = next;
    return true;
  }

 private:
  // Words of a record, in the order in which they are written. Each code has sixteen zeros: an interrupted write has
  // fewer, so it is neither.
  static constexpr std::size_t kBegun = 0, kKey = 1, kCheck = 9, kCode = 10;
  static constexpr std::uint32_t kPaired = 0x5AA53CC3, kNotPaired = 0x3CC35AA5;

  constexpr std::uint32_t at(std::size_t place) const {
    model::Reader r(flash_.bytes(0).subspan(4 * place, 4));
    return r.take<std::uint32_t>();
  }
  constexpr std::uint32_t word(std::size_t record, std::size_t place) const {
    return at(record * kRecordWords + place);
  }
  constexpr bool put(std::size_t place, std::uint32_t value) {
    return flash_.program(0, place, value) && at(place) == value;
  }
  constexpr bool is_blank(std::size_t record) const {
    for (std::size_t i = 0; i < kRecordWords; ++i)
      if (word(record, i) != kErasedWord) return false;
    return true;
  }
  constexpr Key key_in(std::size_t record) const {
    Key key{};
    const auto bytes = flash_.bytes(0).subspan(4 * (record * kRecordWords + kKey), kKeyBytes);
    for (std::size_t i = 0; i < kKeyBytes; ++i) key[i] = bytes[i];
    return key;
  }
  // Of the key as it is in the record, and of its place.
  constexpr std::uint32_t check_of(std::size_t record) const {
    const std::uint32_t crc = model::crc32(flash_.bytes(0).subspan(4 * (record * kRecordWords + kKey), kKeyBytes));
    return crc ^ (static_cast<std::uint32_t>(record + 1) * 0x9E3779B1U);
  }
  // Writing a valid record again also refreshes bits that fade.
  constexpr void refresh_or_void(std::size_t record) {
    const std::uint32_t code = word(record, kCode);
    if (code != kPaired && code != kNotPaired) {
      if (code != 0) put(record * kRecordWords + kCode, 0);
      return;
    }
    if (word(record, kCheck) != check_of(record)) return;
    for (std::size_t i = 0; i <= kCode; ++i) put(record * kRecordWords + i, word(record, i));
  }
  constexpr PairingError record(std::uint32_t code, const Key& key) {
    if (used_ >= kRecords) return PairingError::full;
    const std::size_t r = used_++, first = r * kRecordWords;
    bool written = put(first + kBegun, 0);
    model::Reader words(key);
    for (std::size_t i = 0; i < kKeyBytes / 4; ++i) {
      const auto value = words.take<std::uint32_t>();
      written = written && put(first + kKey + i, value);
    }
    if (!written || !put(first + kCheck, check_of(r)) || !put(first + kCode, code)) return PairingError::flash;
    is_paired_ = code == kPaired;
    key_ = is_paired_ ? key : Key{};
    return PairingError::none;
  }
  // One more than the last bit that is zero. A bit that was interrupted may be zero at one start and not at the next:
  // its number was never given out, or it was written again before.
  constexpr std::uint32_t used_counts() const {
    for (std::size_t i = kCounterWords; i-- > 0;) {
      const std::uint32_t value = at(kCounterAt + i);
      if (value == kErasedWord) continue;
      for (std::uint32_t bit = 32; bit-- > 0;)
        if ((value >> bit & 1) == 0) return static_cast<std::uint32_t>(32 * i) + bit + 1;
    }
    return 0;
  }

  Flash& flash_;
  Key key_{};
  bool is_paired_ = false;
  bool counted_ = false;
  std::uint32_t count_ = 0;
  std::size_t used_ = 0;
};

}  // namespace flexspline::storage
