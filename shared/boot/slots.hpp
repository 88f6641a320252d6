// Three slots for images in flash and the journal of an update: an image is downloaded, installed, tried and confirmed,
// or rolled back. README.md describes the process and why a power cut at any point leaves a complete image.
//
// The boot loader, the application (which confirms itself) and the twin use it. Only the contents of the flash are kept
// from one start to the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "shared/boot/image.hpp"
#include "shared/storage/flash_port.hpp"
#include "shared/storage/words.hpp"

namespace flexspline::boot {

// The sectors of the port, by number.
enum class Slot : std::uint8_t {
  application,  // runs in place
  download,     // the new image; the journal is at its end
  old,          // the previous application
};
inline constexpr std::size_t kSlots = 3;
// Of a memory whose double words are written once (storage::kIsWriteOnce) twice as long.
inline constexpr std::size_t kJournalBytes = 64;
// Another sector, never erased: two words for each time that the security counter was raised.
inline constexpr std::size_t kCounterSector = kSlots, kImageSectors = kSlots + 1;
inline constexpr std::size_t kCounterBytes = 512;

enum class SlotError : std::uint8_t {
  none,
  erase,         // the memory reported an error
  not_blank,     // it is not blank after it was erased
  program,       // a word does not read back as written
  out_of_order,  // nothing was begun, or a chunk does not follow the one before it
  too_long,      // it does not fit
  image,         // finding() has the reason
};

// What the boot loader has to start.
enum class Start : std::uint8_t {
  application,  // the confirmed one
  trial,        // a new one that has not been confirmed yet
  none,         // there is no complete image, or the only one failed all its trials: wait for a download
};

// `Trust`: which images may run (image.hpp). An image that may not is handled as one that is damaged.
template <storage::FlashPort Flash, class Trust = AnySigner>
class Slots {
 public:
  static constexpr bool kOnce = storage::kIsWriteOnce<Flash>;
  static constexpr std::size_t kStepWords = kOnce ? 2 : 1;
  static constexpr std::size_t kImageBytes = Flash::kSectorBytes - kStepWords * kJournalBytes;
  // A power cut during a trial is not the image's fault, so it is started this many times before it is rolled back.
  static constexpr std::size_t kTrials = 3;

  // `board`: images for others are refused. It has to outlive this.
  constexpr Slots(Flash& flash, std::string_view board) : flash_(flash), board_(board) {}

  // At each start of the boot loader: finishes an update that was begun.
  constexpr Start resume() {
    make_certain();
    if (is_pending()) {
      if ((is_set(Mark::installed) && may_run(Slot::application)) || install()) {
        for (std::size_t i = 0; i < kTrials && !is_set(Mark::fell_back); ++i) {
          const Mark trial = trial_of(i);
          if (is_set(trial)) continue;
          // A trial that cannot be recorded is not started: it could repeat without end.
          if (set(trial)) return Start::trial;
          break;
        }
      }
      if (!fall_back()) return Start::none;
    }
    if (may_run(Slot::application)) {
      raise_counter();
      return Start::application;
    }
    // It is damaged, or a first installation was interrupted: another image replaces it, the newest first.
    const bool again = is_confirmed() && copy(Slot::download, Slot::application);
    return again || copy(Slot::old, Slot::application) ? Start::application : Start::none;
  }

  // The same counter before a download, where the boot loader was started by a request: the application may have
  // confirmed itself since the last start.
  constexpr void keep_counter() {
    make_certain();
    if (!is_pending() && may_run(Slot::application)) raise_counter();
  }
  // The largest of the images that were confirmed. Words that an interrupted write left have too few zeros, and do not
  // count.
  constexpr std::uint16_t security_counter() const {
    std::uint16_t most = 0;
    for (std::size_t i = 0; i < kCounters; ++i) {
      const std::uint32_t code = counter_word(i);
      const auto counter = static_cast<std::uint16_t>(code);
      if (code == code_of(counter) && counter > most) most = counter;
    }
    return most;
  }

  // Whether the running application is on trial. It reads the whole image: call it once, before there are deadlines.
  constexpr bool on_trial() const { return is_pending() && is_set(Mark::installed) && !is_set(Mark::fell_back); }
  // Confirms the running application, which is on trial: two words are written.
  constexpr bool confirm() { return set(Mark::confirmed) && set(Mark::permanent); }

  // Download.

  // Erases the download slot. An application that was never confirmed is rolled back first, so that the previous image
  // is not lost, and an update that was not begun is closed.
  constexpr SlotError begin() {
    staging_ = false;
    staged_ = 0;
    finding_ = ImageFinding::none;
    if (is_pending()) fall_back();
    // The first word of an image is cleared before the rest, so that an interrupted erase does not leave an image with
    // half a journal.
    if (word(Slot::download, 0) != storage::kErasedWord) flash_.program(number(Slot::download), 0, 0);
    if (const SlotError error = erase(Slot::download); error != SlotError::none) return error;
    staging_ = true;
    return SlotError::none;
  }
  // The next chunk; all but the last are a multiple of four bytes long. The header is checked as soon as it is
  // complete.
  constexpr SlotError write(std::span<const std::uint8_t> chunk) {
    if (!staging_ || staged_ % 4 != 0) return SlotError::out_of_order;
    if (chunk.size() > kImageBytes - staged_) return SlotError::too_long;
    const std::size_t first = staged_ / 4;
    if (!storage::for_each_word(
            chunk, [&](std::size_t i, std::uint32_t value) { return put(Slot::download, first + i, value); }))
      return fail(SlotError::program);
    const bool had_header = staged_ >= kHeaderBytes;
    staged_ += chunk.size();
    if (had_header || staged_ < kHeaderBytes) return SlotError::none;
    finding_ = check_start(bytes(Slot::download));
    return finding_ == ImageFinding::none ? SlotError::none : fail(SlotError::image);
  }
  // What the first bytes of an image show already.
  constexpr ImageFinding check_start(std::span<const std::uint8_t> start) const {
    ImageHeader header;
    const ImageFinding finding = check_header(start, board_, kImageBytes, header);
    if (finding != ImageFinding::none) return finding;
    if (!Trust::may_accept(header)) return ImageFinding::not_signed;
    return header.security_counter < security_counter() ? ImageFinding::rolled_back : ImageFinding::none;
  }
  // Whether all bytes that the header announces were received.
  constexpr bool has_all() const {
    ImageHeader header;
    return staging_ && read_header(bytes(Slot::download), header) == ImageFinding::none &&
           staged_ == header.whole_bytes();
  }
  // Checks the whole image in place, and requests its installation at the next start of the boot loader.
  constexpr SlotError finish() {
    if (!staging_) return SlotError::out_of_order;
    staging_ = false;
    if (!flush()) return SlotError::program;
    ImageHeader header;
    finding_ = read_image(bytes(Slot::download).first(staged_), header);
    if (finding_ == ImageFinding::none && header.board != board_bytes(board_)) finding_ = ImageFinding::wrong_board;
    if (finding_ == ImageFinding::none && header.whole_bytes() != staged_) finding_ = ImageFinding::too_long;
    if (finding_ == ImageFinding::none && !Trust::accepts(bytes(Slot::download).first(staged_), header))
      finding_ = ImageFinding::not_signed;
    if (finding_ == ImageFinding::none && header.security_counter < security_counter())
      finding_ = ImageFinding::rolled_back;
    if (finding_ != ImageFinding::none) return SlotError::image;
    return set(Mark::requested) ? SlotError::none : SlotError::program;
  }
  constexpr void abort() { staging_ = false; }
  constexpr std::size_t staged() const { return staged_; }
  constexpr ImageFinding finding() const { return finding_; }

  // The image in a slot with its header; empty where it is not complete or not for this board.
  constexpr std::span<const std::uint8_t> image(Slot slot) const {
    ImageHeader header;
    const bool good = read_image(bytes(slot), header) == ImageFinding::none && header.board == board_bytes(board_);
    return good ? bytes(slot).first(header.whole_bytes()) : std::span<const std::uint8_t>{};
  }
  // The same where it may run as well: it is signed, and has no smaller counter than one that was confirmed.
  constexpr std::span<const std::uint8_t> image_to_run(Slot slot) const {
    const auto whole = image(slot);
    ImageHeader header;
    if (read_header(whole, header) != ImageFinding::none || header.security_counter < security_counter() ||
        !Trust::accepts(whole, header))
      return {};
    return whole;
  }
  constexpr std::string_view board() const { return board_; }

 private:
  // Words of the journal, each set once: the request and its progress. They are not valid without a complete image
  // before them.
  enum class Mark : std::uint8_t {
    requested,
    saved,
    installed,
    trial,
    confirmed = 3 + kTrials,
    fell_back,
    taken_back,
    permanent,
    certain
  };
  static constexpr std::size_t kMarks = 3 + kTrials + 5;
  static_assert(4 * kMarks <= kJournalBytes);  // a step each
  static_assert(Flash::kSectorBytes > kHeaderBytes + kJournalBytes && Flash::kSectorBytes % 8 == 0);
  static_assert(Flash::kSectorBytes >= kCounterBytes);
  // Sixteen of its bits are zero: an interrupted write has fewer, and is completed by writing it again. A double word
  // that is written once takes zeros again, and an interrupted write of them cannot be corrected.
  static constexpr std::uint32_t kSet = kOnce ? 0 : 0x5AA53CC3;

  static constexpr Mark trial_of(std::size_t i) { return static_cast<Mark>(static_cast<std::size_t>(Mark::trial) + i); }
  static constexpr std::size_t number(Slot slot) { return static_cast<std::size_t>(slot); }
  static constexpr std::size_t place_of(Mark mark) {
    return kImageBytes / 4 + kStepWords * static_cast<std::size_t>(mark);
  }

  constexpr std::span<const std::uint8_t> all_of(Slot slot) const { return flash_.bytes(number(slot)); }
  constexpr std::span<const std::uint8_t> bytes(Slot slot) const { return all_of(slot).first(kImageBytes); }
  constexpr std::uint32_t word(Slot slot, std::size_t at) const {
    model::Reader r(all_of(slot).subspan(4 * at, 4));
    return r.take<std::uint32_t>();
  }
  constexpr bool is_whole(Slot slot) const { return !image(slot).empty(); }
  constexpr bool may_run(Slot slot) const { return !image_to_run(slot).empty(); }
  constexpr bool is_set(Mark mark) const { return word(Slot::download, place_of(mark)) == kSet; }
  constexpr bool set(Mark mark) {
    for (std::size_t i = 0; i < kStepWords; ++i)
      if (!put(Slot::download, place_of(mark) + i, kSet)) return false;
    return true;
  }
  // `fell_back` may be a word that an interrupted write left, set at one start and not at the next: `permanent`
  // overrules it.
  constexpr bool is_confirmed() const {
    return is_set(Mark::confirmed) && (is_set(Mark::permanent) || !is_set(Mark::fell_back));
  }
  constexpr bool is_closed() const { return is_confirmed() || is_set(Mark::taken_back); }
  // An update that was requested and is not finished.
  constexpr bool is_pending() const { return is_set(Mark::requested) && !is_closed() && is_whole(Slot::download); }
  // Bits of an interrupted write can read differently at each start. So before a start acts on a word that is set it is
  // written again, and an update whose request was interrupted is closed. Once `certain` is set nothing is left to do.
  constexpr void make_certain() {
    if (is_set(Mark::certain) || !is_whole(Slot::download)) return;
    if (is_set(Mark::requested)) {
      for (std::size_t i = 0; i < kMarks; ++i)
        if (is_set(static_cast<Mark>(i))) set(static_cast<Mark>(i));
      if (is_confirmed()) set(Mark::permanent);
    } else if (!is_set(Mark::taken_back)) {
      fall_back();
    }
    if (is_closed()) set(Mark::certain);
  }

  constexpr bool put(Slot slot, std::size_t at, std::uint32_t value) {
    if (value == storage::kErasedWord) return word(slot, at) == value;
    // Half a double word waits for the other half, and is read back with it by its port.
    return flash_.program(number(slot), at, value) && (kOnce || word(slot, at) == value);
  }
  constexpr SlotError erase(Slot slot) {
    if (!flash_.erase(number(slot))) return SlotError::erase;
    return storage::is_blank(all_of(slot)) ? SlotError::none : SlotError::not_blank;
  }
  // What waits for the rest of a double word.
  constexpr bool flush() {
    if constexpr (kOnce)
      return flash_.flush();
    else
      return true;
  }
  constexpr SlotError fail(SlotError error) {
    staging_ = false;
    return error;
  }
  // In whole words, as they are written: what follows the image in its last word counts.
  constexpr bool is_copy(Slot of, Slot slot) const {
    const std::size_t words = (image(of).size() + 3) / 4;
    for (std::size_t i = 0; i < words; ++i)
      if (word(slot, i) != word(of, i)) return false;
    return words > 0;
  }
  // An interrupted copy starts again. One that looks finished is written again without an erase, as its last word may
  // have been interrupted.
  constexpr bool copy(Slot from, Slot to) {
    const std::size_t words = (image_to_run(from).size() + 3) / 4;
    if (words == 0) return false;
    const bool is_there = is_copy(from, to) && (!kOnce || has_end(to));
    if (!is_there && erase(to) != SlotError::none) return false;
    for (std::size_t i = 0; i < words && !(kOnce && is_there); ++i)
      if (!put(to, i, word(from, i))) return false;
    return flush() && is_whole(to) && (!kOnce || put_end(to));
  }
  // Where words are written once: behind a copy, zeros. Once they are begun its last word is certain, and before that
  // no word of the journal relies on it: so a copy without them may be erased, and one with them never is. They are
  // where the download has its journal.
  constexpr bool has_end(Slot slot) const { return word(slot, kImageBytes / 4) == 0; }
  constexpr bool put_end(Slot slot) { return put(slot, kImageBytes / 4, 0) && put(slot, kImageBytes / 4 + 1, 0); }
  // The application is saved before a word of it is changed, unless it may not run.
  constexpr bool install() {
    if (is_set(Mark::fell_back)) return false;
    if (!is_set(Mark::saved)) {
      if (may_run(Slot::application) && !copy(Slot::application, Slot::old)) return false;
      if (!set(Mark::saved)) return false;
    }
    return copy(Slot::download, Slot::application) && set(Mark::installed);
  }
  // False: there is no image to go back to. An application that was not changed yet stays.
  constexpr bool fall_back() {
    if (!set(Mark::fell_back)) return false;
    const bool untouched = !is_set(Mark::saved) && may_run(Slot::application);
    return (untouched || copy(Slot::old, Slot::application)) && set(Mark::taken_back);
  }

  static constexpr std::size_t kTimes = 2;
  static constexpr std::size_t kCounters = kCounterBytes / 4 / kStepWords;
  // The counter in both halves, once inverted: each word has sixteen zeros.
  static constexpr std::uint32_t code_of(std::uint16_t counter) {
    return std::uint32_t{counter} | (~std::uint32_t{counter} << 16);
  }
  // With the second word a double word is written.
  static constexpr std::size_t counter_at(std::size_t i) { return kStepWords * i + kStepWords - 1; }
  // Blank, or what an interrupted write of this code left and it can be completed.
  static constexpr bool takes(std::uint32_t word, std::uint32_t code) {
    return kOnce ? word == storage::kErasedWord || word == code : (word & code) == code;
  }
  constexpr std::uint32_t counter_word(std::size_t i) const {
    model::Reader r(flash_.bytes(kCounterSector).subspan(4 * counter_at(i), 4));
    return r.take<std::uint32_t>();
  }
  // To that of the application, which is confirmed. The first two words that are blank or that an interrupted write of
  // the same counter left take it: an interrupted one may read as whole, and is certain once there is a second. Where
  // all are used, the counter stays what it is.
  constexpr void raise_counter() {
    ImageHeader header;
    if (read_header(bytes(Slot::application), header) != ImageFinding::none) return;
    if (header.security_counter < security_counter() || header.security_counter == 0) return;
    const std::uint32_t code = code_of(header.security_counter);
    std::size_t there = 0;
    for (std::size_t i = 0; i < kCounters; ++i) there += counter_word(i) == code ? 1 : 0;
    if (there >= kTimes) return;
    there = 0;
    for (std::size_t i = 0; i < kCounters && there < kTimes; ++i) {
      if (!takes(counter_word(i), code)) continue;
      if (flash_.program(kCounterSector, counter_at(i), code) && counter_word(i) == code) ++there;
    }
  }

  Flash& flash_;
  std::string_view board_;
  std::size_t staged_ = 0;
  bool staging_ = false;
  ImageFinding finding_ = ImageFinding::none;
};

}  // namespace flexspline::boot
