// The application's half of an update: it confirms itself once it has shown that it does well, and goes to the boot
// loader when a host asks for that (DFU's DETACH) while the drive is not armed.
#pragma once

#include <cstdint>

#include "firmware/faults.hpp"
#include "firmware/messages.hpp"
#include "shared/usb/dfu.hpp"

namespace flexspline::firmware {

// `Slots` is boot::Slots on the board's memory. From background work alone.
template <class Slots>
class UpdateWatch {
 public:
  // Before the first tick: reads the downloaded image where one is on trial.
  UpdateWatch(Slots& slots, std::uint32_t tick_hz) : slots_(slots), well_ticks_(2 * tick_hz) {
    on_trial_ = slots.on_trial();
  }

  // Again and again. `has_host`: one has configured the device. True: the host asked for the boot loader and has seen
  // the answer; let go of the bus, leave a note for the boot loader, reset.
  bool turn(const Status& status, bool has_host, usb::DfuRuntime& dfu) {
    const bool rests = !is_armed(status.mode);
    dfu.allow(rests);
    // Doing well: two seconds of ticks that were no longer than there was time, and a host that could reach it, as the
    // next update needs one. A drive that is armed does not wait for flash memory.
    had_host_ = had_host_ || has_host;
    const bool does_well = status.tick >= well_ticks_ && had_host_ && status.mode != Mode::boot &&
                           status.fault.fault != Fault::tick_overrun;
    if (on_trial_ && rests && does_well) on_trial_ = !slots_.confirm();
    return rests && dfu.wants_loader();
  }
  bool on_trial() const { return on_trial_; }

 private:
  Slots& slots_;
  std::uint32_t well_ticks_;
  bool on_trial_ = false;
  bool had_host_ = false;
};

}  // namespace flexspline::firmware
