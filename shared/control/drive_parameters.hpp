// All parameters of a drive's tick. The host makes them from SI units (drive_parameters_setup.hpp); they are changed as
// a whole or not at all.
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

// The velocity of the output and the disturbance, which no loop needs, are estimated at every eighth tick: their
// observers are derived for a time base of so many ticks, and the lead of the feedforward for kLeadTicks. A block that
// does not state this has all of them derived for every tick.
inline constexpr std::uint32_t kSlowTicks = 8;
template <class P>
constexpr effects::DriveConstants<P> slow(effects::DriveConstants<P> d) {
  d.time_base = P(static_cast<double>(kSlowTicks)) * d.time_base;
  return d;
}

// An analogue sensor gives a share of its full scale, 2^-15; value = gain share - offset, in the base of the signal.
// Readings at `lowest` or below and at `highest` or above mean a broken wire or an amplifier at its rail.
template <class N>
struct AnalogScale {
  typename N::Gain gain{};
  typename N::Value offset{};
  std::int16_t lowest = 0;
  std::int16_t highest = 0;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(gain), c(offset), c.share_of_converter(lowest), c.share_of_converter(highest);
  }
};

// Limits above (or times after) which the drive stops by itself; firmware/faults.hpp says how.
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
  std::uint16_t torque_same_ticks = 0;  // the torque sensor's noise changes its reading within these; zero: no sensor
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.positive(overspeed), c.positive(overcurrent), c.positive(overtemperature), c.positive(acceleration);
    c.positive(stuck_torque), c.positive(current_mismatch), c.positive(standstill);
    c.ticks(counts_a_tick), c.ticks(host_ticks), c.ticks(stop_ticks);
    c.short_ticks(stuck_ticks), c.short_ticks(mismatch_ticks), c.short_ticks_or_none(torque_same_ticks);
  }
};

// Limits of the following errors of motor and output. All zero in a block that does not state them: they are not
// checked then.
template <class N>
struct FollowingLimits {
  std::int64_t position = 0;       // mode position: of the motor behind its set point, 2^-32 turns
  typename N::Value velocity{};    // mode velocity: the same
  std::int32_t motor_counts = 0;   // that the motor may turn ...
  std::int32_t output_counts = 0;  // ... while the output's encoder moves by less than this
  std::uint16_t ticks = 0;         // that the motor may be behind for
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.speed(position), c.positive(velocity), c.ticks_or_none(motor_counts), c.ticks_or_none(output_counts);
    c.short_ticks(ticks);
  }
};

// Where the zeros of the shafts are in the readings of their encoders, in counts within a turn: of an absolute encoder
// its own angle, of an incremental one the count from its index pulse. It holds for encoders of these counts and kinds
// (SensorKind), as they were mounted. Zero counts: none is stored, and an encoder's own zero is the shaft's.
struct StoredZero {
  struct Place {
    std::uint32_t counts = 0;  // a turn
    std::uint32_t reading = 0;
    std::uint32_t kind = 0;
    bool operator==(const Place&) const = default;
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.ticks_or_none(counts), c.ticks_or_none(reading), c.ticks_or_none(kind);
    }
  };
  Place motor{};
  Place output{};
  bool operator==(const StoredZero&) const = default;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(motor), c(output);
  }
};

// Settings that are one section of a parameter block.
struct GeneralSettings {
  std::uint32_t tick_hz = 0;
  bool has_output_encoder = false;
  bool has_torque_sensor = false;
  bool excites_torque = false;  // else the excitation is a velocity
  template <class Codec>
  constexpr void fields(Codec& c) {
    c.tick_rate(tick_hz), c(has_output_encoder), c(has_torque_sensor), c(excites_torque);
  }
};
struct RateSettings {
  bool has_slow_rates = false;
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(has_slow_rates);
  }
};
// Without an encoder at the output.
template <class N>
struct TorsionSettings {
  observers::TorsionObserver::Coefficients<N> torsion{};
  typename N::Order output_angle{};       // of the motor's
  typename N::Gain torsion_turns{};       // turns of the output per base of torsion
  typename N::Gain output_of_velocity{};  // base of the output's velocity per base of the motor's
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(torsion), c(output_angle), c(torsion_turns), c(output_of_velocity);
  }
};
template <class N>
struct SensorSettings {
  AnalogScale<N> current{};
  AnalogScale<N> torque{};
  AnalogScale<N> temperature{};
  typename N::Gain torque_of_current{};
  typename N::Gain amplifier{};  // from a current in bases to a share of the amplifier's full scale
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(current), c(torque), c(temperature), c(torque_of_current), c(amplifier);
  }
};
template <class N>
struct SetPointSettings {
  Trajectory::Coefficients<N> trajectory{};
  Stream::Coefficients stream{};
  template <class Codec>
  constexpr void fields(Codec& c) {
    c(trajectory), c(stream);
  }
};

template <class N>
struct DriveSettings : GeneralSettings, RateSettings, TorsionSettings<N>, SensorSettings<N>, SetPointSettings<N> {
  observers::EncoderAngle::Coefficients motor_encoder{};
  observers::EncoderAngle::Coefficients output_encoder{};
  observers::EncoderKalman::Coefficients<N> motor_motion{};
  observers::EncoderKalman::Coefficients<N> output_motion{};
  observers::DisturbanceObserver::Coefficients<N> disturbance{};
  observers::RippleFilter::Coefficients<N> ripple{};
  Loops::Coefficients<N> loops{};
  Feedforward::Coefficients<N> feedforward{};
  Excitation::Coefficients<N> excitation{};
  SafetyLimits<N> safety{};
  FollowingLimits<N> following{};
  ResidualMap::Coefficients residual_map{};
  StoredZero zero{};
};

template <class N>
struct DriveParameters : DriveSettings<N> {
  model::DriveModel<N, model::ImageEffects> model{};
};

}  // namespace flexspline::control
