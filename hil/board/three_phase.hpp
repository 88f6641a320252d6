#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "firmware/three_phase.hpp"
#include "hil/motor/encoder_slip.hpp"
#include "hil/motor/power_stage.hpp"
#include "hil/motor/shunts.hpp"
#include "hil/plant/parameters.hpp"

namespace flexspline::board {

/// A three-phase motor with the torque constant of a drive, and a power stage for it.
struct ThreePhaseParameters {
  motor::MotorParameters motor;
  motor::InverterParameters inverter;
  motor::SensorParameters sensors;
  motor::WiringParameters wiring;
  double offset_turns = 0.0;  ///< electrical angle of the rotor where the encoder is at zero
  /// As EncoderParameters has it, in what the stage reads.
  bool encoder_stands = false;
  double slip_turns = 0.0;
  double slip_every_turns = 0.0;
  bool commissioned = true;  ///< the drive has the settings of this motor in its memory
  /// What calibration and commissioning do not see, as it came after them: errors of the sensors that current control
  /// runs with.
  motor::Triple drift_offset_a{};
  motor::Triple drift_gain{1.0, 1.0, 1.0};
  /// Of the encoder's disc: it shows angle + eccentricity sin(angle + phase), to the stage and to the motion loops.
  double eccentricity_rad = 0.0;
  double eccentricity_phase_rad = 0.0;
};
/// What that encoder shows of an angle of the rotor.
double encoder_angle(const ThreePhaseParameters& p, double angle_rad);
/// Of each drive in proportion to its largest current and its rated voltage, so that the numbers per unit are the same.
ThreePhaseParameters three_phase_of(const plant::Drive& drive);
/// Another motor of the same torque constant within 5 %, of which the drive knows nothing: resistance and inductances
/// 0.6 to 1.6 times those, Lq/Ld from 0.7 to 1.5, 4 to 12 pole pairs, any angle of the encoder, two phases swapped or
/// not, sensors whose gains differ by 2 % and whose zeros are off by up to 3 % of full scale.
ThreePhaseParameters drawn_motor(const plant::Drive& drive, std::uint64_t seed);
/// Names such as phase-open-b; what is wrong with the wires, sensors or the encoder then.
std::vector<std::string> wiring_fault_names();
/// False where there is no such fault.
bool add_wiring_fault(ThreePhaseParameters& p, const std::string& name);
/// What makes ripples in a motor that runs: cogging, cogging-magnet, current-offset, current-gain, back-emf, dead-time,
/// encoder-eccentricity.
std::vector<std::string> motor_ripple_names();
/// `size` times its usual size; angles and phases are random by `seed`. False where there is no such name.
bool add_motor_ripple(ThreePhaseParameters& p, const std::string& name, double size, std::uint64_t seed);
/// Slots of a stator that goes with a number of pole pairs: a usual winding of concentrated coils.
int usual_slots(int pole_pairs);
/// What is in such a drive's memory once it was commissioned.
firmware::ThreePhaseSettings three_phase_settings_of(const plant::Drive& drive);

/// Faults of the power stage while it runs; each may come and go.
struct StageFaults {
  bool phase_open = false;  ///< the wire of leg a
  bool phases_shorted = false;
  bool phase_grounded = false;
  bool bus_collapsed = false;
  bool driver = false;  ///< until its reset line
  bool thermistor_open = false;
  bool thermistor_shorted = false;
  bool brake_missing = false;
  bool operator==(const StageFaults&) const = default;
};
/// What the stage's encoder shows while it runs.
enum class StageEncoder { intact, held, jumped, halved, reversed };

/// The protection of that stage: thermistor, brake resistor, bootstrap supplies, limits of the winding.
firmware::ProtectionSettings protection_of(const plant::Drive& drive);
/// Reading of the thermistor's divider at a temperature, 2^-15.
std::int32_t thermistor_reading(double celsius);

/// The amplifier of a three-phase drive: the firmware's stage on the twin's motor and power stage, several PWM periods
/// a tick. Rotor and encoder are those of the mechanical plant.
class ThreePhaseAmplifier {
 public:
  static constexpr std::uint32_t kPwmHz = 40'000;

  /// Throws std::invalid_argument where a tick is not a whole number of PWM periods.
  ThreePhaseAmplifier(const plant::Drive& drive, std::uint32_t tick_hz, std::uint64_t seed)
      : ThreePhaseAmplifier(drive, tick_hz, seed, three_phase_of(drive)) {}
  ThreePhaseAmplifier(const plant::Drive& drive, std::uint32_t tick_hz, std::uint64_t seed,
                      const ThreePhaseParameters& parameters);

  /// One tick; the rotor is at this angle now and turns at this speed. Returns the mean torque of the tick as a current
  /// of the drive's torque constant, A.
  double run(const firmware::Actuation& actuation, double motor_angle_rad, double motor_velocity_rad_s);
  /// As the drive reads it: 2^-15 of its full scale.
  std::int16_t reading() const { return stage_.current(); }
  /// The same, A.
  double current_a() const;

  void set_faults(const StageFaults& faults);
  void set_encoder(StageEncoder encoder);
  void set_temperature_c(double celsius) { temperature_c_ = celsius; }
  /// The largest current of a wire since then, with that of a short, A; sampled once a PWM period.
  double peak_phase_a() const { return peak_phase_a_; }
  void forget_peak() { peak_phase_a_ = 0.0; }
  /// PWM periods until now, and the one in which the stage opened its switches last.
  std::uint64_t periods() const { return periods_run_; }
  std::uint64_t opened_at() const { return opened_at_; }

  firmware::ThreePhaseStage& stage() { return stage_; }
  motor::PowerStage& power() { return power_; }
  const ThreePhaseParameters& parameters() const { return p_; }

 private:
  std::uint32_t counter_at(double angle_rad);
  void drift(motor::Sample& sample) const;
  std::uint32_t faulty(std::uint32_t counter);
  std::int32_t thermistor() const;

  ThreePhaseParameters p_;
  double torque_constant_;
  double full_scale_a_;
  int counts_;
  int periods_;  // a tick
  motor::PowerStage power_;
  motor::Shunts shunts_;
  firmware::ThreePhaseStage stage_;
  firmware::ThreePhaseStage::Outputs out_;
  motor::EncoderSlip slip_;
  StageFaults faults_;
  StageEncoder encoder_ = StageEncoder::intact;
  std::uint32_t counter_ = 0;  // intact, of the last period
  std::uint32_t counter_at_fault_ = 0;
  double temperature_c_ = 30.0;
  double peak_phase_a_ = 0.0;
  std::uint64_t periods_run_ = 0;
  std::uint64_t opened_at_ = 0;
};

}  // namespace flexspline::board
