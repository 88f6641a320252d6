#include "hil/board/three_phase.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "hil/board/plant_rig.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::board {
namespace {

// The demo's drive, and how others scale from it: 3.5 A of 10, 7 pole pairs, a rated speed that induces 7.2 V of 48.
constexpr double kDemoCurrentA = 3.5, kDemoTorqueConstant = 0.0543, kDemoVelocity = 200.0;
constexpr double kFullScaleA = 10.0, kBusV = 48.0, kBusFullScaleV = 60.0;
constexpr double kOhm = 1.0, kHenry = 1e-3;
constexpr double kBrakeOhm = 20.0;
constexpr int kPolePairs = 7;
constexpr int kTimerCounts = 2100;
constexpr std::uint64_t kShuntNoise = 23;
constexpr double kShortestPulseS = 0.2e-6, kSamplingWindowS = 1.5e-6;

// Of the whole period, as foc::ModulationSettings has it.
std::int32_t duty(double share) {
  return static_cast<std::int32_t>(std::lround(std::ldexp(share, control::foc::kDutyBits)));
}

double current_scale(const plant::Drive& drive) {
  return drive.current_limit_a / kDemoCurrentA;
}
double voltage_scale(const plant::Drive& drive) {
  return drive.torque_constant_nm_a * drive.rated_velocity_rad_s / (kDemoTorqueConstant * kDemoVelocity);
}

}  // namespace

ThreePhaseParameters three_phase_of(const plant::Drive& drive) {
  const double ampere = current_scale(drive), volt = voltage_scale(drive), ohm = volt / ampere;
  ThreePhaseParameters p;
  p.motor.pole_pairs = kPolePairs;
  p.motor.resistance_ohm = kOhm * ohm;
  p.motor.inductance_d_h = p.motor.inductance_q_h = kHenry * ohm;
  p.motor.flux_vs = drive.torque_constant_nm_a / (1.5 * kPolePairs);
  // The mechanical plant has the temperature.
  p.motor.heat_capacity_j_k = 1e12;
  p.inverter.supply_v = kBusV * volt;
  p.inverter.supply_resistance_ohm *= ohm;
  p.inverter.on_resistance_ohm *= ohm;
  p.inverter.diode_drop_v *= volt;
  p.inverter.bus_capacitance_f /= ohm;
  p.inverter.leg_capacitance_f /= ohm;
  p.inverter.brake_ohm = kBrakeOhm * ohm;
  p.inverter.pwm_hz = ThreePhaseAmplifier::kPwmHz;
  p.inverter.averaged_steps = 4;
  p.sensors.full_scale_a = kFullScaleA * ampere;
  p.sensors.bus_full_scale_v = kBusFullScaleV * volt;
  p.sensors.noise_a = 0.01 * ampere;
  return p;
}

// As host/drive_link/deployment makes them from the parameters; a test compares them.
firmware::ThreePhaseSettings three_phase_settings_of(const plant::Drive& drive) {
  constexpr control::foc::AxisSettings kAxis = {1521094321,  543636828, 44918200,  1812122759, 79528380,
                                                -2134008365, -53565016, 906953555, 1405524761};
  firmware::ThreePhaseSettings s;
  s.foc.sensors.gain = {4096, 4096, 4096};
  s.foc.current = {kAxis, kAxis, 22714284, 624333630, 8388608, 7};
  s.foc.modulation = {129564847, 30780599, 5418, 36408889, 8400};
  s.foc.circle = 9408655;
  // The flux per unit is that of the speed's base.
  s.foc.current.flux =
      static_cast<std::int32_t>(std::lround(s.foc.current.flux * kDemoVelocity / drive.rated_velocity_rad_s));
  const AnalogScales scales = scales_of(drive);
  const double full_scale = kFullScaleA * current_scale(drive), peak = scales.amplifier_a / full_scale;
  s.limits.peak_square = s.limits.continuous_square =
      static_cast<std::uint32_t>(std::lround(std::ldexp(peak * peak, 30)));
  s.limits.start_square = s.limits.peak_square;
  s.limits.voltage_share = INT32_MAX;
  s.offsets = {3276, 1638};                          // a tenth of full scale, a twentieth
  s.least_bus = 13107;                               // 24 V of 60 for the demo's drive
  s.most_bus = 30583;                                // 56 V
  s.most_phase = 10 * (std::int32_t{1} << 27) / 16;  // five eighths of full scale: 1.4 times the amplifier's largest
  s.most_sum = (std::int32_t{1} << 27) / 16;
  s.protection = protection_of(drive);
  s.pole_pairs = kPolePairs;
  s.encoder_counts = static_cast<std::uint32_t>(drive.sensors.motor_counts);
  s.set_point = static_cast<std::int32_t>(std::lround(std::ldexp(peak, 12)));
  s.reading = static_cast<std::int32_t>(std::lround(std::ldexp(full_scale / scales.current_a, 20)));
  const motor::InverterParameters inverter = three_phase_of(drive).inverter;
  s.test_modulation.pulse = duty((kShortestPulseS + inverter.dead_time_s) * inverter.pwm_hz);
  s.test_modulation.window = duty((kSamplingWindowS + 5.0 * inverter.dead_time_s) * inverter.pwm_hz);
  s.test_modulation.period = s.foc.modulation.period;
  s.timer_counts = kTimerCounts;
  s.pwm_hz = ThreePhaseAmplifier::kPwmHz;
  s.current_full_scale_ma = static_cast<std::uint32_t>(std::lround(1e3 * full_scale));
  s.bus_full_scale_mv = static_cast<std::uint32_t>(std::lround(1e3 * kBusFullScaleV * voltage_scale(drive)));
  return s;
}

ThreePhaseAmplifier::ThreePhaseAmplifier(const plant::Drive& drive, std::uint32_t tick_hz, std::uint64_t seed,
                                         const ThreePhaseParameters& parameters)
    : p_(parameters),
      torque_constant_(drive.torque_constant_nm_a),
      full_scale_a_(scales_of(drive).current_a),
      counts_(drive.sensors.motor_counts),
      periods_(static_cast<int>(kPwmHz / tick_hz)),
      power_(p_.motor, p_.inverter, p_.sensors, motor::Fidelity::averaged, p_.wiring),
      shunts_(p_.sensors, seed ^ kShuntNoise) {
  if (periods_ == 0 || kPwmHz % tick_hz != 0)
    throw std::invalid_argument("a three-phase drive needs a tick rate that divides its PWM rate of 40000 Hz");
  firmware::ThreePhaseSettings settings = three_phase_settings_of(drive);
  if (!p_.commissioned) settings.pole_pairs = 0;
  stage_.begin(settings);
}

double encoder_angle(const ThreePhaseParameters& p, double angle_rad) {
  if (p.eccentricity_rad == 0.0) return angle_rad;
  return angle_rad + p.eccentricity_rad * std::sin(angle_rad + p.eccentricity_phase_rad);
}

// The encoder's counter, as the stage reads it.
std::uint32_t ThreePhaseAmplifier::counter_at(double angle_rad) {
  const double turns = encoder_angle(p_, angle_rad) / kTurn;
  const double seen = slip_.encoder_turns(turns, p_.slip_every_turns, p_.slip_turns);
  return static_cast<std::uint32_t>(std::llround((p_.encoder_stands ? slip_.first_turns() : seen) * counts_));
}

std::uint32_t ThreePhaseAmplifier::faulty(std::uint32_t counter) {
  counter_ = counter;
  const std::uint32_t moved = counter - counter_at_fault_;
  switch (encoder_) {
    case StageEncoder::intact:
      return counter;
    case StageEncoder::held:
      return counter_at_fault_;
    case StageEncoder::jumped:
      return counter + static_cast<std::uint32_t>(counts_ / 4);
    case StageEncoder::halved:
      return counter_at_fault_ + static_cast<std::uint32_t>(static_cast<std::int32_t>(moved) / 2);
    case StageEncoder::reversed:
      return counter_at_fault_ - moved;
  }
  return counter;
}
void ThreePhaseAmplifier::set_encoder(StageEncoder encoder) {
  if (encoder == encoder_) return;
  encoder_ = encoder;
  counter_at_fault_ = counter_;
}

void ThreePhaseAmplifier::set_faults(const StageFaults& faults) {
  if (faults == faults_) return;
  faults_ = faults;
  constexpr double kShortShare = 0.05, kGroundShare = 0.1;  // as a wiring fault has them
  motor::WiringParameters wiring = p_.wiring;
  if (faults.phase_open) wiring.open[0] = true;
  if (faults.phases_shorted) {
    wiring.short_ohm = kShortShare * p_.motor.resistance_ohm;
    wiring.short_from = 1;
    wiring.short_to = 2;
  }
  if (faults.phase_grounded) {
    wiring.ground_ohm = kGroundShare * p_.motor.resistance_ohm;
    wiring.ground_leg = 0;
  }
  power_.set_wiring(wiring);
  power_.set_supply_v((faults.bus_collapsed ? 0.2 : 1.0) * p_.inverter.supply_v);
  power_.set_brake_ohm(faults.brake_missing ? 0.0 : p_.inverter.brake_ohm);
}
std::int32_t ThreePhaseAmplifier::thermistor() const {
  if (faults_.thermistor_open) return 32752;
  if (faults_.thermistor_shorted) return 0;
  return thermistor_reading(temperature_c_);
}

// While current control runs; readings follow by the sensors' own gains.
void ThreePhaseAmplifier::drift(motor::Sample& sample) const {
  if (!out_.enabled || stage_.commissions()) return;
  for (std::size_t x = 0; x < 3; ++x) sample.seen_a[x] = sample.seen_a[x] * p_.drift_gain[x] + p_.drift_offset_a[x];
}

double ThreePhaseAmplifier::run(const firmware::Actuation& actuation, double motor_angle_rad, double motor_velocity) {
  stage_.command(actuation);
  // Without waiting for the next period.
  if (!actuation.enabled && !stage_.commissions()) {
    if (out_.enabled) opened_at_ = periods_run_;
    out_ = {};
  }
  const double period = power_.period_s();
  double torque = 0.0;
  for (int k = 0; k < periods_; ++k) {
    const double start = motor_angle_rad + motor_velocity * period * k;
    const motor::Rotor at = {start * p_.motor.pole_pairs + kTurn * p_.offset_turns,
                             motor_velocity * p_.motor.pole_pairs};
    const double all = kTimerCounts;
    const motor::Triple duties = {out_.counts.a / all, out_.counts.b / all, out_.counts.c / all};
    // Off: open switches carry no current, but for back-EMF above the bus, which the rated speed does not reach.
    power_.set_brake(out_.brake / 32768.0);
    motor::Sample sample;
    if (out_.enabled) {
      sample = power_.run(duties, at);
    } else {
      power_.rest(at);
      sample = {{}, {}, power_.bus_v(), power_.motor().torque_nm(at.angle)};
    }
    for (const double x : sample.seen_a) peak_phase_a_ = std::max(peak_phase_a_, std::abs(x));
    torque += sample.torque_nm / periods_;
    drift(sample);
    const motor::Readings r = shunts_.read(sample);
    const double middle = start + motor_velocity * period / 2.0;
    const bool was_enabled = out_.enabled;
    out_ = stage_.update(
        {{r.current[0], r.current[1], r.current[2]}, r.bus, faulty(counter_at(middle)), faults_.driver, thermistor()});
    if (out_.clears_driver) faults_.driver = false;
    ++periods_run_;
    if (was_enabled && !out_.enabled) opened_at_ = periods_run_;
  }
  return torque / torque_constant_;
}

double ThreePhaseAmplifier::current_a() const {
  return stage_.current() / 32768.0 * full_scale_a_;
}

}  // namespace flexspline::board
