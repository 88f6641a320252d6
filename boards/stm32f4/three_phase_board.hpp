// The board type for the application's template (firmware/board.hpp) with three half bridges of its own: the firmware's
// three-phase stage is its amplifier. Three interrupts:
//   period()   at the end of the conversions, once a PWM period, highest priority: the current loop
//   watch()    at the trigger of the conversions, likewise: whether the current loop still comes; the serial line
//   tick       every second period, lowest priority, begun by period(): the application
// A description has besides what board.hpp says: kStage, kStageParts, Bridge instead of Amplifier, and
// Brake where that is one of the parts.
#pragma once

#include <cstdint>

#include "boards/stm32f4/core_board.hpp"
#include "boards/stm32f4/encoder.hpp"
#include "boards/stm32f4/flash.hpp"
#include "boards/stm32f4/otg_fs.hpp"
#include "boards/stm32f4/pins.hpp"
#include "boards/stm32f4/three_phase_analog.hpp"
#include "boards/stm32f4/three_phase_bridge.hpp"
#include "boards/stm32f4/usart.hpp"
#include "firmware/three_phase.hpp"
#include "shared/control/protection/thermistor.hpp"

namespace flexspline::stm32f4 {

template <class Description>
class ThreePhaseBoard : public CoreBoard<Description, 10'000> {
  using Core = CoreBoard<Description, 10'000>;

 public:
  static constexpr std::uint32_t kPwmHz = 20'000, kPeriods = kPwmHz / Core::kTickHz;
  static_assert(Description::kStage.pwm_hz == kPwmHz &&
                Description::kStage.timer_counts ==
                    static_cast<std::int32_t>(Description::kClock.core_hz / kPwmHz / 2));
  using Stage = firmware::ThreePhaseStageOf<Description::kStageParts>;

  // As every board, and the stage: a block in flash sets its motor before the first tick.
  bool start_clock() {
    stage_.begin(Description::kStage);
    return Core::start_clock();
  }
  // The PWM starts here, with all switches open, and with it the tick.
  void start_tick() {
    constexpr const ThreePhaseInputs& in = Description::kAnalog;
    static_assert(are_analog(Description::kPins, in.currents[0], in.currents[1], in.bus, in.temperature) &&
                      (in.two_currents || are_analog(Description::kPins, in.currents[2])),
                  "kPins has no analog pin for an input of kAnalog: boards/PORTING.md, three half bridges");
    cortex_m4::set_tick_priority();
    motor_.start(Description::kMotorReversed);
    output_.start(Description::kOutputReversed);
    if constexpr (Description::kStageParts.brake) Description::Brake::start();
    ThreePhaseAnalog::start(Description::kAnalog);
    bridge_.start(Description::kClock.core_hz / kPwmHz / 2);
  }
  Stage* three_phase() { return &stage_; }

  // Interrupts.

  void period() {
    ThreePhaseAnalog::take();
    missed_ = 0;
    typename Stage::Inputs in;
    in.readings.a = current(kAdc1);
    in.readings.b = current(kAdc2);
    if constexpr (!Description::kAnalog.two_currents) in.readings.c = current(kAdc3);
    in.bus = share(ThreePhaseAnalog::result(kAdc1, 1));
    in.temperature = temperature_ = share(ThreePhaseAnalog::result(kAdc2, 1));
    if (sampled()) ++motor_samples_;
    in.counter = counter_;
    in.driver_fault = bridge_.is_faulty();
    const bool measures = stage_.commissions();
    const typename Stage::Outputs out = stage_.update(in);
    if (out.enabled) {
      bridge_.set(out.counts);
      bridge_.on();
    } else {
      bridge_.off();
      if (out.clears_driver) bridge_.clear();
    }
    if constexpr (Description::kStageParts.brake) Description::Brake::set(out.brake);
    // Late: the bottom has passed, or the next trigger, after which the timer counts down again. What ends a step of
    // commissioning may take longer: the voltage before stands for another period.
    if ((bridge_.is_late() || tim1::tick_is_due()) && !measures) late_periods_ = late_periods_ + 1;
    if (++samples_ % kPeriods == 0) cortex_m4::request_tick();
  }
  void watch() {
    tim1::take_tick();
    if (missed_ < kMostMissed) {
      ++missed_;
      return;
    }
    // The converters do not answer: nothing controls the current, and the application gets no new samples.
    bridge_.off();
    if constexpr (Description::kStageParts.brake) Description::Brake::set(0);
    if (++dead_periods_ % kPeriods == 0) cortex_m4::request_tick();
  }

  // Called from the tick.

  const firmware::Readings& read() {
    readings_.analog_samples = static_cast<std::uint16_t>(samples_);
    readings_.current = stage_.current();
    readings_.motor_counter = counter_;
    readings_.motor_samples = static_cast<std::uint16_t>(motor_samples_);
    const std::int32_t reading = temperature_;
    // In 2^-7 degrees Celsius.
    if constexpr (Description::kStageParts.thermistor)
      readings_.temperature =
          static_cast<std::int16_t>(control::protection::celsius(Description::kStage.protection.thermistor, reading));
    if (output_.take(readings_.output_counter)) ++readings_.output_samples;
    if constexpr (requires { motor_.take_index(readings_.index_counter); })
      if (motor_.take_index(readings_.index_counter)) ++readings_.index_passes;
    return readings_;
  }
  void end_tick() { Core::end_tick_of(output_); }
  void actuate(const firmware::Actuation& command) {
    stage_.command(command);
    Core::note_enabled(command.enabled || stage_.commissions());
  }
  bool amplifier_tripped() const { return stage_.tripped(); }
  protocol::StageFault amplifier_fault() const { return stage_.fault(); }
  // The next tick is due already, or a current loop since the last tick did not end within its half of a period.
  bool tick_overrun() {
    const std::uint32_t late = late_periods_;
    const bool was_late = late != late_before_;
    late_before_ = late;
    return !Core::was_delayed() && (was_late || cortex_m4::tick_is_requested());
  }

 private:
  static constexpr std::uint32_t kMostMissed = 2;

  bool sampled() {
    if constexpr (requires { motor_.take_one(counter_); }) {
      return motor_.take_one(counter_);
    } else {
      return motor_.take(counter_);
    }
  }

  static std::int32_t current(std::uint32_t converter) {
    return bipolar_share(ThreePhaseAnalog::result(converter, 0), Description::kAnalog.currents_fall);
  }
  static std::int32_t share(std::uint32_t raw) { return static_cast<std::int32_t>((raw << 3) | (raw >> 9)); }

  typename Description::MotorEncoder motor_{};
  typename Description::OutputEncoder output_{};
  typename Description::Bridge bridge_{};
  firmware::Readings readings_{};
  // Of the current loop; the tick reads them.
  volatile std::uint32_t samples_ = 0;
  volatile std::uint32_t motor_samples_ = 0;
  volatile std::int32_t temperature_ = 0;
  volatile std::uint32_t late_periods_ = 0;
  std::uint32_t late_before_ = 0;  // at the last tick
  std::uint32_t counter_ = 0;
  std::uint32_t missed_ = 0;
  std::uint32_t dead_periods_ = 0;
  // By itself, as its first values are not zero: with them the whole drive would take flash memory.
  static inline constinit Stage stage_{};
};

}  // namespace flexspline::stm32f4
