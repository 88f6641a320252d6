// Slots, journal and security counter of any content, image headers among it: a start gives an image that is whole and
// for this board, or says that there is none; after it an image can be downloaded, and that one is started next.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/bytes.hpp"
#include "tests/support/update_bench.hpp"

namespace {

using namespace flexspline;
using boot::Slot;
using boot::Start;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "boot_slots_fuzz: %s\n", what);
  std::abort();
}

// What a reader makes of bytes from anywhere.
void read_anything(std::span<const std::uint8_t> bytes) {
  boot::ImageHeader header;
  const auto finding = boot::read_image(bytes, header);
  if (finding == boot::ImageFinding::none) {
    require(header.whole_bytes() <= bytes.size(), "an image is longer than its bytes");
    std::array<std::uint8_t, boot::kHeaderBytes> again;
    boot::write_header(again, header);
    boot::ImageHeader read;
    require(boot::read_header(again, read) == boot::ImageFinding::none && read.bytes == header.bytes &&
                read.crc == header.crc && read.board == header.board && read.version == header.version,
            "a header does not survive being written");
  }
  boot::check_header(bytes, tests::kTestBoard, bytes.size(), header);
}

}  // namespace

// Pieces: which slot, where, how long, what; or an image that is good up to then; or a word of the journal.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tests::FuzzBytes bytes(data, size);
  read_anything({data, size});
  tests::SlotCells cells;
  while (!bytes.empty()) {
    const std::uint8_t what = bytes.next();
    auto& sector = cells.sectors[(what >> 2) % boot::kImageSectors];
    if ((what & 3) == 0) {
      const std::size_t at = bytes.word() % sector.size();
      const auto piece = bytes.some(std::min<std::size_t>(bytes.next(), sector.size() - at));
      std::copy(piece.begin(), piece.end(), sector.begin() + static_cast<std::ptrdiff_t>(at));
    } else if ((what & 3) == 1) {
      const auto image =
          tests::image_named(bytes.next(), 1 + bytes.next() % 150, (what & 16) != 0 ? "another" : tests::kTestBoard);
      std::copy(image.begin(), image.end(), sector.begin());
    } else if ((what & 3) == 2) {
      constexpr std::uint32_t kSet = 0x5AA53CC3;
      const std::size_t at = tests::TestSlots::kImageBytes + 4 * (bytes.next() % 16);
      for (std::size_t i = 0; i < 4; ++i)
        cells.sectors[1][at + i] = static_cast<std::uint8_t>(kSet >> (8 * i) | ((what & 32) != 0 ? what : 0));
    } else {
      // The checksums of what is there are made to fit, so that they are no wall.
      const std::span all(sector);
      boot::ImageHeader header;
      header.bytes = 1U + what % 150U;
      header.crc = model::crc32(all.subspan(boot::kHeaderBytes, header.bytes));
      header.board = boot::board_bytes(tests::kTestBoard);
      header.version = {what, bytes.next()};
      boot::write_header(all.first<boot::kHeaderBytes>(), header);
    }
  }
  for (int start = 0; start < 6; ++start) {
    tests::SlotFlash flash(cells);
    tests::TestSlots slots(flash, tests::kTestBoard);
    const Start found = slots.resume();
    require((found == Start::none) || !slots.image(Slot::application).empty(), "what is started is not whole");
    if (found == Start::none) require(slots.resume() == Start::none, "the next look finds something else");
    if (found == Start::trial) require(slots.on_trial(), "a trial that nobody knows of");
    if (start == 3 && (size & 1) != 0 && found == Start::trial) slots.confirm();
  }
  tests::SlotFlash flash(cells);
  tests::TestSlots slots(flash, tests::kTestBoard);
  // Whatever the counter is, this one is not smaller.
  const auto newest = tests::image_named('n', 42, tests::kTestBoard, 0xFFFF);
  require(tests::download(slots, newest), "nothing can be downloaded");
  tests::TestSlots next(flash, tests::kTestBoard);
  require(next.resume() == Start::trial && next.confirm(), "what was downloaded is not started");
  tests::TestSlots last(flash, tests::kTestBoard);
  require(last.resume() == Start::application && std::ranges::equal(last.image(Slot::application), newest),
          "what was confirmed is not what is started");
  return 0;
}
