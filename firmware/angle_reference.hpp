// Where the shafts are: which of their angles are known, and from what. An absolute encoder knows its angle, an index
// pulse gives a turn, and `home` says the rest. The control tick calls it.
#pragma once

#include <cstdint>

#include "firmware/control.hpp"
#include "firmware/messages.hpp"

namespace flexspline::firmware {

class AngleReference {
 public:
  // What the board states of its encoders.
  void begin(const control::Hardware& hardware) {
    motor_encoder_ = hardware.motor_encoder;
    output_encoder_ = hardware.output_encoder;
  }
  // Angles are searched again: parameters with another encoder or another zero.
  void forget(Control& control, Status& status) {
    searches_ = true;
    has_index_ = false;
    zero_ = {};
    set(control, status, false, false);
  }
  // A shaft may have turned without being counted. Absolute encoders give the angle once they are valid again.
  void lose(Control& control, Status& status) {
    if (motor_encoder_ == control::SensorKind::not_stated || !status.has_parameters) return;
    if (motor_encoder_ == control::SensorKind::absolute) control.begin_encoders();
    forget(control, status);
  }
  static constexpr bool is_lost_by(Fault fault) {
    return fault == Fault::motor_encoder_stale || fault == Fault::motor_encoder_jump ||
           fault == Fault::motor_encoder_stuck || fault == Fault::implausible_motion ||
           fault == Fault::encoders_disagree;
  }
  // While the drive is not armed, as a set point would refer to the old angle.
  [[gnu::noinline]] void update(Control& control, Status& status, const Readings& readings, Estimate& estimate) {
    const Parameters& parameters = control.parameters();
    const auto counts = static_cast<std::int32_t>(parameters.motor_encoder.counts);
    // Counting was interrupted.
    if (estimate.moved > counts || estimate.moved < -counts) lose(control, status);
    if (status.mode != Mode::idle) return;
    using control::SensorKind;
    index_counter_ = readings.index_counter;
    has_index_ = !searches_ && readings.index_passes != index_passes_;
    if (searches_) {
      searches_ = false;
      index_passes_ = readings.index_passes;
      // A board that does not state its encoders is a simulated one, which starts at its zero.
      const bool all = motor_encoder_ == SensorKind::not_stated;
      const bool turn = all || motor_encoder_ == SensorKind::absolute;
      const bool output = parameters.has_output_encoder && output_encoder_ == SensorKind::absolute;
      control.take_absolute(turn && !all, output);
      if (output) control.take_output(turn);
      set(control, status, turn, all || output);
      control.show_angles(estimate);
    } else if (motor_encoder_ == SensorKind::indexed && !status.knows_turn && readings.index_passes != index_passes_) {
      control.take_index(readings.index_counter);
      set(control, status, true, status.knows_output);
      control.show_angles(estimate);
    }
  }
  // The shaft, at rest and not armed, is at that angle of the motor.
  void home(Control& control, Status& status, N::Angle angle) {
    control.set_angle(angle);
    searches_ = false;
    set(control, status, true, true);
    note_zero(control);
  }
  // What the encoders show at the zeros that home() set.
  const control::StoredZero& zero() const { return zero_; }
  // Bits of the state's word: 17 the motor's turn is not known, 18 the output.
  std::uint32_t unknown_bits() const { return unknown_; }

 private:
  void set(Control& control, Status& status, bool turn, bool output) {
    status.knows_turn = turn;
    status.knows_output = output;
    unknown_ = (turn ? 0U : 1U << 17) | (output ? 0U : 1U << 18);
    control.know(turn, output);
  }
  void note_zero(const Control& control) {
    using control::SensorKind;
    const bool indexed = motor_encoder_ == SensorKind::indexed;
    const SensorKind motor = indexed && !has_index_ ? SensorKind::none : motor_encoder_;
    zero_ = control.zero_now(motor, output_encoder_, indexed ? index_counter_ : 0);
  }

  control::SensorKind motor_encoder_ = control::SensorKind::not_stated;
  control::SensorKind output_encoder_ = control::SensorKind::not_stated;
  bool searches_ = false;  // for the angles of absolute encoders
  bool has_index_ = false;
  std::uint16_t index_passes_ = 0;  // at the last search
  std::uint32_t index_counter_ = 0;
  std::uint32_t unknown_ = 0;
  control::StoredZero zero_{};
};

}  // namespace flexspline::firmware
