// Whatever a host asks of the boot loader, in any order, with any data, resets and power cuts in between: the device
// keeps to its port's contract, the application that was there or a new one that is whole starts, and the next update
// works.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "firmware/boot_loader.hpp"
#include "tests/fuzz/bytes.hpp"
#include "tests/support/update_bench.hpp"
#include "tests/support/usb_parts.hpp"

namespace {

using namespace flexspline;
using namespace flexspline::tests;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "dfu_requests_fuzz: %s\n", what);
  std::abort();
}

struct Board {
  using Slots = tests::SlotFlash;
  using Trust = boot::AnySigner;
  static constexpr bool kCanUpload = true;
  static constexpr std::string_view kName = tests::kTestBoard;
  static constexpr std::uint32_t kEraseMs = 1, kBlockMs = 1, kCheckMs = 1;
  Slots& slots() { return flash; }
  bool takes_loader_request() { return false; }
  tests::SlotFlash& flash;
};
// From one start to the next.
struct Powered {
  using Loader = firmware::BootLoader<Board>;
  explicit Powered(tests::SlotCells& cells) : flash(cells) {
    start = loader.start();
    bus.device.get<Loader::Dfu>().use(memory);
    require(bus.host.enumerate(), "not to be enumerated");
  }
  tests::SlotFlash flash;
  Board board{flash};
  Loader loader{board};
  tests::TestSlots slots{flash, tests::kTestBoard};
  firmware::UpdateMemory<Board> memory{slots};
  Bench<false, Loader::Dfu> bus;
  boot::Start start{};
};

// An application that is confirmed, and one before it.
tests::SlotCells installed() {
  tests::SlotCells cells;
  for (const std::uint8_t name : {'a', 'b'}) {
    tests::SlotFlash flash(cells);
    tests::TestSlots slots(flash, tests::kTestBoard);
    require(tests::download(slots, tests::image_named(name)), "no image can be installed");
    slots.resume();
    slots.confirm();
  }
  return cells;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzBytes bytes(data, size);
  static const tests::SlotCells kInstalled = installed();
  tests::SlotCells cells = kInstalled;
  auto now = std::make_unique<Powered>(cells);
  // A good image, of which an input may send any part; it may change a byte of it.
  Octets image = tests::image_named('c');
  std::uint16_t number = 0;
  std::size_t at = 0;
  while (!bytes.empty()) {
    const std::uint8_t what = bytes.next();
    switch (what & 7) {
      case 0: {  // any class request to the interface
        const std::uint8_t request = bytes.next();
        const std::uint16_t value = bytes.word();
        if ((what & 8) != 0) {
          now->bus.host.get({0xa1, request, value, 0, static_cast<std::uint16_t>(bytes.word() & 0x7ff)});
        } else {
          now->bus.host.set({0x21, request, value, 0, 0}, bytes.some(bytes.next()));
        }
        break;
      }
      case 1: {  // the next block of the image
        const std::size_t count = std::min<std::size_t>(4U + 4U * (what >> 3), image.size() - at);
        const Octets block(image.begin() + static_cast<long>(at), image.begin() + static_cast<long>(at + count));
        now->bus.host.set({0x21, 1, number++, 0, 0}, block);
        at += count;
        break;
      }
      case 2:
        now->bus.host.get({0xa1, 3, 0, 0, 6});
        break;
      case 3:
        now->bus.device.poll();
        break;
      case 4:
        image[bytes.word() % image.size()] ^= what;
        break;
      case 5:  // a whole download, as a good host does it
        now->bus.host.set({0x21, (what & 8) != 0 ? std::uint8_t{4} : std::uint8_t{6}, 0, 0, 0});
        for (number = 0, at = 0; at < image.size(); at += 256) {
          const std::size_t end = std::min<std::size_t>(at + 256, image.size());
          now->bus.host.set({0x21, 1, number++, 0, 0},
                            Octets(image.begin() + static_cast<long>(at), image.begin() + static_cast<long>(end)));
          for (int i = 0; i < 2; ++i) {
            now->bus.host.get({0xa1, 3, 0, 0, 6});
            now->bus.device.poll();
          }
        }
        at = image.size();
        break;
      case 6:
        number = 0;
        at = 0;
        now->bus.host.enumerate();
        break;
      case 7:  // the power goes
        now = std::make_unique<Powered>(cells);
        require(now->start != boot::Start::none, "nothing to start");
        break;
    }
    require(now->bus.wire.broken.empty(), "the port's contract is broken");
  }
  require(now->bus.host.enumerate(), "not to be enumerated any more");
  Powered after(cells);
  require(after.start != boot::Start::none, "nothing to start at the end");
  boot::ImageHeader header;
  require(boot::read_image(after.slots.image(boot::Slot::application), header) == boot::ImageFinding::none,
          "what is started is not whole");
  require(tests::download(after.slots, tests::image_named('d')), "the next update is refused");
  Powered updated(cells);
  require(updated.start == boot::Start::trial, "the next update is not started");
  return 0;
}
