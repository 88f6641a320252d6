#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "firmware/board.hpp"
#include "hil/board/three_phase.hpp"
#include "hil/plant/normal.hpp"
#include "hil/plant/parameters.hpp"
#include "hil/plant/physics.hpp"
#include "hil/plant/two_mass.hpp"

namespace flexspline::board {

/// Failures that can be injected while the drive runs.
enum class Injection {
  motor_encoder_stale,  ///< no new sample: count and sample number do not change
  output_encoder_stale,
  analog_stale,
  motor_encoder_stuck,    ///< samples arrive, the count does not change
  output_encoder_stuck,   ///< the same of the output
  motor_encoder_jump,     ///< the count is off by a quarter of a turn
  encoder_line_lost,      ///< one of the motor encoder's two lines: the count alternates by one
  output_line_lost,       ///< the same of the output
  motor_encoder_swapped,  ///< the motor's count runs the other way from here on
  motor_encoder_slips,    ///< the coupling of the motor's encoder: half of the motion reaches it
  output_encoder_slips,   ///< the same of the output
  current_out_of_range,   ///< the converter's input is open
  torque_out_of_range,
  temperature_out_of_range,
  torque_stuck,    ///< the torque's reading does not change
  amplifier_dead,  ///< no current flows, for any command
  current_surge,   ///< 2 A above the amplifier's largest current flow, and are measured
  tick_overrun,    ///< each tick takes longer than its period
  // Of a three-phase power stage.
  phase_lost,
  phases_shorted,
  phase_grounded,
  bus_collapse,
  driver_fault,
  thermistor_open,
  thermistor_shorted,
  brake_missing,  ///< no brake resistor: what the motor gives back stays in the bus
};

/// Full scales of the analogue inputs and of the amplifier; a reading is a share of them in 2^-15.
struct AnalogScales {
  double current_a = 0.0;
  double torque_nm = 0.0;
  double temperature_c = 0.0;
  double amplifier_a = 0.0;
};

/// Errors of sensors and amplifier.
struct Disturbances {
  double current_offset_a = 0.0;   ///< of the reading, which the amplifier follows
  double torque_offset_nm = 0.0;   ///< of the reading
  double output_offset_rad = 0.0;  ///< of the reading
  double amplifier_limit_a = 0.0;  ///< largest current; zero: that of the drive's amplifier
};

struct RigSetup {
  plant::Drive drive;
  std::uint64_t seed = 1;
  std::uint32_t tick_hz = 20'000;
  bool noise = true;
  bool locked = false;
  double start_turns = 0.0;  ///< the motor's angle when the drive is switched on; the output at rest with it
  /// The encoders' reading of that angle. Not stated: the true angle, as if they had counted from zero.
  control::SensorKind encoders = control::SensorKind::not_stated;
  bool three_phase = false;  ///< a three-phase motor and its power stage instead of an amplifier that takes a current
  /// That motor; none: the one whose settings the drive was made with.
  std::optional<ThreePhaseParameters> motor{};
};
/// The motor's angle at power-on for this seed, unless it is stated: within two turns.
double initial_turns(std::uint64_t seed);
AnalogScales scales_of(const plant::Drive& drive);
/// What the board of such a drive states about its hardware.
control::Hardware hardware_of(const plant::Drive& drive,
                              control::SensorKind encoders = control::SensorKind::incremental);

/// A drive without its processor: the plant, its amplifier, its sensors with their noise and rounding. One
/// tick is sense(), then act(). The same setup gives the same bits.
class PlantRig {
 public:
  explicit PlantRig(const RigSetup& setup);

  /// Samples all sensors now: updates the readings of the previous tick.
  void sense(firmware::Readings& readings);
  /// The same into the rig's own readings, valid until the next tick.
  const firmware::Readings& sense() {
    sense(last_);
    return last_;
  }
  /// Applies the amplifier's command and advances the plant by one tick.
  void act(const firmware::Actuation& actuation);

  void inject(Injection what);
  void clear(Injection what);
  bool has(Injection what) const { return (injected_ & bit(what)) != 0; }
  void disturb(const Disturbances& what) { disturbances_ = what; }
  void set_temperature(double celsius) { temperature_c_ = celsius; }
  double temperature_c() const { return temperature_c_; }
  /// On the output; positive resists positive motion.
  void set_load_torque(double nm) { load_torque_nm_ = nm; }
  double load_torque_nm() const { return load_torque_nm_; }

  std::uint32_t tick_hz() const { return setup_.tick_hz; }
  const plant::State& truth() const { return plant_.state(); }
  /// Through the flexspline, output side, N m.
  double torque_nm() const { return plant_.torque(); }
  /// The amplifier's own reading in the last tick, A; the true current is less by the offsets.
  double current_a() const { return current_a_; }
  /// nullptr: its amplifier takes a current.
  ThreePhaseAmplifier* three_phase() { return three_phase_.get(); }
  bool amplifier_tripped() const { return three_phase_ && three_phase_->stage().tripped(); }

 private:
  static constexpr std::uint64_t bit(Injection what) { return std::uint64_t{1} << static_cast<int>(what); }
  double noise(double standard_deviation);
  void pass_faults_to_stage();
  std::uint32_t motor_count(std::uint32_t true_count);
  void begin_counters();
  double shown_motor_rad() const;
  void pass_index(double shown_rad, firmware::Readings& r);
  double flowing(bool enabled);
  double through_amplifier(const firmware::Actuation& actuation);
  void warm(double current_a);
  std::int16_t share(double value, double full_scale) const;

  RigSetup setup_;
  AnalogScales scales_;
  plant::SensorErrors errors_;
  double tick_s_;
  int plant_steps_;  // of each tick
  plant::TwoMass plant_;
  plant::Normal normal_;
  // Standard deviations.
  double current_noise_a_;
  double torque_noise_nm_;
  double temperature_noise_c_;
  std::uint64_t injected_ = 0;  // a bit for each
  Disturbances disturbances_;
  double lag_ = 1.0;  // share of its remaining difference by which the amplifier's current changes in a tick
  firmware::Readings last_;
  // True counts of both encoders at the previous tick.
  std::uint32_t motor_before_ = 0;
  std::uint32_t output_before_ = 0;
  // Counts from the shaft's zero to that of the counter.
  std::uint32_t motor_origin_ = 0;
  std::uint32_t output_origin_ = 0;
  std::int64_t turn_before_ = 0;  // whole turns of the motor at the previous tick
  std::uint32_t swapped_ = 0;     // counts of a swapped motor encoder in the wrong direction
  // Counts during which a coupling slipped.
  std::int32_t motor_slipped_ = 0;
  std::int32_t output_slipped_ = 0;
  double temperature_c_;
  double load_torque_nm_ = 0.0;
  std::unique_ptr<ThreePhaseAmplifier> three_phase_;
  double made_a_ = 0.0;  // of the amplifier, before its offset
  double current_a_ = 0.0;
};

}  // namespace flexspline::board
