// The boot loader's image: takes a firmware image by DFU into the modelled flash memory, installs it and starts it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "hil/twin/image.hpp"
#include "shared/boot/image.hpp"
#include "tests/board/usb_bus.hpp"

namespace flexspline::tests {
namespace {

const std::string kLoader = std::string(FLEXSPLINE_BOARDS) + "/stm32f405/f405-dac-boot.elf";
// From sector 3 on, the security counter's; 5, 6 and 7 are application, download, the one before.
const WrittenFlash kSlots{
    .address = 0x0800C000,
    .sectors = {
        {3, 0, 0x4000}, {4, 0x4000, 0x10000}, {5, 0x14000, 0x20000}, {6, 0x34000, 0x20000}, {7, 0x54000, 0x20000}}};
constexpr int kApplication = 0x14000, kDownload = 0x34000;
constexpr std::uint32_t kStack = 0x20001000, kEntry = 0x08020301;

enum class Signature { development, none };
// Something with vectors, as long as an application.
std::vector<std::uint8_t> image(const std::string& board, Signature signature = Signature::development,
                                std::uint16_t counter = 0, std::size_t bytes = 9000) {
  std::vector<std::uint8_t> all(boot::kHeaderBytes + bytes);
  for (std::size_t i = boot::kHeaderBytes; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  const std::uint32_t vectors[2] = {kStack, kEntry};
  for (std::size_t i = 0; i < 8; ++i)
    all[boot::kHeaderBytes + i] = static_cast<std::uint8_t>(vectors[i / 4] >> (8 * (i % 4)));
  boot::ImageHeader header;
  header.bytes = static_cast<std::uint32_t>(bytes);
  header.crc = model::crc32(std::span(all).subspan(boot::kHeaderBytes));
  header.board = boot::board_bytes(board);
  header.version = {1, 2};
  header.security_counter = counter;
  boot::write_header(std::span(all).first<boot::kHeaderBytes>(), header);
  if (signature == Signature::development) twin::sign_with_development_key(all);
  return all;
}

class DfuHost {
 public:
  explicit DfuHost(Chip& chip) : chip_(chip), bus_(chip) {}
  bool enumerate() { return bus_.enumerate(); }
  bool upload() { return bus_.control_in({0xA1, 2, 0, 0, 0, 0, 64, 0}).has_value(); }
  bool clear_status() { return bus_.control_out({0x21, 4, 0, 0, 0, 0, 0, 0}); }
  std::vector<std::uint8_t> device() { return bus_.descriptor(1, 0, 18); }
  // Status and state (DFU 1.1, 6.1.2), once the device is not busy any more.
  std::pair<int, int> status() {
    for (int i = 0; i < 50; ++i) {
      const auto s = bus_.control_in({0xA1, 3, 0, 0, 0, 0, 6, 0});
      if (!s || s->size() != 6) continue;
      if ((*s)[4] != 4 && (*s)[4] != 7) return {(*s)[0], (*s)[4]};
      chip_.ticks(4);
    }
    return {-1, -1};
  }
  // The status at its end or at the first block that is refused.
  int download(const std::vector<std::uint8_t>& image) {
    std::uint8_t block = 0;
    for (std::size_t at = 0; at < image.size(); at += 1024, ++block) {
      const std::size_t size = std::min<std::size_t>(1024, image.size() - at);
      if (!send(block, std::span(image).subspan(at, size))) return -1;
      if (const auto [status, state] = this->status(); status != 0 || state != 5) return status;
    }
    if (!send(block, {})) return -1;
    return status().first;
  }

 private:
  bool send(std::uint8_t block, std::span<const std::uint8_t> data) {
    return bus_.control_out({0x21, 1, block, 0, 0, 0, static_cast<std::uint8_t>(data.size() & 0xFF),
                             static_cast<std::uint8_t>(data.size() >> 8)},
                            data);
  }
  Chip& chip_;
  UsbBus bus_;
};

void expect_no_violation(const Chip& chip) {
  for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
}

// Start-up paints the stack (boards/cortex_m4/start.cpp); an interrupt takes less than a quarter of it.
void expect_room_on_stack(const Chip& chip, const char* when) {
  const std::uint32_t bottom = chip.machine.symbol("stack_bottom"), top = chip.machine.symbol("stack_top");
  std::uint32_t free = bottom;
  while (free < top && chip.machine.word(free) == 0xA5A5A5A5) free += 4;
  std::printf("boot loader, verification %s: %u bytes of stack of %u\n", when, top - free, top - bottom);
  EXPECT_GE(free - bottom, (top - bottom) / 4) << when;
  EXPECT_GT(top - free, 500U) << "it was used";
}

TEST(BoardLoader, WithoutAnImageItWaitsOnTheBusAsADeviceOfItsOwn) {
  Chip chip(kLoader, kSlots);
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  DfuHost host(chip);
  ASSERT_TRUE(host.enumerate());
  const auto device = host.device();
  ASSERT_EQ(device.size(), 18U);
  EXPECT_EQ(device[10], 2) << "product 0002";
  EXPECT_EQ(host.status(), std::pair(0, 2)) << "dfuIDLE";
  EXPECT_FALSE(chip.ports[2].high(6)) << "the amplifier is held off";
  expect_no_violation(chip);
}

TEST(BoardLoader, TakesAnImageInstallsItAtTheNextStartAndStartsItUnderTheWatchdog) {
  std::vector<std::uint8_t> cells;
  const std::vector<std::uint8_t> sent = image("stm32f405-dac");
  {
    Chip chip(kLoader, kSlots);
    ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
    DfuHost host(chip);
    ASSERT_TRUE(host.enumerate());
    ASSERT_EQ(host.download(sent), 0);
    EXPECT_TRUE(std::equal(sent.begin(), sent.end(), chip.flash.bytes.begin() + kDownload));
    EXPECT_EQ(chip.ticks(100'000), Stop::reset) << "it restarts by itself";
    EXPECT_TRUE(chip.flash.locked());
    expect_room_on_stack(chip, "of a download");
    expect_no_violation(chip);
    cells = chip.flash.bytes;
  }
  Chip chip(kLoader, kSlots);
  chip.flash.bytes = cells;
  // The model's memory holds data, not code: the first instruction of the application ends the run.
  EXPECT_EQ(chip.start(), Stop::fault);
  EXPECT_EQ(chip.machine.vectors(), 0x08020200U);
  EXPECT_EQ(chip.machine.reg(UC_ARM_REG_SP), kStack);
  EXPECT_EQ(chip.machine.reg(UC_ARM_REG_PC) & ~1U, kEntry & ~1U);
  EXPECT_TRUE(std::equal(sent.begin(), sent.end(), chip.flash.bytes.begin() + kApplication));
  expect_room_on_stack(chip, "of an installation");
  chip.watchdog.pass(10.0);
  EXPECT_TRUE(chip.watchdog.bit) << "an image on trial that hangs is reset";
  expect_no_violation(chip);
}

TEST(BoardLoader, RefusesAnImageForTheOtherAmplifierAndOneThatIsDamaged) {
  Chip chip(kLoader, kSlots);
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  DfuHost host(chip);
  ASSERT_TRUE(host.enumerate());
  constexpr int kErrTarget = 1;
  EXPECT_EQ(host.download(image("stm32f405-pwm")), kErrTarget);
  EXPECT_EQ(chip.flash.erases, 0) << "what is no image for this board costs nothing";
  // The host clears the error, and sends one that was damaged on its way.
  ASSERT_TRUE(host.clear_status());
  std::vector<std::uint8_t> damaged = image("stm32f405-dac");
  damaged[5000] ^= 1;
  constexpr int kErrVerify = 7;
  EXPECT_EQ(host.download(damaged), kErrVerify);
  EXPECT_EQ(chip.ticks(20'000), Stop::waits) << "nothing is started";
  expect_no_violation(chip);
}

// A drive with an application whose counter is 2.
void install_application(Chip& chip) {
  const auto application = image("stm32f405-dac", Signature::development, 2);
  std::copy(application.begin(), application.end(), chip.flash.bytes.begin() + kApplication);
}

TEST(BoardLoader, StartsASignedApplicationKeepsItsCounterAndLeavesAQuarterOfItsStack) {
  Chip chip(kLoader, kSlots);
  install_application(chip);
  EXPECT_EQ(chip.start(), Stop::fault);
  EXPECT_EQ(chip.machine.vectors(), 0x08020200U) << "the application's";
  const std::vector<std::uint8_t> two{2, 0, 0xFD, 0xFF, 2, 0, 0xFD, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
  EXPECT_TRUE(std::equal(two.begin(), two.end(), chip.flash.bytes.begin())) << "two words of the counter";
  expect_room_on_stack(chip, "at a start");
  expect_no_violation(chip);
}

TEST(BoardLoader, AnApplicationThatIsNotSignedIsNotStarted) {
  Chip chip(kLoader, kSlots);
  install_application(chip);
  chip.flash.bytes[kApplication + boot::kHeaderBytes + 4000] ^= 1;
  EXPECT_EQ(chip.start(), Stop::waits) << "damaged";
  Chip other(kLoader, kSlots);
  const auto plain = image("stm32f405-dac", Signature::none, 2);
  std::copy(plain.begin(), plain.end(), other.flash.bytes.begin() + kApplication);
  EXPECT_EQ(other.start(), Stop::waits) << "whole, but not signed";
  EXPECT_EQ(other.flash.bytes[0], 0xFF) << "its counter does not count";
}

TEST(BoardLoader, RefusesUnsignedAndRolledBackImagesAndGivesNothingAway) {
  Chip chip(kLoader, kSlots);
  install_application(chip);
  chip.machine.set_word(kHandover, 0x4C4F4144);  // the application asked for the boot loader
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  DfuHost host(chip);
  ASSERT_TRUE(host.enumerate());
  constexpr int kErrFile = 2;
  EXPECT_EQ(host.download(image("stm32f405-dac", Signature::none, 2)), kErrFile);
  ASSERT_TRUE(host.clear_status());
  EXPECT_EQ(host.download(image("stm32f405-dac", Signature::development, 1)), kErrFile) << "a smaller counter";
  ASSERT_TRUE(host.clear_status());
  EXPECT_EQ(chip.flash.erases, 0) << "both show in the first block";
  std::vector<std::uint8_t> forged = image("stm32f405-dac", Signature::development, 2);
  boot::ImageHeader header;
  ASSERT_EQ(boot::read_image(forged, header), boot::ImageFinding::none);
  forged[6000] ^= 1;
  header.crc = model::crc32(std::span(forged).subspan(boot::kHeaderBytes));
  boot::write_header(std::span(forged).first<boot::kHeaderBytes>(), header);
  EXPECT_EQ(host.download(forged), kErrFile) << "the checksums fit, the signature does not";
  ASSERT_TRUE(host.clear_status());
  EXPECT_FALSE(host.upload()) << "no upload";
  expect_no_violation(chip);
}

}  // namespace
}  // namespace flexspline::tests
