// The application's part of an update: it confirms itself once it has run correctly for a while, and starts the boot
// loader when a host requests that (DFU's DETACH) while the drive is not armed.
#pragma once

#include <cstdint>

#include "firmware/faults.hpp"
#include "firmware/messages.hpp"
#include "shared/usb/dfu.hpp"

namespace flexspline::firmware {

// `Slots` is boot::Slots on the board's memory. For background work only.
template <class Slots>
class UpdateWatch {
 public:
  // Before the first tick: reads the downloaded image where one is on trial.
  UpdateWatch(Slots& slots, std::uint32_t tick_hz) : slots_(slots), confirm_ticks_(2 * tick_hz) {
    on_trial_ = slots.on_trial();
  }

  // Call repeatedly. `has_host`: a host has configured the device. True: the host requested the boot loader and has the
  // answer; disconnect from the bus, leave a request for the boot loader, reset.
  bool poll(const Status& status, bool has_host, usb::DfuRuntime& dfu) {
    const bool rests = !is_live(status.mode);
    dfu.allow(rests);
    // Correct means: two seconds of ticks without overrun, and a host that configured the device, as the next update
    // needs one. An armed drive does not wait for flash memory. The last fault does not show an overrun: a drive that
    // is in another one keeps that.
    had_host_ = had_host_ || has_host;
    if (status.overruns != overruns_) {
      overruns_ = status.overruns;
      last_overrun_ = status.tick;
    }
    const bool does_well = status.tick - last_overrun_ >= confirm_ticks_ && had_host_ && status.mode != Mode::boot;
    if (on_trial_ && rests && does_well) on_trial_ = !slots_.confirm();
    return rests && dfu.wants_loader();
  }
  bool on_trial() const { return on_trial_; }

 private:
  Slots& slots_;
  std::uint32_t confirm_ticks_;
  std::uint32_t last_overrun_ = 0;  // tick, as background work saw it
  std::uint16_t overruns_ = 0;
  bool on_trial_ = false;
  bool had_host_ = false;
};

}  // namespace flexspline::firmware
