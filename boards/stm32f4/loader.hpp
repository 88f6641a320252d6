// The boot loader on one of these processors (firmware/boot_loader.hpp). main() of its image is run(); its clock is
// SysTick.
#pragma once

#include <cstdint>
#include <string_view>

#include "boards/stm32f4/board.hpp"
#include "boards/stm32f4/brown_out.hpp"
#include "boards/stm32f4/handover.hpp"
#include "boards/stm32f4/signing_key.hpp"
#include "firmware/boot_loader.hpp"
#include "shared/usb/device.hpp"
#include "shared/usb/identity.hpp"

namespace flexspline::stm32f4 {

template <class Description>
class Loader {
 public:
  [[noreturn]] void run() {
    set_up(Description::kPins);  // the amplifier is held off
    const ClockSource source = Clock::start(Description::kClock);
    set_brown_out_level();
    static Board board;
    static firmware::BootLoader<Board> loader(board);
    const boot::Start start = loader.start();
    if (start != boot::Start::none) {
      // An image on trial may hang before it starts its own watchdog, so the watchdog is started here with its longest
      // limit.
      if (start == boot::Start::trial) board.watchdog.start();
      jump_to(sector_address(Description::kApplicationSector) + boot::kHeaderBytes);
    }
    static char serial[13];
    serial_number(serial);
    static OtgFs port;
    using Dfu = typename firmware::BootLoader<Board>::Dfu;
    static usb::Device<usb::LoaderIdentity, OtgFs, Dfu> device(port, serial);
    loader.serve(device.template get<Dfu>());
    // Without a crystal there is no USB: a debugger is needed.
    const bool usb =
        source == ClockSource::crystal && port.start(Description::kClock.core_hz, senses_usb_power<Description>());
    hardware(kSysTickReload) = Description::kClock.core_hz / kTickHz - 1;
    hardware(kSysTick) = 7;
    for (;;) {
      if (usb) port.poll(device);
      device.poll();
      if (loader.poll(device.template get<Dfu>(), port.was_reset(), ticks_ / (kTickHz / 1000))) {
        port.stop();
        cortex_m4::reset_processor();
      }
      board.flash_works();
      asm volatile("wfi");
    }
  }
  // The interrupt handler.
  void tick() { ticks_ = ticks_ + 1; }

 private:
  static constexpr std::uint32_t kSysTick = 0xE000E010, kSysTickReload = 0xE000E014, kTickHz = 8'000;

  struct Board {
    static constexpr std::string_view kName = Description::kName;
    using Slots = typename Description::template Images<Board>;
    using Trust = boot::SignedBy<kSigningKey>;
    static constexpr bool kCanUpload = stm32f4::kCanUpload;
    // RM0090 and the data sheet: 2 s for 128 KB, 100 us a word. A check of 96 KB takes 20 million instructions.
    static constexpr std::uint32_t kEraseMs = 2'200, kBlockMs = 30, kCheckMs = 400;
    Slots& slots() { return images; }
    bool takes_loader_request() { return loader_is_requested(); }
    // Called before and after each operation: feeds the watchdog if it runs.
    void flash_works() { watchdog.feed(false); }

    IndependentWatchdog<20'000> watchdog{};
    Slots images{*this};
  };
  [[noreturn]] static void jump_to(std::uint32_t vectors) {
    hardware(cortex_m4::kVectorTable) = vectors;
    const std::uint32_t stack = hardware(vectors), entry = hardware(vectors + 4);
    asm volatile("msr msp, %0 \n bx %1" ::"r"(stack), "r"(entry));
    __builtin_unreachable();
  }

  volatile std::uint32_t ticks_ = 0;
};

}  // namespace flexspline::stm32f4
