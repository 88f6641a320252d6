// The board type for the application's template (firmware/board.hpp), made from the description of a board. A
// description has: kClock, kPins, kAnalog, kHardware, kParameterSector, kPairingSector, kMotorReversed,
// kOutputReversed, kName, and types MotorEncoder, OutputEncoder, Amplifier, Serial and Usb (NoUsb where there is none).
// One with three half bridges of its own: three_phase_board.hpp.
#pragma once

#include <cstdint>

#include "boards/stm32f4/amplifier.hpp"
#include "boards/stm32f4/analog.hpp"
#include "boards/stm32f4/core_board.hpp"
#include "boards/stm32f4/encoder.hpp"
#include "boards/stm32f4/flash.hpp"
#include "boards/stm32f4/otg_fs.hpp"
#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/usart.hpp"
#include "firmware/board.hpp"

namespace flexspline::stm32f4 {

template <class Description>
class DriveBoard : public CoreBoard<Description, 20'000> {
  using Core = CoreBoard<Description, 20'000>;

 public:
  // The control tick starts here.
  void start_tick() {
    static_assert(are_analog(Description::kPins, Description::kAnalog.current, Description::kAnalog.torque,
                             Description::kAnalog.temperature),
                  "kPins has no analog pin for an input of kAnalog: boards/PORTING.md, step 6");
    Analog::start(Description::kAnalog);
    motor_.start(Description::kMotorReversed);
    output_.start(Description::kOutputReversed);
    amplifier_.start(Description::kClock.core_hz / Core::kTickHz / 2);
  }

  // Called from the tick.

  const firmware::Readings& read() {
    tim1::take_tick();
    if (Analog::ended()) {
      Analog::take();
      readings_.current = bipolar_share(Analog::result(0), Description::kAnalog.current_falls);
      readings_.torque = bipolar_share(Analog::result(1), Description::kAnalog.torque_falls);
      readings_.temperature = unipolar_share(Analog::result(2));
      ++readings_.analog_samples;
    }
    if (motor_.take(readings_.motor_counter)) ++readings_.motor_samples;
    if (output_.take(readings_.output_counter)) ++readings_.output_samples;
    if constexpr (requires { motor_.take_index(readings_.index_counter); })
      if (motor_.take_index(readings_.index_counter)) ++readings_.index_passes;
    return readings_;
  }
  // After the tick.
  void end_tick() {
    Core::end_tick_of(motor_);
    Core::end_tick_of(output_);
  }
  void actuate(const firmware::Actuation& command) {
    amplifier_.actuate(command, readings_.current);
    Core::note_enabled(command.enabled);
  }
  bool amplifier_tripped() const { return amplifier_.tripped(); }
  // The next tick is due already.
  bool tick_overrun() { return !Core::was_delayed() && tim1::tick_is_due(); }

 private:
  typename Description::MotorEncoder motor_{};
  typename Description::OutputEncoder output_{};
  typename Description::Amplifier amplifier_{};
  firmware::Readings readings_{};
};

}  // namespace flexspline::stm32f4
