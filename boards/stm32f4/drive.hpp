// A whole drive on one of these processors: board, application, parameters in flash, and the links to a host. main() of
// a board is run(); its tick is the converter's interrupt.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "boards/stm32f4/board.hpp"
#include "boards/stm32f4/handover.hpp"
#include "firmware/application.hpp"
#include "firmware/report_link.hpp"
#include "firmware/serial_link.hpp"
#include "firmware/service.hpp"
#include "firmware/update_watch.hpp"
#include "shared/boot/slots.hpp"
#include "shared/usb/device.hpp"
#include "shared/usb/hid.hpp"
#include "shared/usb/identity.hpp"

extern "C" const std::uint32_t vectors[];  // of the linker script

namespace flexspline::stm32f4 {

template <class Description>
class Drive {
 public:
  using Board = DriveBoard<Description>;
  using Application = firmware::Application<Board>;
  using Flash = ParameterFlash<Board, Description::kParameterSector>;
  using Store = storage::ParameterStore<Flash>;
  using Blocks = firmware::ApplicationBlocks<Application, Board::kTickHz>;
  using Service = firmware::Service<Application, Store, Blocks>;
  using Serial = typename Description::Serial;

  constexpr Drive() = default;

  [[gnu::cold, noreturn]] void run() {
    hardware(cortex_m4::kVectorTable) = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(vectors));
    // Without a clock for the loops the drive stays as reset left it, with its amplifier off.
    if (!board_.start_clock()) stay_off();
    application_.begin(board_);
    static char serial[13];
    serial_number(serial);
    static Flash flash(board_);
    static Store store(flash);
    static Blocks blocks(application_);
    static Service service(application_, store, blocks, Board::kTickHz, info(serial));
    service.start();
    line_.start(Description::kClock.core_hz / 4, Description::kBaud);
    static firmware::SerialLink<Service, Serial> serial_link(service, line_);
    if constexpr (Description::kHasUsb) {
      static OtgFs port;
      // An internal oscillator is too far off for USB: the host would give up on the device. The serial line does.
      const bool usb = board_.clock_is_exact() && port.start(Description::kClock.core_hz);
      using Reports = flexspline::usb::Hid<8, 4>;
      static usb::Device<usb::FlexsplineIdentity, OtgFs, Reports, usb::DfuRuntime> device(port, serial);
      using ImageMemory = typename Description::template Images<Board>;
      static ImageMemory images(board_);
      static boot::Slots<ImageMemory> slots(images, Description::kName);
      static firmware::UpdateWatch<boot::Slots<ImageMemory>> update(slots, Board::kTickHz);
      static firmware::ReportLink<Service, Reports> report_link(service, device.template get<Reports>());
      board_.start_tick();
      for (;;) {
        if (usb) {
          port.poll(device);
          report_link.turn(device.configured());
          device.poll();
        }
        if (!device.configured()) serial_link.turn();
        if (update.turn(application_.snapshot(), device.configured(), device.template get<usb::DfuRuntime>())) {
          port.stop();
          ask_for_loader();
          cortex_m4::reset_processor();
        }
        turn(service);
      }
    } else {
      board_.start_tick();
      for (;;) {
        serial_link.turn();
        turn(service);
      }
    }
  }
  // The interrupt.
  void tick() {
    application_.tick();
    line_.move();
  }

 private:
  void turn(Service& service) {
    application_.background();
    service.background();
    asm volatile("wfi");
  }
  [[noreturn]] static void stay_off() {
    for (;;) asm volatile("wfi");
  }
  static firmware::DriveInfo info(const char (&serial)[13]) {
    firmware::DriveInfo out{.firmware = {0, 1}};
    for (std::size_t i = 0; i < Description::kName.size() && i + 1 < out.board.size(); ++i)
      out.board[i] = static_cast<std::uint8_t>(Description::kName[i]);
    for (std::size_t i = 0; i < 12; ++i) out.serial[i] = static_cast<std::uint8_t>(serial[i]);
    return out;
  }

  Board board_{};
  Application application_{};
  Serial line_{};
};

}  // namespace flexspline::stm32f4
