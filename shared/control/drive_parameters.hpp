// All numbers that a drive's tick computes with, apart from what it remembers from tick to tick. Made on the host from
// SI units (drive_parameters_setup.hpp), changed as a whole or not at all.
#pragma once

#include <cstdint>

#include "shared/control/excitation.hpp"
#include "shared/control/feedforward.hpp"
#include "shared/control/loops.hpp"
#include "shared/control/residual_map.hpp"
#include "shared/control/stream.hpp"
#include "shared/control/trajectory.hpp"
#include "shared/model/drive_model.hpp"
#include "shared/observers/disturbance.hpp"
#include "shared/observers/encoder_angle.hpp"
#include "shared/observers/encoder_kalman.hpp"
#include "shared/observers/ripple_filter.hpp"
#include "shared/observers/torsion.hpp"

namespace flexspline::control {

// An analogue sensor gives a share of its full scale, 2^-15; value = gain share - offset, in the base of the signal.
// Readings at `lowest` or below and `highest` or above are those of a broken wire or an amplifier at its rail.
template <class N>
struct AnalogScale {
  typename N::Gain gain{};
  typename N::Value offset{};
  std::int16_t lowest = 0;
  std::int16_t highest = 0;
};

// Above (or, for times, beyond) which the drive stops by itself; firmware/faults.hpp says what happens then.
template <class N>
struct SafetyLimits {
  typename N::Value overspeed{};         // measured velocity
  typename N::Value overcurrent{};       // measured current
  typename N::Value overtemperature{};   // measured
  typename N::Value acceleration{};      // estimated: faster than any torque can make it, so the encoder is wrong
  typename N::Value stuck_torque{};      // torque commanded may change by this much without a count of motion
  typename N::Value current_mismatch{};  // between commanded and measured current
  typename N::Value standstill{};        // velocity below which the drive counts as at rest
  std::int32_t counts_a_tick = 0;        // most that the motor's encoder can move
  std::uint32_t host_ticks = 0;          // without a command, while armed
  std::uint32_t stop_ticks = 0;          // that a controlled stop may take
  std::uint16_t stuck_ticks = 0;         // over which the torque may change as said above
  std::uint16_t mismatch_ticks = 0;
  std::uint16_t torque_same_ticks = 0;  // the torque sensor's noise changes its reading within these; nought: no sensor
};

// How far motor and output may be from where they have to be. All nought in a block that does not state them: then it
// is not watched.
template <class N>
struct FollowingLimits {
  std::int64_t position = 0;       // mode position: of the motor behind its set point, 2^-32 turns
  typename N::Value velocity{};    // mode velocity: the same
  std::int32_t motor_counts = 0;   // that the motor may turn ...
  std::int32_t output_counts = 0;  // ... while the output's encoder moves by less than this
  std::uint16_t ticks = 0;         // that the motor may be behind for
};

template <class N>
struct DriveSettings {
  std::uint32_t tick_hz = 0;
  bool has_output_encoder = false;
  bool has_torque_sensor = false;
  bool excites_torque = false;  // else the excitation is a velocity
  observers::EncoderAngle::Coefficients motor_encoder{};
  observers::EncoderAngle::Coefficients output_encoder{};
  observers::EncoderKalman::Coefficients<N> motor_motion{};
  observers::EncoderKalman::Coefficients<N> output_motion{};
  observers::DisturbanceObserver::Coefficients<N> disturbance{};
  // Without an encoder at the output.
  observers::TorsionObserver::Coefficients<N> torsion{};
  typename N::Order output_angle{};       // of the motor's
  typename N::Gain torsion_turns{};       // turns of the output per base of torsion
  typename N::Gain output_of_velocity{};  // base of the output's velocity per base of the motor's
  observers::RippleFilter::Coefficients<N> ripple{};
  AnalogScale<N> current{};
  AnalogScale<N> torque{};
  AnalogScale<N> temperature{};
  typename N::Gain torque_of_current{};
  typename N::Gain amplifier{};  // from a current in bases to a share of the amplifier's full scale
  Loops::Coefficients<N> loops{};
  Trajectory::Coefficients<N> trajectory{};
  Stream::Coefficients stream{};
  Feedforward::Coefficients<N> feedforward{};
  Excitation::Coefficients<N> excitation{};
  SafetyLimits<N> safety{};
  FollowingLimits<N> following{};
  ResidualMap::Coefficients residual_map{};
};

template <class N>
struct DriveParameters : DriveSettings<N> {
  model::DriveModel<N, model::EveryFormula> model{};
};

}  // namespace flexspline::control
