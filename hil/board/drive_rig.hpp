#pragma once

#include <cstdint>
#include <optional>

#include "firmware/board.hpp"
#include "hil/plant/normal.hpp"
#include "hil/plant/parameters.hpp"
#include "hil/plant/physics.hpp"
#include "hil/plant/two_mass.hpp"

namespace flexspline::board {

/// What can be done to the drive while it runs.
enum class Injection {
  motor_encoder_stale,  ///< no new sample: count and sample number stand still
  output_encoder_stale,
  analog_stale,
  motor_encoder_stuck,    ///< samples come, the count stands still
  output_encoder_stuck,   ///< the same of the output
  motor_encoder_jump,     ///< the count is off by a quarter of a turn
  encoder_line_lost,      ///< one of the motor encoder's two lines: the count goes to and fro by one
  output_line_lost,       ///< the same of the output
  motor_encoder_swapped,  ///< the motor's count runs the other way from here on
  motor_encoder_slips,    ///< the coupling of the motor's encoder: half of the motion reaches it
  output_encoder_slips,   ///< the same of the output
  current_out_of_range,   ///< the converter's input is open
  torque_out_of_range,
  temperature_out_of_range,
  torque_stuck,    ///< the torque's reading stands still
  amplifier_dead,  ///< no current flows, whatever is commanded
  current_surge,   ///< 2 A above what the amplifier can give flow, and are measured
  tick_overrun,    ///< each tick takes longer than there is time for
};

/// Full scales of the analogue inputs and of the amplifier; a reading is a share of them in 2^-15.
struct AnalogScales {
  double current_a = 0.0;
  double torque_nm = 0.0;
  double temperature_c = 0.0;
  double amplifier_a = 0.0;
};

/// What is wrong with sensors and amplifier, by how much.
struct Disturbances {
  double current_offset_a = 0.0;   ///< of the reading, which the amplifier follows
  double torque_offset_nm = 0.0;   ///< of the reading
  double output_offset_rad = 0.0;  ///< of the reading
  double amplifier_limit_a = 0.0;  ///< that it gives at most; nought: what the drive's can
};

struct RigSetup {
  plant::Drive drive;
  std::uint64_t seed = 1;
  std::uint32_t tick_hz = 20'000;
  bool noise = true;
  bool locked = false;
  double wake_turns = 0.0;  ///< where the motor stands when the drive is switched on; the output at rest with it
  /// What its encoders show of that. Not stated: the angle as it is, as if they had counted from its zero.
  control::SensorKind encoders = control::SensorKind::not_stated;
};
AnalogScales scales_of(const plant::Drive& drive);
/// What the board of such a drive states of itself.
control::Hardware hardware_of(const plant::Drive& drive,
                              control::SensorKind encoders = control::SensorKind::incremental);

/// A drive on a table without its processor: the plant, its amplifier, its sensors with their noise and rounding. One
/// tick is sense(), then act(). The same setup gives the same bits.
class DriveRig {
 public:
  explicit DriveRig(const RigSetup& setup);

  /// Samples of all sensors, taken now: brings those of the tick before up to date.
  void sense(firmware::Readings& readings);
  /// The same where the rig keeps them, until the next tick.
  const firmware::Readings& sense() {
    sense(last_);
    return last_;
  }
  /// What the amplifier does until the next tick; moves the plant on by one.
  void act(const firmware::Actuation& actuation);

  void inject(Injection what) { injected_ |= bit(what); }
  void clear(Injection what) { injected_ &= ~bit(what); }
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
  /// As the amplifier's own reading has it in the last tick, A; what flows is less by the offsets.
  double current_a() const { return current_a_; }

 private:
  static constexpr std::uint64_t bit(Injection what) { return std::uint64_t{1} << static_cast<int>(what); }
  double noise(double standard_deviation);
  std::uint32_t motor_count(std::uint32_t true_count);
  void begin_counters();
  double motor_zero() const;  // rad
  void pass_index(double shown_rad, firmware::Readings& r);
  double flowing(bool enabled);
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
  double lag_ = 1.0;  // share of its way that the amplifier's current goes in a tick
  firmware::Readings last_;
  // True counts of both encoders at the tick before.
  std::uint32_t motor_before_ = 0;
  std::uint32_t output_before_ = 0;
  // Counts from the shaft's zero to that of the counter.
  std::uint32_t motor_origin_ = 0;
  std::uint32_t output_origin_ = 0;
  std::int64_t turn_before_ = 0;  // whole turns of the motor at the tick before
  std::uint32_t swapped_ = 0;     // counts that a swapped encoder of the motor took the other way
  // Counts during which a coupling slipped.
  std::int32_t motor_slipped_ = 0;
  std::int32_t output_slipped_ = 0;
  double temperature_c_;
  double load_torque_nm_ = 0.0;
  double made_a_ = 0.0;  // by the amplifier, before its offset
  double current_a_ = 0.0;
};

}  // namespace flexspline::board
