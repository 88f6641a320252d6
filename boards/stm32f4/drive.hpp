// A whole drive on one of these processors: board, application, parameters in flash, and the links to a host. main() of
// a board is run(); its tick is an interrupt of TIM1, or one that those of the current loop begin.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "boards/stm32f4/board.hpp"
#include "boards/stm32f4/handover.hpp"
#include "boards/stm32f4/signing_key.hpp"
#include "boards/stm32f4/three_phase_board.hpp"
#include "boards/stm32f4/usb_link.hpp"
#include "firmware/application.hpp"
#include "firmware/main_loop.hpp"
#include "firmware/parameter_lock.hpp"
#include "firmware/serial_link.hpp"
#include "firmware/service.hpp"
#include "firmware/update_watch.hpp"
#include "shared/boot/slots.hpp"
#include "shared/usb/device.hpp"
#include "shared/usb/identity.hpp"

extern "C" const std::uint32_t vectors[];  // of the linker script

namespace flexspline::stm32f4 {

template <class Description>
struct BoardChoice {
  using Type = DriveBoard<Description>;
};
template <class Description>
requires requires {
  Description::kStage;
}
struct BoardChoice<Description> {
  using Type = ThreePhaseBoard<Description>;
};

template <class Description>
class Drive {
 public:
  using Board = typename BoardChoice<Description>::Type;
  static constexpr bool kHasStage = requires(Board & board) { board.three_phase(); };
  using Application = firmware::Application<Board>;
  using Flash = ParameterFlash<Board, Description::kParameterSector>;
  using Store = storage::ParameterStore<Flash>;
  using Blocks = firmware::ApplicationBlocks<Application, Board::kTickHz>;
  using KeyFlash = PairingFlash<Board, Description::kPairingSector>;
  using Pairing = storage::PairingMemory<KeyFlash>;
  using Lock = firmware::ParameterLock<Pairing, Board>;
  using Service = firmware::Service<Application, Store, Blocks, Lock>;
  using Serial = typename Description::Serial;
  using UsbReports = flexspline::usb::Hid<8, 4>;
  using UsbDevice = usb::Device<usb::FlexsplineIdentity, OtgFs, UsbReports, usb::DfuRuntime>;

  constexpr Drive() = default;

  [[gnu::cold, noreturn]] void run() {
    hardware(cortex_m4::kVectorTable) = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(vectors));
    // Without a clock for the loops the drive stays in its reset state, with its amplifier off.
    if (!board_.start_clock()) stay_off();
    application_.begin(board_);
    static char serial[13];
    serial_number(serial);
    static Flash flash(board_);
    static Store store(flash);
    static Blocks blocks(application_);
    static KeyFlash key_flash(board_);
    static Pairing pairing(key_flash);
    static Lock lock(pairing, board_);
    static Service service(application_, store, blocks, Board::kTickHz,
                           firmware::DriveInfo::of({0, 1}, Description::kName, {serial, 12},
                                                   Description::kHasUsb ? kFirmwareKey : protocol::FirmwareKey::none),
                           lock);
    service.start();
#ifdef FLEXSPLINE_FORGET_PAIRING
    // For a drive whose key is lost: an image that ends the pairing, which its boot loader takes where it is signed.
    if (pairing.is_paired()) static_cast<void>(pairing.remove());
#endif
    line_.start(Description::kClock.core_hz / 4, Description::kBaud);
    using SerialLink = firmware::SerialLink<Service, Serial>;
    static SerialLink serial_link(service, line_);
    if constexpr (Description::kHasUsb) {
      static OtgFs port;
      // The internal oscillator is not accurate enough for USB: the host would reject the device. The serial line
      // works.
      const bool usb =
          board_.clock_is_exact() && port.start(Description::kClock.core_hz, senses_usb_power<Description>());
      static UsbDevice device(port, serial);
      using ImageMemory = typename Description::template Images<Board>;
      static ImageMemory images(board_);
      static boot::Slots<ImageMemory> slots(images, Description::kName);
      static firmware::UpdateWatch<boot::Slots<ImageMemory>> update(slots, Board::kTickHz);
      using Usb = UsbLink<Service, OtgFs, UsbDevice, UsbReports>;
      static Usb usb_link(service, port, device, usb);
      firmware::MainLoop<Application, Service, Usb, SerialLink> drive(application_, service, usb_link, serial_link);
      board_.start_tick();
      for (;;) {
        drive.poll();
        if (update.poll(application_.snapshot(), device.configured(), device.template get<usb::DfuRuntime>())) {
          port.stop();
          request_loader();
          cortex_m4::reset_processor();
        }
        wait_for_interrupt();
      }
    } else {
      firmware::MainLoop<Application, Service, SerialLink> drive(application_, service, serial_link);
      board_.start_tick();
      for (;;) {
        drive.poll();
        wait_for_interrupt();
      }
    }
  }
  // The interrupt handler.
  void tick() {
    application_.tick();
    board_.end_tick();
    if constexpr (!kHasStage) line_.move();
  }
  // Of a board with three half bridges. A tick is too slow for the line there.
  void period() {
    board_.period();
  }
  void watch() {
    board_.watch();
    line_.move();
  }

 private:
  static void wait_for_interrupt() {
    asm volatile("wfi");
  }
  [[noreturn]] static void stay_off() {
    for (;;) wait_for_interrupt();
  }

  Board board_{};
  Application application_{};
  Serial line_{};
};

}  // namespace flexspline::stm32f4
