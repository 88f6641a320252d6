// What goes between a host and the application: commands, answers, and the drive's state. Plain structs; how they
// travel is the business of a protocol.
#pragma once

#include <cstdint>

#include "firmware/faults.hpp"
#include "shared/fixed/system.hpp"

namespace flexspline::firmware {

using N = fixed::Fixed;

enum class Mode : std::uint8_t {
  boot,        // sensors are looked at; amplifier off
  idle,        // amplifier off; parameters may change
  current,     // armed: a current
  velocity,    // armed: a velocity, with limits of acceleration
  position,    // armed: a position, with limits of velocity and acceleration
  excitation,  // armed: the excitation of the parameters
  stop,        // armed: comes to rest by itself, then fault
  fault,       // amplifier off until cleared
};
constexpr bool is_armed(Mode mode) {
  return mode >= Mode::current && mode <= Mode::stop;
}
constexpr bool may_be_commanded(Mode mode) {
  return mode >= Mode::current && mode <= Mode::excitation;
}

struct Command {
  enum class Kind : std::uint8_t {
    heartbeat,    // the host is there
    arm,          // idle to the armed mode `mode`; from one armed mode to another
    set,          // a new set point for `mode`, which has to be the present one
    disarm,       // to idle, amplifier off at once
    clear_fault,  // fault to boot, and to idle where the cause is gone
    start_map,    // residuals count from here on, in any mode in which the model's torque is fed forward
    stop_map,
    clear_map,  // while the drive is not armed, as it takes as long as a tick
    home,       // the shaft, at rest and not armed, stands at `position`
  };
  Kind kind = Kind::heartbeat;
  Mode mode = Mode::boot;
  bool compensate = false;   // feedforward of the model in modes velocity and position; from `arm` on
  bool stream = false;       // mode position: not a target, but where the shaft shall be now, and how it goes on
  std::uint16_t number = 0;  // comes back with the answer
  N::Angle position{};       // of the motor
  N::Value velocity{};       // set point, or how fast to go to a target (nought: as fast as the limits allow)
  N::Value acceleration{};   // of a stream
  N::Value current{};
};

enum class Refusal : std::uint8_t {
  none,
  armed,          // only an idle drive can do that
  not_armed,      // there is no set point to set
  other_mode,     // the set point is for another mode
  no_mode,        // that is not a mode that a drive can be commanded into
  moving,         // the shaft has to be at rest
  no_parameters,  // no valid block was committed
  no_excitation,  // the parameters hold none
  fault,          // clear it first
  booting,
};
struct Answer {
  std::uint16_t number = 0;
  Refusal refusal = Refusal::none;
  Mode mode = Mode::boot;  // after the command
};

// The state of the drive at the end of a tick.
struct Status {
  std::uint32_t tick = 0;
  Mode mode = Mode::boot;
  bool has_parameters = false;
  bool maps_residual = false;
  // Where a turn of the motor stands, and where the output (and so how many turns the motor is from its zero).
  bool knows_turn = false;
  bool knows_output = false;
  FaultRecord fault{};  // the one that the drive stands in, or the last one
};

// A bin of the residual map, which is asked for by its number (Application::map_bin): velocity bin times 32 and the bin
// of the motor's angle. Sums count in units of the map (shared/control/residual_map.hpp): 511 are the largest residual.
struct MapBin {
  std::uint16_t number = 0;
  std::uint16_t count = 0;  // of ticks; halved with both sums where it is full
  std::int32_t sum = 0;
  std::uint32_t squares = 0;
};

}  // namespace flexspline::firmware
