// DFU 1.1: descriptors, and what each request does in each state, against the specification's appendix A; the host's
// half of it against the drive's.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "firmware/boot_loader.hpp"
#include "host/drive_link/firmware/dfu_host.hpp"
#include "shared/usb/dfu.hpp"
#include "tests/support/update_bench.hpp"
#include "tests/support/usb_parts.hpp"

namespace flexspline::tests::usb_dfu_test {
namespace {

using usb::DfuState;
using usb::DfuStatus;

struct Memory {
  static constexpr std::string_view kName = "bench";
  static constexpr bool kCanUpload = true;
  DfuStatus write(std::size_t at, std::span<const std::uint8_t> block) {
    if (at != written.size()) return DfuStatus::unknown;
    written.insert(written.end(), block.begin(), block.end());
    return write_status;
  }
  std::uint32_t write_ms(std::size_t at) const { return at == 0 ? 300 : 7; }
  bool has_all() const { return all; }
  DfuStatus install() { return install_status; }
  std::uint32_t install_ms() const { return 70'000; }
  void abort() { written.clear(); }
  std::span<const std::uint8_t> read() const { return image; }

  Octets written, image = counting(150);
  DfuStatus write_status = DfuStatus::ok, install_status = DfuStatus::ok;
  bool all = true;
};
using Mode = usb::DfuMode<Memory>;

// A device in DFU mode and its host. Its interface is number 0.
struct ModeBench : Bench<false, Mode> {
  ModeBench() {
    device.get<Mode>().use(memory);
    EXPECT_TRUE(host.enumerate());
  }
  Mode& dfu() { return device.get<Mode>(); }
  Done out(std::uint8_t request, const Octets& data = {}, std::uint16_t value = 0) {
    return host.set({0x21, request, value, 0, 0}, data);
  }
  Done in(std::uint8_t request, std::uint16_t length, std::uint16_t value = 0) {
    return host.get({0xa1, request, value, 0, length});
  }
  // State and status as GETSTATUS tells them; the work that it announces is not done yet.
  std::vector<int> status() {
    const Done done = in(3, 6);
    if (done.stalled || done.data.size() != 6) return {-1};
    const int wait = done.data[1] | done.data[2] << 8 | done.data[3] << 16;
    return {done.data[0], done.data[4], wait};
  }
  void reach(DfuState state) {
    switch (state) {
      case DfuState::idle:
        return;
      case DfuState::download_sync:
        out(1, counting(8));
        return;
      case DfuState::download_busy:
        reach(DfuState::download_sync);
        status();
        return;
      case DfuState::download_idle:
        reach(DfuState::download_busy);
        device.poll();
        status();
        return;
      case DfuState::manifest_sync:
        reach(DfuState::download_idle);
        out(1, {}, 1);
        return;
      case DfuState::manifest:
        reach(DfuState::manifest_sync);
        status();
        return;
      case DfuState::upload_idle:
        in(2, 64);
        return;
      default:
        out(0);
    }
  }
  Memory memory;
};

enum Request : std::uint8_t { detach, download, download_end, upload, get_status, clear_status, get_state, abort_ };
constexpr Request kRequests[] = {detach, download, download_end, upload, get_status, clear_status, get_state, abort_};

Done send(ModeBench& b, Request request) {
  // The block that would come next.
  const std::uint16_t number = b.dfu().state() == DfuState::idle ? 0 : 1;
  switch (request) {
    case detach:
      return b.out(0);
    case download:
      return b.out(1, counting(8), number);
    case download_end:
      return b.out(1, {}, number);
    case upload:
      return b.in(2, 64, number);
    case get_status:
      return b.in(3, 6);
    case clear_status:
      return b.out(4);
    case get_state:
      return b.in(5, 1);
    default:
      return b.out(6);
  }
}

// Appendix A.2: where a request leads from a state. What a state does not list is STALL and dfuERROR.
std::optional<DfuState> leads_to(DfuState from, Request request) {
  using enum DfuState;
  switch (from) {
    case idle:
      if (request == download) return download_sync;
      if (request == upload) return upload_idle;
      if (request == get_status || request == get_state || request == abort_) return idle;
      break;
    case download_sync:
      if (request == get_status) return download_busy;
      if (request == get_state) return download_sync;
      if (request == abort_) return idle;
      break;
    case download_idle:
      if (request == download) return download_sync;
      if (request == download_end) return manifest_sync;
      if (request == get_status || request == get_state) return download_idle;
      if (request == abort_) return idle;
      break;
    case manifest_sync:
      if (request == get_status) return manifest;
      if (request == get_state) return manifest_sync;
      if (request == abort_) return idle;
      break;
    case upload_idle:
      if (request == upload || request == get_status || request == get_state) return upload_idle;
      if (request == abort_) return idle;
      break;
    case error:
      if (request == get_status || request == get_state) return error;
      if (request == clear_status) return idle;
      break;
    default:  // dfuDNBUSY and dfuMANIFEST answer nothing until their time is over
      break;
  }
  return std::nullopt;
}

TEST(UsbDfu, EveryRequestInEveryStateLeadsWhereTheSpecificationSays) {
  using enum DfuState;
  for (const DfuState from :
       {idle, download_sync, download_busy, download_idle, manifest_sync, manifest, upload_idle, error})
    for (const Request request : kRequests) {
      ModeBench b;
      b.reach(from);
      ASSERT_EQ(b.dfu().state(), from);
      const Done done = send(b, request);
      const auto expected = leads_to(from, request);
      const std::string what =
          "state " + std::to_string(static_cast<int>(from)) + ", request " + std::to_string(request);
      EXPECT_EQ(done.stalled, !expected) << what;
      EXPECT_FALSE(done.hung) << what;
      EXPECT_EQ(b.dfu().state(), expected.value_or(error)) << what;
      if (!expected) {
        EXPECT_EQ(b.status()[0], 15) << what << ": errSTALLEDPKT";
      }
      EXPECT_TRUE(b.wire.broken.empty()) << what;
    }
}

TEST(UsbDfu, DescriptorsAreThoseOfTheSpecification) {
  ModeBench b;
  const auto mode = read_configuration(b.host.descriptor(2, 0, 255).data).value();
  ASSERT_EQ(mode.list.size(), 1U);
  EXPECT_EQ(mode.list[0].code, 0xfe);
  EXPECT_EQ(mode.list[0].subclass, 1);
  EXPECT_EQ(mode.list[0].protocol, 2);
  EXPECT_EQ(b.host.text(mode.list[0].string), "bench");
  // Can download and upload, outlives its manifestation, detaches by itself; 1000 ms, 1024 bytes, version 1.1.
  const Octets functional{9, 0x21, 0x0f, 0xe8, 0x03, 0x00, 0x04, 0x10, 0x01};
  EXPECT_EQ(mode.list[0].others, std::vector<Octets>{functional});
  EXPECT_EQ(b.host.get({0x81, 6, 0x2100, 0, 9}).data, functional);
  EXPECT_TRUE(b.host.get({0x81, 6, 0x2200, 0, 9}).stalled);

  Bench<false, SmallHid, usb::DfuRuntime> run;
  ASSERT_TRUE(run.host.enumerate());
  const auto application = read_configuration(run.host.descriptor(2, 0, 255).data).value();
  ASSERT_EQ(application.list.size(), 2U);
  EXPECT_EQ(application.list[1].code, 0xfe);
  EXPECT_EQ(application.list[1].subclass, 1);
  EXPECT_EQ(application.list[1].protocol, 1);
  Octets without_upload = functional;
  without_upload[2] = 0x0d;
  EXPECT_EQ(application.list[1].others, std::vector<Octets>{without_upload});
}

struct ClosedMemory : Memory {
  static constexpr bool kCanUpload = false;
};
TEST(UsbDfu, ABootLoaderWithoutUploadSaysSoAndGivesNothingAway) {
  ClosedMemory memory;
  Bench<false, usb::DfuMode<ClosedMemory>> b;
  b.device.get<usb::DfuMode<ClosedMemory>>().use(memory);
  ASSERT_TRUE(b.host.enumerate());
  const auto mode = read_configuration(b.host.descriptor(2, 0, 255).data).value();
  EXPECT_EQ(mode.list[0].others[0][2], 0x0d);
  const Done done = b.host.get({0xa1, 2, 0, 0, 64});
  EXPECT_TRUE(done.stalled);
  EXPECT_TRUE(done.data.empty());
  EXPECT_EQ(b.host.get({0xa1, 3, 0, 0, 6}).data[0], 15) << "errSTALLEDPKT";
  EXPECT_FALSE(b.host.set({0x21, 4, 0, 0, 0}).stalled);
  EXPECT_FALSE(b.host.set({0x21, 1, 0, 0, 0}, counting(8)).stalled) << "a download goes on";
}

TEST(UsbDfu, AnApplicationGoesToItsBootLoaderOnceItMayAndTheHostHasTheAnswer) {
  Bench<false, SmallHid, usb::DfuRuntime> b;
  ASSERT_TRUE(b.host.enumerate());
  auto& dfu = b.device.get<usb::DfuRuntime>();
  const tests::Request ask{0xa1, 3, 0, 1, 6}, go{0x21, 0, 1000, 1, 0};
  EXPECT_EQ(b.host.get(ask).data, (Octets{0, 0, 0, 0, 0, 0})) << "appIDLE";
  EXPECT_TRUE(b.host.set(go).stalled) << "armed";
  EXPECT_EQ(b.host.get(ask).data[4], 0);
  EXPECT_TRUE(b.host.set({0x21, 1, 0, 1, 0}, counting(4)).stalled) << "no download into an application";
  dfu.allow(true);
  b.host.setup(go);
  EXPECT_FALSE(dfu.wants_loader()) << "the host has not seen it yet";
  Octets packet;
  EXPECT_EQ(b.host.in(0, packet), Hand::ack);
  EXPECT_TRUE(dfu.wants_loader());
  EXPECT_EQ(b.host.get(ask).data[4], 1) << "appDETACH";
}

TEST(UsbDfu, WorkIsAnnouncedWithItsTimeAndDoneOnceTheHostKnows) {
  ModeBench b;
  b.out(1, counting(8));
  b.device.poll();
  EXPECT_TRUE(b.memory.written.empty());
  EXPECT_EQ(b.status(), (std::vector<int>{0, 4, 300}));
  b.device.poll();
  EXPECT_EQ(b.memory.written, counting(8));
  EXPECT_EQ(b.status(), (std::vector<int>{0, 5, 0}));
  b.out(1, counting(8), 1);
  EXPECT_EQ(b.status(), (std::vector<int>{0, 4, 7}));
  b.device.poll();
  b.status();
  b.out(1, {}, 2);
  EXPECT_EQ(b.status(), (std::vector<int>{0, 7, 70'000}));
  b.device.poll();
  EXPECT_TRUE(b.dfu().installed());
  EXPECT_FALSE(b.dfu().install_reported());
  EXPECT_EQ(b.status(), (std::vector<int>{0, 2, 0})) << "manifestation tolerant: dfuIDLE";
  EXPECT_TRUE(b.dfu().install_reported());
}

TEST(UsbDfu, WhatTheMemoryRefusesIsTheStatusUntilItIsCleared) {
  for (const DfuStatus why : {DfuStatus::target, DfuStatus::erase, DfuStatus::program}) {
    ModeBench b;
    b.memory.write_status = why;
    b.reach(DfuState::download_busy);
    b.device.poll();
    EXPECT_EQ(b.status(), (std::vector<int>{static_cast<int>(why), 10, 0}));
    EXPECT_TRUE(b.out(1, counting(8), 1).stalled);
    EXPECT_EQ(b.status()[0], static_cast<int>(why)) << "the first one stays";
    EXPECT_FALSE(b.out(4).stalled);
    EXPECT_EQ(b.status(), (std::vector<int>{0, 2, 0}));
  }
  ModeBench b;
  b.memory.install_status = DfuStatus::verify;
  b.reach(DfuState::manifest);
  b.device.poll();
  EXPECT_EQ(b.status(), (std::vector<int>{7, 10, 0}));
  EXPECT_FALSE(b.dfu().installed());
  ModeBench early;
  early.memory.all = false;
  early.reach(DfuState::download_idle);
  EXPECT_TRUE(early.out(1, {}, 1).stalled);
  EXPECT_EQ(early.status()[0], 9) << "errNOTDONE";
  ModeBench unordered;
  unordered.reach(DfuState::download_idle);
  EXPECT_TRUE(unordered.out(1, counting(8), 3).stalled);
  EXPECT_EQ(unordered.status()[0], 8) << "errADDRESS";
}

TEST(UsbDfu, AnUploadEndsWithAShortBlockAndWithoutAnImageItSaysSo) {
  ModeBench b;
  Octets all;
  for (std::uint16_t number = 0; number < 3; ++number) {
    const Done done = b.in(2, 64, number);
    all.insert(all.end(), done.data.begin(), done.data.end());
  }
  EXPECT_EQ(all, counting(150));
  EXPECT_EQ(b.dfu().state(), DfuState::idle);
  b.memory.image = counting(128);
  EXPECT_EQ(b.in(2, 64, 0).data.size(), 64U);
  EXPECT_EQ(b.in(2, 64, 1).data.size(), 64U);
  EXPECT_EQ(b.in(2, 64, 2).data.size(), 0U) << "of a multiple of its blocks";
  EXPECT_EQ(b.dfu().state(), DfuState::idle);
  b.memory.image.clear();
  EXPECT_TRUE(b.in(2, 64, 0).stalled);
  EXPECT_EQ(b.status()[0], 10) << "errFIRMWARE";
}

// The whole chain: the host's code, the drive's core and class, its boot loader, and flash memory.
struct LoaderBoard {
  using Slots = tests::SlotFlash;
  using Trust = boot::AnySigner;
  static constexpr bool kCanUpload = true;
  static constexpr std::string_view kName = tests::kTestBoard;
  static constexpr std::uint32_t kEraseMs = 3, kBlockMs = 2, kCheckMs = 1;
  Slots& slots() { return flash; }
  bool takes_loader_request() { return std::exchange(request, false); }
  tests::SlotFlash& flash;
  bool request = false;
};
struct LoaderBench {
  using Loader = firmware::BootLoader<LoaderBoard>;
  explicit LoaderBench(tests::SlotCells& cells) : flash(cells) {
    found = loader.start();
    loader.serve(bus.device.get<Loader::Dfu>());
    EXPECT_TRUE(bus.host.enumerate());
  }
  struct Pipe : dfu::Pipe {
    explicit Pipe(LoaderBench& b) : bench(b) {}
    bool out(usb::DfuRequest request, std::uint16_t value, std::span<const std::uint8_t> data) override {
      const bool went =
          !bench.bus.host.set({0x21, static_cast<std::uint8_t>(request), value, 0, 0}, Octets(data.begin(), data.end()))
               .stalled;
      bench.bus.device.poll();
      return went;
    }
    bool in(usb::DfuRequest request, std::uint16_t value, std::size_t length, dfu::Bytes& data) override {
      const Done done =
          bench.bus.host.get({0xa1, static_cast<std::uint8_t>(request), value, 0, static_cast<std::uint16_t>(length)});
      bench.bus.device.poll();
      data = done.data;
      return !done.stalled;
    }
    void wait_ms(std::uint32_t time) override { waited += time; }
    std::string name() const override { return "the bench"; }
    LoaderBench& bench;
    std::uint32_t waited = 0;
  };
  // "" where it went well.
  std::string download(const Octets& image, std::size_t block = 128) {
    try {
      dfu::download(pipe, image, block, {});
    } catch (const dfu::DfuError& error) {
      return error.what();
    }
    return {};
  }
  tests::SlotFlash flash;
  LoaderBoard board{flash};
  Loader loader{board};
  Bench<false, Loader::Dfu> bus;
  Pipe pipe{*this};
  boot::Start found{};
};

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

TEST(UsbDfu, AnImageGoesFromTheHostToTheFirstStartWhateverTheSizeOfItsBlocks) {
  for (const std::size_t block : {4U, 60U, 64U, 512U, 1024U}) {
    tests::SlotCells cells;
    LoaderBench b(cells);
    EXPECT_EQ(b.found, boot::Start::none);
    EXPECT_EQ(b.download(tests::image_named('a', 101), block), "");
    EXPECT_GE(b.pipe.waited, 3U + 1U) << "it waits as long as it is install_reported to";
    auto& dfu = b.bus.device.get<LoaderBench::Loader::Dfu>();
    EXPECT_FALSE(b.loader.poll(dfu, false, 10));
    EXPECT_TRUE(b.loader.poll(dfu, false, 1010)) << "it leaves by itself";
    LoaderBench next(cells);
    EXPECT_EQ(next.found, boot::Start::trial);
    EXPECT_EQ(dfu::upload(next.pipe, 10'000, block), tests::image_named('a', 101));
  }
}

TEST(UsbDfu, WhatIsNoImageForThisBoardIsRefusedAndCostsNothing) {
  tests::SlotCells cells;
  { LoaderBench(cells).download(tests::image_named('a')); }
  LoaderBench b(cells);
  ASSERT_EQ(b.found, boot::Start::trial);
  ASSERT_TRUE(tests::TestSlots(b.flash, tests::kTestBoard).confirm());
  const Octets good = tests::image_named('b');
  Octets damaged = good, no_image = good, short_one = good, longer = good, bad_header = good;
  damaged[boot::kHeaderBytes + 9] ^= 1;
  no_image[0] ^= 1;
  bad_header[20] ^= 1;
  short_one.resize(good.size() - 8);
  longer.resize(good.size() + 8);
  for (const std::size_t block : {64U, 1024U}) {
    EXPECT_TRUE(contains(b.download(tests::image_named('b', 42, "another"), block), "errTARGET"));
    EXPECT_TRUE(contains(b.download(damaged, block), "errVERIFY"));
    EXPECT_TRUE(contains(b.download(no_image, block), "errFILE"));
    EXPECT_TRUE(contains(b.download(bad_header, block), "errFILE"));
    EXPECT_TRUE(contains(b.download(short_one, block), "errNOTDONE"));
    EXPECT_TRUE(contains(b.download(longer, block), "errNOTDONE"));
    EXPECT_TRUE(contains(b.download(tests::image_named('b', 500), block), "errFILE")) << "longer than the slot";
  }
  EXPECT_EQ(dfu::upload(b.pipe, 10'000, 64), tests::image_named('a'));
  EXPECT_EQ(LoaderBench(cells).found, boot::Start::application);
  EXPECT_EQ(b.download(good), "");
  EXPECT_EQ(LoaderBench(cells).found, boot::Start::trial);
}

TEST(UsbDfu, AMemoryThatDoesNotTakeTheImageIsSaidToBeSo) {
  tests::SlotCells cells;
  LoaderBench b(cells);
  b.flash.fail_from_now();
  EXPECT_TRUE(contains(b.download(tests::image_named('a')), "flash memory"));
}

TEST(UsbDfu, ABusResetAfterItWasUsedEndsDfuModeWhereThereIsSomethingToStart) {
  tests::SlotCells cells;
  LoaderBench empty(cells);
  auto& dfu = empty.bus.device.get<LoaderBench::Loader::Dfu>();
  EXPECT_FALSE(empty.loader.poll(dfu, true, 0)) << "enumeration";
  dfu::get_status(empty.pipe);
  EXPECT_FALSE(empty.loader.poll(dfu, true, 0)) << "nothing to start";
  ASSERT_EQ(empty.download(tests::image_named('a')), "");
  EXPECT_TRUE(empty.loader.poll(dfu, true, 0));
}

}  // namespace
}  // namespace flexspline::tests::usb_dfu_test
