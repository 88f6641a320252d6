#include "tests/worlds/machines/kinds.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace flexspline::worlds::machines {
namespace {

void set_rotor(Machine& m, double ratio, double torque_constant, double inertia, double coulomb) {
  m.plant.gear.ratio = ratio;
  m.plant.electric.torque_constant_nm_a = torque_constant;
  m.plant.rotor_inertia_kgm2 = inertia;
  m.plant.friction.coulomb_nm = coulomb;
}

void set_limits(Machine& m, double velocity, double acceleration, double range) {
  m.limits = {velocity, acceleration, range};
}

// The load's inertia relative to the rotor's, both at the motor.
void set_load(Machine& m, double relative) {
  m.plant.load.inertia_kgm2 = m.plant.rotor_inertia_kgm2 * m.plant.gear.ratio * m.plant.gear.ratio * relative;
}

void set_gear(Machine& m, double stiffness, double damping_s) {
  m.plant.gear.stiffness_nm_rad = stiffness;
  m.plant.gear.damping_nms_rad = stiffness * damping_s;
}

void set_gravity(Machine& m, double sine_nm, Dice& dice) {
  m.plant.load.gravity_sine_nm = sine_nm;
  m.plant.load.gravity_cosine_nm = sine_nm * dice.between(-0.2, 0.2);
}

void draw_cobot_with_torque_sensors(Machine& m, Dice& d) {
  set_rotor(m, d.one_of({100, 120, 160}), d.between(0.05, 0.12), d.scale_between(6e-5, 3e-4), d.between(0.03, 0.08));
  set_limits(m, d.between(80, 200), d.between(800, 2500), d.between(60, 160));
  set_load(m, d.between(0.3, 1.2));
  set_gear(m, d.between(8e3, 3e4), d.between(2e-4, 1e-3));
  set_gravity(m, d.between(5, 20), d);
  m.plant.load.viscous_nms_rad = d.between(0.2, 1.0);
  m.sensors.sample_hz = d.one_of({500, 1000});
  m.sensors.encoder_counts = d.one_of({4096, 16384, 65536});
  m.sensors.output_encoder_counts = d.power_of_two(18, 20);
  m.sensors.torque_noise_nm = d.between(0.05, 0.2);
  m.sensors.torque = m.sensors.output_encoder = m.sensors.temperature = true;
  m.base.stiffness = true;
  m.base.load = m.base.gravity = d.with_chance(0.6);
}

void draw_cobot_without_output_encoder(Machine& m, Dice& d) {
  set_rotor(m, d.one_of({80, 100, 101, 121}), d.between(0.06, 0.2), d.scale_between(8e-5, 4e-4), d.between(0.04, 0.12));
  set_limits(m, d.between(80, 220), d.between(600, 2000), d.between(80, 200));
  set_load(m, d.between(0.5, 2.0));
  set_gear(m, d.between(1.5e4, 5e4), d.between(5e-4, 2e-3));
  if (d.with_chance(0.7)) set_gravity(m, d.between(6, 25), d);
  m.sensors.sample_hz = d.one_of({125, 250, 500});
  m.sensors.encoder_counts = d.one_of({8192, 32768, 131072});
  m.sensors.temperature = true;
  m.base.gravity = true;
}

void draw_exoskeleton(Machine& m, Dice& d) {
  set_rotor(m, d.one_of({50, 80}), d.between(0.06, 0.14), d.scale_between(4e-5, 1.5e-4), d.between(0.02, 0.05));
  set_limits(m, d.between(100, 220), d.between(1000, 3000), d.between(30, 70));
  m.plant.load.inertia_kgm2 = d.between(0.1, 0.4);
  m.plant.load.viscous_nms_rad = d.between(0.2, 1.0);
  set_gear(m, d.between(3e3, 1e4), d.between(5e-4, 2e-3));
  set_gravity(m, d.between(2, 8), d);
  m.human_torque_nm = d.between(5, 20);
  m.sensors.sample_hz = d.one_of({200, 500, 1000});
  m.sensors.encoder_counts = d.one_of({2048, 4096, 16384});
  m.sensors.torque_noise_nm = d.between(0.05, 0.2);
  m.sensors.torque = true;
  m.sensors.velocity_in_rpm = d.with_chance(0.5);
}

void draw_telescope(Machine& m, Dice& d) {
  set_rotor(m, 1, d.between(3, 10), d.between(20, 80), d.between(3, 9));
  set_limits(m, d.between(0.04, 0.2), d.between(0.04, 0.2), d.between(0.3, 0.9));
  m.plant.gear.rigid = true;
  m.sensors.sample_hz = d.one_of({100, 200});
  m.sensors.encoder_counts = d.power_of_two(22, 24);
  m.sensors.effort_is_torque = d.with_chance(0.5);
}

void draw_scara(Machine& m, Dice& d) {
  set_rotor(m, d.one_of({50, 80}), d.between(0.08, 0.2), d.scale_between(5e-5, 2e-4), d.between(0.02, 0.06));
  set_limits(m, d.between(220, 400), d.between(3000, 7000), d.between(60, 120));
  set_load(m, d.between(0.3, 1.0));
  set_gear(m, d.between(5e4, 1.4e5), d.between(5e-4, 2e-3));
  m.sensors.sample_hz = d.one_of({1000, 2000});
  m.sensors.encoder_counts = d.power_of_two(15, 17);
  m.sensors.temperature = true;
}

void draw_rotary_table(Machine& m, Dice& d) {
  set_rotor(m, 1, d.between(1, 4), d.between(0.2, 1.5), d.between(1.5, 5));
  set_limits(m, d.between(4, 15), d.between(15, 40), d.between(4, 15));
  m.plant.gear.rigid = true;
  m.sensors.sample_hz = d.one_of({500, 1000});
  m.sensors.encoder_counts = d.power_of_two(20, 23);
}

void draw_satellite(Machine& m, Dice& d) {
  set_rotor(m, d.one_of({100, 160}), d.between(0.03, 0.08), d.scale_between(1e-5, 5e-5), d.between(0.008, 0.02));
  set_limits(m, d.between(6, 30), d.between(10, 60), d.between(25, 80));
  m.plant.load.inertia_kgm2 = d.between(1, 4);
  set_gear(m, d.between(8e3, 2e4), d.between(1e-3, 4e-3));
  m.sensors.sample_hz = 100;
  m.sensors.encoder_counts = d.one_of({4096, 16384});
  m.sensors.temperature = true;
}

void draw_bench(Machine& m, Dice& d) {
  set_rotor(m, d.one_of({50, 100, 160}), d.between(0.08, 0.2), d.scale_between(6e-5, 3e-4), d.between(0.03, 0.07));
  set_limits(m, d.between(100, 250), d.between(600, 2000), d.between(150, 600));
  set_load(m, d.between(0.2, 0.6));
  set_gear(m, d.between(1.5e4, 4e4), d.between(5e-4, 2e-3));
  m.bench_torque_nm = d.between(8, 25);
  m.sensors.sample_hz = d.one_of({500, 1000});
  m.sensors.encoder_counts = d.one_of({8192, 65536});
  m.sensors.output_encoder_counts = std::exp2(18);
  m.sensors.torque_noise_nm = d.between(0.05, 0.15);
  m.sensors.output_encoder = d.with_chance(0.5);
  m.sensors.load_torque = m.sensors.temperature = true;
}

// No designer lets the load swing slower than this on its gear.
double lowest_natural_frequency_hz(Kind kind, Dice& dice) {
  if (kind == Kind::satellite) return dice.between(2, 6);
  if (kind == Kind::cobot_without_output_encoder) return dice.between(18, 32);
  return dice.between(9, 18);
}

double account_cutoff_hz(Kind kind) {
  switch (kind) {
    case Kind::scara:
      return 35.0;
    case Kind::cobot_with_torque_sensors:
      return 30.0;
    case Kind::exoskeleton:
    case Kind::rotary_table:
      return 25.0;
    case Kind::telescope:
      return 4.0;
    case Kind::satellite:
      return 5.0;
    default:
      return 20.0;
  }
}

}  // namespace

std::string_view name_of(Kind kind) {
  constexpr std::array<std::string_view, kKinds.size()> kNames = {"cobot-with-torque-sensors",
                                                                  "cobot-without-output-encoder",
                                                                  "exoskeleton",
                                                                  "telescope",
                                                                  "scara",
                                                                  "rotary-table",
                                                                  "satellite",
                                                                  "bench"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view name_of(Presliding presliding) {
  return presliding == Presliding::known ? "known" : presliding == Presliding::short_travel ? "short" : "none";
}

std::string_view name_of(Balance balance) {
  return balance == Balance::motor ? "motor" : balance == Balance::transmission ? "transmission" : "load";
}

const std::vector<std::string_view>& candidates(Kind kind) {
  static const std::array<std::vector<std::string_view>, kKinds.size()> kCandidates = {{
      {"stribeck_gaussian", "viscous_asymmetry", "coulomb_asymmetry", "load_dependent_friction", "temperature_viscous",
       "torque_ripple", "torque_sensor_ripple", "cubic_stiffness", "dahl_hysteresis", "current_offset",
       "kinematic_error", "power_law_friction", "gravity"},
      {"stribeck_gaussian", "viscous_asymmetry", "coulomb_asymmetry", "temperature_viscous", "torque_ripple",
       "power_law_friction", "quadratic_drag", "gravity", "current_offset"},
      {"load_dependent_friction", "stribeck_gaussian", "power_law_friction", "torque_constant_saturation",
       "current_delay", "viscous_asymmetry", "coulomb_asymmetry", "torque_ripple"},
      {"presliding", "stribeck_gaussian", "torque_ripple", "coulomb_asymmetry", "gravity", "viscous_asymmetry"},
      {"current_delay", "torque_constant_saturation", "quadratic_drag", "viscous_asymmetry", "torque_ripple",
       "power_law_friction", "coulomb_asymmetry", "temperature_viscous"},
      {"torque_ripple", "coulomb_asymmetry", "stribeck_gaussian", "gravity", "torque_constant_saturation", "presliding",
       "power_law_friction"},
      {"temperature_viscous", "temperature_coulomb", "torque_ripple", "stribeck_gaussian", "viscous_asymmetry",
       "coulomb_asymmetry", "presliding"},
      {"load_dependent_friction", "stribeck_hess_soom", "torque_ripple", "quadratic_drag", "temperature_viscous",
       "coulomb_asymmetry", "torque_constant_saturation", "viscous_asymmetry"},
  }};
  return kCandidates[static_cast<std::size_t>(kind)];
}

Machine draw_kind(Kind kind, Dice& dice) {
  constexpr std::array<void (*)(Machine&, Dice&), kKinds.size()> kDraws = {draw_cobot_with_torque_sensors,
                                                                           draw_cobot_without_output_encoder,
                                                                           draw_exoskeleton,
                                                                           draw_telescope,
                                                                           draw_scara,
                                                                           draw_rotary_table,
                                                                           draw_satellite,
                                                                           draw_bench};
  Machine m;
  m.kind = kind;
  kDraws[static_cast<std::size_t>(kind)](m, dice);
  if (!m.plant.gear.rigid) {
    const double lowest = kTurn_rad * lowest_natural_frequency_hz(kind, dice);
    m.plant.load.inertia_kgm2 = std::min(m.plant.load.inertia_kgm2, m.plant.gear.stiffness_nm_rad / (lowest * lowest));
  }
  m.plant.friction.viscous_nms_rad = m.plant.friction.coulomb_nm / m.limits.velocity_rad_s * dice.between(0.5, 1.8);
  m.plant.friction.reference_velocity_rad_s = m.limits.velocity_rad_s;
  const bool fast = kind == Kind::scara || kind == Kind::cobot_with_torque_sensors || kind == Kind::exoskeleton;
  m.plant.step_s = fast ? 2.5e-5 : 5e-5;
  m.account_cutoff_hz = account_cutoff_hz(kind);
  return m;
}

double draw_bandwidth_rad_s(const Machine& machine, Dice& dice) {
  const auto drawn_hz = [&] {
    switch (machine.kind) {
      case Kind::telescope:
        return dice.between(0.6, 1.5);
      case Kind::satellite:
        return dice.between(0.5, 0.9);
      case Kind::rotary_table:
        return dice.between(6, 12);
      case Kind::scara:
        return dice.between(8, 14);
      default:
        return dice.between(4, 8);
    }
  };
  const double bandwidth = kTurn_rad * drawn_hz();
  if (machine.plant.gear.rigid) return bandwidth;
  return std::min(bandwidth, 0.5 * std::sqrt(machine.plant.gear.stiffness_nm_rad / machine.plant.load.inertia_kgm2));
}

}  // namespace flexspline::worlds::machines
