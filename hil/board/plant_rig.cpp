#include "hil/board/plant_rig.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "hil/plant/sensors.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::board {
namespace {

constexpr double kSurgeA = 2.0;
constexpr double kLongestStepS = 125.1e-6;  // of the plant: hil/plant/README.md, Numerics
enum Stream : std::uint64_t { kSensorNoise = 17 };

// As std::llround(), but without a call, for the range of an encoder or a converter. It adds the largest number below
// one half: so the largest number that is rounded down stays below the next integer, and a half is rounded up.
std::int64_t nearest(double x) {
  constexpr double kBelowHalf = 0.5 - 0x1p-54;
  return static_cast<std::int64_t>(x + std::copysign(kBelowHalf, x));
}
double noise_of(const plant::Sensor& sensor, double rated) {
  return std::max(sensor.noise_share * rated, sensor.noise_floor);
}
std::uint32_t counter(double angle_rad, int counts) {
  return static_cast<std::uint32_t>(nearest(angle_rad / kTurn * counts));
}
// The remaining line counts up and down at the same edge.
std::uint32_t on_one_line(std::uint32_t before, std::uint32_t count) {
  return (before & ~1U) | (count >> 1U & 1U);
}

plant::State initial_state(const RigSetup& setup) {
  plant::State state;
  if (setup.start_turns == 0.0) return state;
  state.motor_angle = kTurn * setup.start_turns;
  state.output_angle = state.motor_angle / setup.drive.gear_ratio;
  return state;
}

}  // namespace

double initial_turns(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  return std::uniform_real_distribution<double>(-2.0, 2.0)(random);
}

AnalogScales scales_of(const plant::Drive& drive) {
  const double limit = drive.current_limit_a;
  return {.current_a = 2.0 * limit,
          .torque_nm = 3.0 * drive.rated_torque_nm,
          .temperature_c = 200.0,
          .amplifier_a = 1.25 * limit};
}

control::Hardware hardware_of(const plant::Drive& drive, control::SensorKind encoders) {
  using control::SensorKind;
  const SensorKind output = encoders == SensorKind::indexed ? SensorKind::incremental : encoders;
  const auto thousandths = [](double x) { return static_cast<std::uint32_t>(std::lround(1000.0 * x)); };
  const AnalogScales scales = scales_of(drive);
  return {.current_full_scale_ma = thousandths(scales.current_a),
          .amplifier_full_scale_ma = thousandths(scales.amplifier_a),
          .most_current_ma = thousandths(drive.current_limit_a),
          .torque_full_scale_mnm = thousandths(scales.torque_nm),
          .temperature_full_scale_mc = thousandths(scales.temperature_c),
          .motor_encoder = encoders,
          .output_encoder = drive.sensors.output_counts > 0 ? output : SensorKind::none,
          .torque_sensor = SensorKind::analog};
}

PlantRig::PlantRig(const RigSetup& setup)
    : setup_(setup),
      scales_(scales_of(setup.drive)),
      errors_(plant::sensor_errors_of(setup.drive)),
      tick_s_(1.0 / setup.tick_hz),
      plant_steps_(static_cast<int>(std::ceil(tick_s_ / kLongestStepS))),
      plant_(plant::physics_of(setup.drive), setup.locked, initial_state(setup)),
      normal_(plant::stream_seed(setup.seed, 0, kSensorNoise)),
      current_noise_a_(noise_of(setup.drive.sensors.current, setup.drive.rated_current_a)),
      torque_noise_nm_(noise_of(setup.drive.sensors.torque, setup.drive.rated_torque_nm)),
      temperature_noise_c_(noise_of(setup.drive.sensors.temperature, 0.0)),
      temperature_c_(setup.drive.thermal.start_c.value_or(
          setup.drive.thermal.ambient_c.value_or(setup.drive.temperature_reference_c))) {
  const double corner_hz = setup.drive.amplifier.bandwidth_hz;
  if (corner_hz > 0.0) lag_ = 1.0 - std::exp(-kTurn * corner_hz * tick_s_);
  if (setup.encoders != control::SensorKind::not_stated) begin_counters();
  if (setup.three_phase)
    three_phase_ = std::make_unique<ThreePhaseAmplifier>(setup.drive, setup.tick_hz, setup.seed,
                                                         setup.motor.value_or(three_phase_of(setup.drive)));
}

void PlantRig::inject(Injection what) {
  injected_ |= bit(what);
  pass_faults_to_stage();
}
void PlantRig::clear(Injection what) {
  injected_ &= ~bit(what);
  pass_faults_to_stage();
}
// The stage reads the same encoder.
void PlantRig::pass_faults_to_stage() {
  if (!three_phase_) return;
  three_phase_->set_faults({.phase_open = has(Injection::phase_lost),
                            .phases_shorted = has(Injection::phases_shorted),
                            .phase_grounded = has(Injection::phase_grounded),
                            .bus_collapsed = has(Injection::bus_collapse),
                            .driver = has(Injection::driver_fault),
                            .thermistor_open = has(Injection::thermistor_open),
                            .thermistor_shorted = has(Injection::thermistor_shorted),
                            .brake_missing = has(Injection::brake_missing)});
  const bool is_held =
      has(Injection::motor_encoder_stale) || has(Injection::motor_encoder_stuck) || has(Injection::encoder_line_lost);
  three_phase_->set_encoder(is_held                                 ? StageEncoder::held
                            : has(Injection::motor_encoder_jump)    ? StageEncoder::jumped
                            : has(Injection::motor_encoder_slips)   ? StageEncoder::halved
                            : has(Injection::motor_encoder_swapped) ? StageEncoder::reversed
                                                                    : StageEncoder::intact);
}

// An absolute encoder starts at its angle within a turn, another one at zero.
void PlantRig::begin_counters() {
  const bool absolute = setup_.encoders == control::SensorKind::absolute;
  const auto origin = [absolute](double angle_rad, int counts) {
    const std::int64_t now = nearest(angle_rad / kTurn * counts);
    const std::int64_t rest = ((now % counts) + counts) % counts;
    return static_cast<std::uint32_t>(absolute ? now - rest : now);
  };
  const plant::Sensors& sensors = setup_.drive.sensors;
  const double motor = shown_motor_rad(), output = plant_.state().output_angle;
  motor_origin_ = origin(motor, sensors.motor_counts);
  output_origin_ = sensors.output_counts > 0 ? origin(output, sensors.output_counts) : 0;
  motor_before_ = counter(motor, sensors.motor_counts) - motor_origin_;
  output_before_ = counter(output, sensors.output_counts) - output_origin_;
  turn_before_ = static_cast<std::int64_t>(std::floor(motor / kTurn));
}

// The motor's angle, as its encoder shows it.
double PlantRig::shown_motor_rad() const {
  const double angle = plant_.state().motor_angle - errors_.torsion_zero_rad * setup_.drive.gear_ratio;
  return setup_.motor ? encoder_angle(*setup_.motor, angle) : angle;
}

// Drawn even where it is not used, so that an injected fault does not change the later noise.
double PlantRig::noise(double standard_deviation) {
  const double drawn = normal_();
  return setup_.noise ? standard_deviation * drawn : 0.0;
}

std::int16_t PlantRig::share(double value, double full_scale) const {
  return static_cast<std::int16_t>(nearest(std::clamp(value / full_scale * 32768.0, -32768.0, 32767.0)));
}

// The count of an intact motor encoder.
std::uint32_t PlantRig::motor_count(std::uint32_t true_count) {
  const std::uint32_t moved = true_count - motor_before_;
  motor_before_ = true_count;
  if (has(Injection::motor_encoder_swapped)) swapped_ += moved;
  if (has(Injection::motor_encoder_slips)) motor_slipped_ += static_cast<std::int32_t>(moved);
  return true_count - 2U * swapped_ - static_cast<std::uint32_t>(motor_slipped_ / 2);
}

// A pulse where the motor passes a whole turn, in either direction.
void PlantRig::pass_index(double shown_rad, firmware::Readings& r) {
  const auto turn = static_cast<std::int64_t>(std::floor(shown_rad / kTurn));
  if (turn == turn_before_) return;
  const std::int64_t passed = turn > turn_before_ ? turn : turn_before_;
  turn_before_ = turn;
  ++r.index_passes;
  r.index_counter = static_cast<std::uint32_t>(passed * setup_.drive.sensors.motor_counts) - motor_origin_;
}

void PlantRig::sense(firmware::Readings& r) {
  const plant::State& state = plant_.state();
  const plant::Sensors& sensors = setup_.drive.sensors;
  const double current = current_a_ + noise(current_noise_a_);
  double torque = errors_.torque_gain * plant_.torque() + errors_.torque_offset_nm + disturbances_.torque_offset_nm;
  for (const plant::Ripple& ripple : errors_.torque_ripple) {
    const double phase = ripple.order * state.motor_angle;
    torque += ripple.cosine * std::cos(phase) + ripple.sine * std::sin(phase);
  }
  torque += noise(torque_noise_nm_);
  const double temperature = temperature_c_ + noise(temperature_noise_c_);

  const double shown = shown_motor_rad();
  const std::uint32_t motor = motor_count(counter(shown, sensors.motor_counts) - motor_origin_);
  if (!has(Injection::motor_encoder_stale)) {
    ++r.motor_samples;
    if (has(Injection::encoder_line_lost)) {
      r.motor_counter = on_one_line(r.motor_counter, motor);
    } else if (!has(Injection::motor_encoder_stuck)) {
      r.motor_counter = motor;
    }
    if (setup_.encoders == control::SensorKind::indexed) pass_index(shown, r);
    if (has(Injection::motor_encoder_jump)) r.motor_counter += static_cast<std::uint32_t>(sensors.motor_counts / 4);
  }
  const std::uint32_t on_shaft =
      counter(state.output_angle + disturbances_.output_offset_rad, sensors.output_counts) - output_origin_;
  if (has(Injection::output_encoder_slips)) output_slipped_ += static_cast<std::int32_t>(on_shaft - output_before_);
  output_before_ = on_shaft;
  const std::uint32_t output = on_shaft - static_cast<std::uint32_t>(output_slipped_ / 2);
  if (!has(Injection::output_encoder_stale)) {
    ++r.output_samples;
    if (has(Injection::output_line_lost)) {
      r.output_counter = on_one_line(r.output_counter, output);
    } else if (!has(Injection::output_encoder_stuck)) {
      r.output_counter = output;
    }
  }
  if (!has(Injection::analog_stale)) {
    ++r.analog_samples;
    const std::int16_t read = three_phase_ ? three_phase_->reading() : share(current, scales_.current_a);
    r.current = has(Injection::current_out_of_range) ? INT16_MIN : read;
    r.temperature = has(Injection::temperature_out_of_range) ? INT16_MAX : share(temperature, scales_.temperature_c);
    if (has(Injection::torque_out_of_range)) {
      r.torque = INT16_MAX;
    } else if (!has(Injection::torque_stuck)) {
      r.torque = share(torque, scales_.torque_nm);
    }
  }
}

// The current, as the amplifier reads it.
double PlantRig::flowing(bool enabled) {
  if (!enabled) return made_a_ = 0.0;
  const double most =
      disturbances_.amplifier_limit_a > 0.0 ? disturbances_.amplifier_limit_a : setup_.drive.amplifier.saturation_a;
  made_a_ += lag_ * (current_a_ - made_a_);
  if (most > 0.0) made_a_ = std::clamp(made_a_, -most, most);
  return made_a_;
}

// The housing: power that is not delivered as work warms it.
void PlantRig::warm(double current_a) {
  const plant::Thermal& thermal = setup_.drive.thermal;
  if (thermal.capacity_j_c <= 0.0) return;
  const plant::State& state = plant_.state();
  const double lost_w = setup_.drive.torque_constant_nm_a * current_a * state.motor_velocity -
                        plant_.torque() * state.output_velocity + thermal.winding_ohm * current_a * current_a;
  const double to_air_w =
      (temperature_c_ - thermal.ambient_c.value_or(setup_.drive.temperature_reference_c)) / thermal.resistance_c_w;
  temperature_c_ += tick_s_ * (lost_w - to_air_w) / thermal.capacity_j_c;
}

// The true current.
double PlantRig::through_amplifier(const firmware::Actuation& actuation) {
  bool flows = actuation.enabled && !has(Injection::amplifier_dead);
  if (three_phase_) {
    const plant::State& state = plant_.state();
    const double current = three_phase_->run({actuation.current, flows}, state.motor_angle, state.motor_velocity);
    current_a_ = three_phase_->current_a();
    return current;
  }
  current_a_ = actuation.enabled ? actuation.current / 32768.0 * scales_.amplifier_a : 0.0;
  double reading_a = flowing(flows);
  if (has(Injection::current_surge)) {
    reading_a = scales_.amplifier_a + kSurgeA;
    flows = true;
  }
  current_a_ = reading_a;
  // The amplifier makes its (biased) reading follow the command.
  return flows ? reading_a - errors_.current_offset_a - disturbances_.current_offset_a + setup_.drive.amplifier.offset_a
               : 0.0;
}

void PlantRig::act(const firmware::Actuation& actuation) {
  plant::Inputs inputs;
  inputs.current_a = through_amplifier(actuation);
  inputs.temperature_c = temperature_c_;
  inputs.load_torque_nm = load_torque_nm_;
  plant_.advance(inputs, tick_s_, plant_steps_);
  warm(inputs.current_a);
}

}  // namespace flexspline::board
