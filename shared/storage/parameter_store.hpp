// Two parameter blocks in flash: the active one and the previous one. README.md has the layout and why a power cut at
// any point leaves a complete old or a complete new block.
//
// The store does not interpret the block: `validate(bytes)` returns zero for a valid block and any other number as the
// reason.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/model/encoding.hpp"
#include "shared/protocol/states.hpp"
#include "shared/storage/flash_port.hpp"
#include "shared/storage/words.hpp"

namespace flexspline::storage {

enum class StoreError : std::uint8_t {
  none,
  too_long,        // the block does not fit a sector
  not_begun,       // nothing is being staged
  out_of_order,    // a chunk has to follow the one before it, or repeat what is staged
  incomplete,      // fewer bytes were staged than announced
  wrong_checksum,  // the staged bytes are not those that were announced
  invalid,         // the validator refused it; nothing was changed
  flash,           // the memory does not read back as written
  no_previous,     // there is no valid previous block
  worn,            // no room to record another restore; staging a block again makes room
};

using protocol::StoreState;  // what boot() found

template <FlashPort Flash>
class ParameterStore {
 public:
  // Steps of a slot are a word each, or a double word of a memory that is written once.
  static constexpr std::size_t kStepWords = kIsWriteOnce<Flash> ? 2 : 1;
  static constexpr std::size_t kHeaderBytes = 256 * kStepWords;
  static constexpr std::size_t kCapacity = Flash::kSectorBytes - kHeaderBytes;
  static constexpr std::uint32_t kMagic = 0x504C5846;  // "FXLP"
  static_assert(Flash::kSectorBytes > kHeaderBytes && Flash::kSectorBytes % 8 == 0);

  explicit constexpr ParameterStore(Flash& flash) : flash_(flash) {}

  // Reads both sectors; keeps nothing from before and writes nothing.
  template <class Validate>
  constexpr StoreState boot(Validate&& validate) {
    staged_ = announced_ = 0;
    staging_ = confirmed_ = false;
    bool committed[kSectors]{};
    for (std::size_t s = 0; s < kSectors; ++s) {
      rank_[s] = rank_of(s);
      committed[s] = word(s, 0) == kMagic && rank_[s] > 0;
      if (!committed[s] || !is_whole(s) || validate(block(s)) != 0) rank_[s] = 0;
    }
    active_ = is_newer(rank_[1], rank_[0]) ? 1 : 0;
    if (rank_[active_] == 0) return state_ = committed[0] || committed[1] ? StoreState::damaged : StoreState::empty;
    const std::size_t other = 1 - active_;
    const bool was_given_up = rank_[other] != 0 && older_by(rank_[active_], rank_[other]) > kActivates;
    if (was_given_up) rank_[other] = 0;
    const bool lost_newer = committed[other] && rank_[other] == 0 && is_newer(rank_of(other), rank_[active_]);
    return state_ = lost_newer ? StoreState::fell_back : StoreState::good;
  }
  constexpr StoreState state() const { return state_; }

  // Empty where there is none. The bytes are in flash, aligned to eight bytes, until the next begin().
  constexpr std::span<const std::uint8_t> active() const { return good_block(active_); }
  constexpr std::span<const std::uint8_t> previous() const { return good_block(1 - active_); }
  // CRC-32 of these bytes, zero without a block.
  constexpr std::uint32_t active_crc() const { return rank_[active_] == 0 ? 0 : word(active_, 2); }
  constexpr std::uint32_t previous_crc() const { return rank_[1 - active_] == 0 ? 0 : word(1 - active_, 2); }
  // Changes with each commit and each restore; zero: there is no active block.
  constexpr std::uint16_t sequence() const { return rank_[active_]; }
  // The number after a restore. The largest is followed by one; all numbers of a store are within a few hundred.
  static constexpr std::uint16_t sequence_after(std::uint16_t rank) { return later(rank, kActivates); }
  constexpr std::size_t staged() const { return staged_; }

  // Begins to stage a block of this length and CRC-32: erases the sector that is not active, and with it the previous
  // block.
  constexpr StoreError begin(std::size_t bytes, std::uint32_t crc) {
    staging_ = false;
    staged_ = 0;
    if (bytes == 0 || bytes > kCapacity) return StoreError::too_long;
    const std::size_t s = target();
    if (!drop_interrupted() || (rank_[active_] != 0 && !invalidate_other())) return StoreError::flash;
    if (!erase(s)) return StoreError::flash;
    announced_ = bytes;
    crc_ = crc;
    staging_ = true;
    return StoreError::none;
  }
  // A chunk: `offset` is the end of the previous chunk. All but the last are a multiple of four bytes long. A chunk
  // that is staged already with the same bytes is accepted again: a host whose answer was lost repeats it.
  constexpr StoreError write(std::size_t offset, std::span<const std::uint8_t> chunk) {
    if (!staging_) return StoreError::not_begun;
    if (offset % 4 != 0 || chunk.empty() || offset > staged_ || chunk.size() > announced_ - offset)
      return StoreError::out_of_order;
    if (chunk.size() % 4 != 0 && offset + chunk.size() != announced_) return StoreError::out_of_order;
    const std::size_t s = target();
    if (offset < staged_) return is_same(s, offset, chunk) ? StoreError::none : StoreError::out_of_order;
    const std::size_t first = (kHeaderBytes + offset) / 4;
    if (!for_each_word(chunk, [&](std::size_t i, std::uint32_t value) { return put(s, first + i, value); }))
      return flash_failed();
    staged_ = offset + chunk.size();
    return StoreError::none;
  }
  // Validates the whole staged block, then makes it active. `reason` gets the validator's reason.
  template <class Validate>
  constexpr StoreError commit(Validate&& validate, std::uint32_t& reason) {
    reason = 0;
    if (!staging_) return StoreError::not_begun;
    if (staged_ != announced_) return StoreError::incomplete;
    const std::size_t s = target();
    const auto bytes = flash_.bytes(s).subspan(kHeaderBytes, announced_);
    if (model::crc32(bytes) != crc_) return StoreError::wrong_checksum;
    reason = validate(bytes);
    if (reason != 0) return StoreError::invalid;
    if (!put(s, 0, kMagic) || !put(s, 1, static_cast<std::uint32_t>(announced_)) || !put(s, 2, crc_))
      return flash_failed();
    staging_ = false;
    return put_slot(s, kFirstSlot, kActivates);
  }
  // Exchanges the active and the previous block: a second restore goes back again. The block is validated first, as the
  // image may have changed since.
  template <class Validate>
  constexpr StoreError restore(Validate&& validate, std::uint32_t& reason) {
    reason = 0;
    const std::size_t s = 1 - active_;
    if (rank_[active_] == 0 || rank_[s] == 0 || !is_whole(s)) return StoreError::no_previous;
    reason = validate(block(s));
    if (reason != 0) return StoreError::invalid;
    if (!drop_interrupted()) return StoreError::flash;
    const std::size_t slot = free_slot(s);
    // begin() needs the same number.
    return slot + 2 * kTwice > kSlotsEnd ? StoreError::worn : put_twice(s, slot, kActivates);
  }

  // Factory state: no blocks. The active one is erased last.
  constexpr StoreError erase_all() {
    staging_ = false;
    staged_ = 0;
    for (const std::size_t s : {1 - active_, active_})
      if (!erase(s)) return StoreError::flash;
    active_ = 0;
    state_ = StoreState::empty;
    return StoreError::none;
  }

 private:
  // Words of the header: magic, bytes, CRC, one unused; then a slot of two steps for each time that the block became
  // active: a check, and finally the number and its complement. In a double word they are in its second word, with
  // which it is written.
  static constexpr std::size_t kFirstSlot = 4;
  static constexpr std::size_t kSlotWords = 2 * kStepWords;
  static constexpr std::size_t kSlotsEnd = kFirstSlot + (kHeaderBytes / 4 - kFirstSlot) / kSlotWords * kSlotWords;
  static constexpr std::size_t kTwice = 2 * kSlotWords;
  static constexpr std::size_t check_at(std::size_t slot) { return slot + kStepWords - 1; }
  static constexpr std::size_t code_at(std::size_t slot) { return slot + kSlotWords - 1; }
  static constexpr std::uint16_t kMostRank = 0xFFFE;
  // Increments of the number: for a block that becomes active, and for an active one that invalidates the other. A
  // block that is older than the active one by more than the first increment is invalid.
  static constexpr unsigned kActivates = 2, kGivesUp = 1;
  static constexpr std::uint16_t later(std::uint16_t rank, unsigned steps) {
    const unsigned next = rank + steps;
    return static_cast<std::uint16_t>(next > kMostRank ? next - kMostRank : next);
  }
  static constexpr unsigned older_by(std::uint16_t newer, std::uint16_t older) {
    return newer >= older ? newer - older : newer + kMostRank - older;
  }

  // Compares two wrapping numbers; zero is older than any.
  static constexpr bool is_newer(std::uint16_t a, std::uint16_t b) {
    if (a == 0 || b == 0) return a != 0;
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(a - b)) > 0;
  }
  // Sixteen of its bits are zero. An interrupted write leaves fewer, so it cannot be another valid number.
  static constexpr std::uint32_t code_of(std::uint16_t rank) {
    return std::uint32_t{rank} | (std::uint32_t{static_cast<std::uint16_t>(~rank)} << 16);
  }
  // Binds the number to the block: the bits that an interrupted erase leaves cannot be a valid number by chance.
  static constexpr std::uint32_t check_of(std::uint16_t rank, std::uint32_t crc) { return (crc ^ rank) * 0x9E3779B1U; }
  constexpr std::uint32_t word(std::size_t sector, std::size_t at) const {
    model::Reader r(flash_.bytes(sector).subspan(4 * at, 4));
    return r.take<std::uint32_t>();
  }
  // The number in a slot, zero where there is none.
  constexpr std::uint16_t rank_in(std::size_t sector, std::size_t slot) const {
    const std::uint32_t code = word(sector, code_at(slot));
    const auto rank = static_cast<std::uint16_t>(code);
    const bool valid =
        code == code_of(rank) && word(sector, check_at(slot)) == check_of(rank, word(sector, 2)) && rank <= kMostRank;
    return valid ? rank : std::uint16_t{0};
  }
  // The newest number in the slots, zero where there is none.
  constexpr std::uint16_t rank_of(std::size_t sector) const {
    std::uint16_t newest = 0;
    for (std::size_t slot = kFirstSlot; slot < kSlotsEnd; slot += kSlotWords)
      if (const std::uint16_t rank = rank_in(sector, slot); is_newer(rank, newest)) newest = rank;
    return newest;
  }
  // A number whose writing was interrupted can read as whole at a later start, and would then be newer than those
  // written since. So it is made invalid before another is written. Its check was whole before it was begun.
  constexpr bool drop_interrupted() {
    for (std::size_t s = 0; s < kSectors; ++s)
      for (std::size_t slot = kFirstSlot; slot < kSlotsEnd; slot += kSlotWords)
        if (word(s, check_at(slot)) != kErasedWord && word(s, code_at(slot)) != 0 && rank_in(s, slot) == 0 &&
            !put(s, code_at(slot), 0))
          return false;
    return true;
  }
  constexpr bool is_whole(std::size_t sector) const {
    const std::uint32_t bytes = word(sector, 1);
    return word(sector, 0) == kMagic && bytes > 0 && bytes <= kCapacity &&
           model::crc32(flash_.bytes(sector).subspan(kHeaderBytes, bytes)) == word(sector, 2);
  }
  constexpr std::span<const std::uint8_t> block(std::size_t sector) const {
    return flash_.bytes(sector).subspan(kHeaderBytes, word(sector, 1));
  }
  constexpr std::span<const std::uint8_t> good_block(std::size_t sector) const {
    return rank_[sector] == 0 ? std::span<const std::uint8_t>{} : block(sector);
  }
  // The sector for a new block: never the active one.
  constexpr std::size_t target() const { return rank_[active_] == 0 ? active_ : 1 - active_; }
  constexpr bool put(std::size_t sector, std::size_t at, std::uint32_t value) {
    return flash_.program(sector, at, value) && word(sector, at) == value;
  }
  constexpr bool is_same(std::size_t sector, std::size_t offset, std::span<const std::uint8_t> chunk) const {
    const auto there = flash_.bytes(sector).subspan(kHeaderBytes + offset, chunk.size());
    for (std::size_t i = 0; i < chunk.size(); ++i)
      if (there[i] != chunk[i]) return false;
    return offset + chunk.size() <= staged_;
  }
  constexpr bool erase(std::size_t sector) {
    rank_[sector] = 0;
    return flash_.erase(sector) && is_blank(flash_.bytes(sector));
  }
  // Before the other block is invalidated: writes the active block's number again, completely, as the next one in a new
  // slot. A power cut leaves bits that do not always read the same. If the active block's number has such bits, it
  // could become invalid after the other block is erased; and the other, half erased, may be valid at one start and not
  // at the next. With the new number the active block is certain, and the other is too old to count. Where all slots
  // are used there is no previous block any more (restore() leaves room): the old number is completed.
  constexpr bool invalidate_other() {
    if (confirmed_ && rank_[1 - active_] == 0) return true;
    const std::size_t slot = free_slot(active_, kTwice);
    if (slot + kTwice <= kSlotsEnd) return put_twice(active_, slot, kGivesUp) == StoreError::none;
    for (std::size_t used = kFirstSlot; used < kSlotsEnd; used += kSlotWords)
      if (word(active_, code_at(used)) == code_of(rank_[active_])) {
        confirmed_ = put(active_, check_at(used), word(active_, check_at(used))) &&
                     put(active_, code_at(used), code_of(rank_[active_]));
        return confirmed_;
      }
    return false;
  }
  // The first slot with this many free words from its start: a free slot may be followed by damaged words.
  constexpr std::size_t free_slot(std::size_t sector, std::size_t words = kSlotWords) const {
    std::size_t slot = kSlotsEnd;
    std::size_t free = 0;
    for (std::size_t at = kSlotsEnd; at-- > kFirstSlot;) {
      free = word(sector, at) == kErasedWord ? free + 1 : 0;
      if ((at - kFirstSlot) % kSlotWords == 0 && free >= words) slot = at;
    }
    return slot;
  }
  constexpr StoreError flash_failed() {
    staging_ = false;
    return StoreError::flash;
  }
  // In a sector that was not erased since the start, the first slot that reads as free may have been begun before a
  // power cut, and its bits may read as zeros later. The next one is free: a slot is written only after the one before
  // it is complete.
  constexpr StoreError put_twice(std::size_t sector, std::size_t slot, unsigned steps) {
    const std::uint32_t crc = word(sector, 2);
    if (const StoreError error = put_slot(sector, slot, steps); error != StoreError::none) return error;
    const std::uint16_t rank = rank_[sector];
    const bool good = put(sector, check_at(slot + kSlotWords), check_of(rank, crc)) &&
                      put(sector, code_at(slot + kSlotWords), code_of(rank));
    return good ? StoreError::none : StoreError::flash;
  }
  constexpr StoreError put_slot(std::size_t sector, std::size_t slot, unsigned steps) {
    const std::uint16_t rank = later(rank_[active_], steps);
    if (!put(sector, check_at(slot), check_of(rank, word(sector, 2))) || !put(sector, code_at(slot), code_of(rank)))
      return StoreError::flash;
    rank_[sector] = rank;
    active_ = sector;
    confirmed_ = true;
    state_ = StoreState::good;
    return StoreError::none;
  }

  Flash& flash_;
  std::size_t active_ = 0;
  std::uint16_t rank_[kSectors]{};  // zero: no valid block there
  std::size_t staged_ = 0;
  std::size_t announced_ = 0;
  std::uint32_t crc_ = 0;
  bool staging_ = false;
  bool confirmed_ = false;  // the active block's number was written since the start
  StoreState state_ = StoreState::empty;
};

}  // namespace flexspline::storage
