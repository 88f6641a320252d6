// What the device core needs from the USB controller. The core is a template over it; a controller of a
// chip and the software port of the twin (hil/usbip) run the same core, and no call is virtual.
//
// The port calls the core back, all from one context (an interrupt or background work, not both):
//   reset()                  a bus reset ended
//   setup(bytes)             SETUP arrived on endpoint 0; pending transfers there are cancelled
//   received(number, bytes)  an OUT packet arrived on an endpoint that was ready to receive
//   sent(number)             the host took the packet of send()
//   suspended(), resumed()   no traffic for 3 ms; traffic again. A reset ends a suspension as well
#pragma once

#include <concepts>
#include <cstdint>
#include <span>

#include "shared/usb/chapter9.hpp"

namespace flexspline::usb {

// A port that can wake a sleeping host: wake() drives the resume signal (7.1.7.7: not before 5 ms of suspension, for 1
// to 15 ms; the port has to keep these times). Without it the device descriptor excludes remote wakeup, and the feature
// is refused.
template <class P>
inline constexpr bool kCanWake = requires(P port) {
  port.wake();
};

struct EndpointSetup {
  std::uint8_t address = 0;
  TransferType type = TransferType::control;
  std::uint16_t packet_bytes = 0;
};

template <class P>
concept Port = requires(P port, std::uint8_t number, std::span<const std::uint8_t> packet, EndpointSetup endpoint) {
  // When a controller has to know its new address: before the status stage of SET_ADDRESS (it then waits by itself) or
  // after it.
  { P::kAddressBeforeStatus } -> std::convertible_to<bool>;
  port.set_address(number);
  // Opens an endpoint with its toggle at DATA0, not halted, without a transfer. Endpoint 0 is open from the reset on.
  port.open(endpoint);
  port.close(number);  // by address; it does not answer any more
  // One packet, sent when the host asks, until then NAK; the port copies it. Never two at a time.
  port.send(number, packet);
  // Ready for one packet; until then NAK.
  port.receive(number);
  // By address. Answers STALL and cancels a pending transfer; on endpoint 0 the next SETUP ends it.
  // After unstall the toggle is DATA0 and no transfer is pending.
  port.stall(number);
  port.unstall(number);
};

}  // namespace flexspline::usb
