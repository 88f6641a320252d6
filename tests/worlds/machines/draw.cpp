#include "tests/worlds/machines/draw.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/worlds/machines/hidden.hpp"
#include "tests/worlds/machines/kinds.hpp"
#include "tests/worlds/machines/records.hpp"

namespace flexspline::worlds::machines {
namespace {

constexpr std::size_t kPositionTable = 4096;
constexpr int kPositionWaves = 40;

// Not in the model and below what most logs resolve, unless it is the base model's own.
void draw_presliding(Machine& m, Dice& dice) {
  FrictionParameters& f = m.plant.friction;
  const bool hidden = m.hidden && m.hidden->effect == "presliding";
  const bool direct = m.kind == Kind::telescope || m.kind == Kind::rotary_table;
  m.presliding = direct && !hidden && dice.with_chance(0.35) ? Presliding::known
                 : !hidden && dice.with_chance(0.5)          ? Presliding::short_travel
                                                             : Presliding::none;
  if (m.presliding == Presliding::known) {
    f.presliding_rad = m.limits.range_rad * dice.scale_between(3e-3, 1.5e-2);
  } else if (m.presliding == Presliding::short_travel) {
    f.presliding_rad = m.limits.range_rad * dice.scale_between(4e-6, 3e-5);
    f.maxwell_slip = dice.with_chance(0.4);
  } else {
    // As stiff as the step allows, and damped, so that it turns round without a trace in the log.
    const double rate = 0.35 / m.plant.step_s;
    const double stiffness = m.plant.rotor_inertia_kgm2 * rate * rate;
    f.presliding_rad = f.coulomb_nm / stiffness;
    f.bristle_damping_nms_rad = 0.6 * std::sqrt(stiffness * m.plant.rotor_inertia_kgm2);
  }
}

void draw_friction_imperfections(Machine& m, Dice& dice) {
  FrictionParameters& f = m.plant.friction;
  std::vector<double> orders = {1, 2, 4, 6, 12};
  dice.shuffle(orders);
  for (std::size_t k = 0; k < 2; ++k) {
    const double amplitude = f.coulomb_nm * dice.scale_between(0.001, 0.008), phase = dice.angle();
    m.plant.ripples_nm.push_back({orders[k], amplitude * std::cos(phase), amplitude * std::sin(phase)});
  }
  f.position_period_rad = 3.0 * m.limits.range_rad * dice.between(0.3, 1.5);
  f.over_position.assign(kPositionTable, 0.0);
  for (int wave = 1; wave <= kPositionWaves; ++wave) {
    const double amplitude = dice.normal() / std::sqrt(wave), phase = dice.angle();
    for (std::size_t k = 0; k < kPositionTable; ++k)
      f.over_position[k] += amplitude * std::sin(kTurn_rad * wave * static_cast<double>(k) / kPositionTable + phase);
  }
  const double size = dice.between(0.003, 0.012) * (m.stress ? 2.5 : 1.0) / standard_deviation(f.over_position);
  for (double& v : f.over_position) v *= size;
  // Where no column shows it, the temperature is what differs between the records.
  f.viscous_temperature_1_k = m.sensors.temperature ? dice.scale_between(4e-4, 1.5e-3) : 2e-3;
  f.coulomb_temperature_1_k = 0.5 * f.viscous_temperature_1_k;
}

void draw_encoder(Machine& m, Dice& dice) {
  EncoderParameters& e = m.plant.encoder;
  e.step_rad = kTurn_rad / m.sensors.encoder_counts;
  e.eccentricity_rad = m.sensors.encoder_counts < 3e5 ? e.step_rad * dice.between(0.0, 0.6) : dice.between(1e-6, 6e-6);
  if (m.stress) e.eccentricity_rad *= 6.0;
  e.eccentricity_phase_rad = dice.angle();
  e.noise_rad = e.step_rad * dice.between(0.05, 0.4);
}

void draw_electric(Machine& m, Dice& dice) {
  ElectricParameters& e = m.plant.electric;
  Sensors& s = m.sensors;
  const FrictionParameters& f = m.plant.friction;
  double gravity_nm = m.plant.load.gravity_sine_nm;
  if (m.hidden && m.hidden->effect == "gravity") gravity_nm = std::max(gravity_nm, 5.0);
  const double torque_nm = m.plant.total_inertia_kgm2() * m.limits.acceleration_rad_s2 + 2.5 * f.coulomb_nm +
                           f.viscous_nms_rad * m.limits.velocity_rad_s +
                           (gravity_nm + m.bench_torque_nm + m.human_torque_nm) / m.plant.gear.ratio;
  m.rated_current_a = torque_nm / e.torque_constant_nm_a;
  const bool fast = s.sample_hz > 150.0;
  e.limit_a = 3.0 * m.rated_current_a;
  e.step_a = e.limit_a / std::exp2(14);
  e.time_constant_s = fast ? dice.between(1.5e-4, 5e-4) : 1e-3;
  e.delay_s = fast ? dice.one_of({0.0, 5e-5, 1e-4}) : 0.0;
  s.current_step_a = e.limit_a / dice.power_of_two(12, 14);
  s.current_noise_a = m.rated_current_a * dice.scale_between(0.002, 0.01);
  s.current_coloured_a = m.rated_current_a * dice.scale_between(0.002, 0.008) * (m.stress ? 2.0 : 1.0);
  s.current_corner_hz = dice.scale_between(0.3, 0.08 * s.sample_hz);
  if (m.stress) s.current_corner_hz = std::min(s.current_corner_hz, 3.0);
}

void draw_sensors(Machine& m, Dice& dice) {
  Sensors& s = m.sensors;
  if (s.output_encoder) s.output_eccentricity_rad = dice.scale_between(3e-6, 1.5e-5);
  // A constant beside a constant could not be distinguished.
  const bool constant_hidden =
      m.hidden && (m.hidden->effect == "coulomb_asymmetry" || m.hidden->effect == "current_offset");
  m.base.torque_offset = s.torque && dice.with_chance(0.5) && !constant_hidden;
  if (m.base.torque_offset) s.torque_offset_nm = dice.between(-0.3, 0.3);
  s.jitter = dice.scale_between(0.005, 0.05);
  s.stamps_are_true = dice.with_chance(0.5);
}

void draw_controller(Machine& m, Dice& dice) {
  ControllerParameters& c = m.plant.controller;
  c.bandwidth_rad_s = draw_bandwidth_rad_s(m, dice);
  c.velocity_filter = 1.0 - std::exp(-kTurn_rad * std::max(80.0, 2.0 * c.bandwidth_rad_s) / kControlRate_hz);
  c.inertia_feedforward = dice.between(0.85, 1.1);
  c.viscous_feedforward = dice.between(0.8, 1.1);
  c.coulomb_feedforward = dice.between(0.7, 1.0);
}

}  // namespace

Machine draw_machine(std::uint64_t seed, int draw, Kind kind, bool stress) {
  Dice dice(seed * 1000003ull + static_cast<std::uint64_t>(draw) * 7919ull);
  Machine m = draw_kind(kind, dice);
  m.seed = seed;
  m.draw = draw;
  m.stress = stress;
  if (dice.with_chance(0.5)) m.hidden = draw_hidden(m, dice);
  if (m.hidden && m.hidden->effect == "gravity") {
    m.base.gravity = false;
    m.plant.load.gravity_cosine_nm = m.plant.load.gravity_sine_nm = 0.0;
    if (kind == Kind::cobot_with_torque_sensors) m.base.load = true;
  }
  draw_presliding(m, dice);
  draw_encoder(m, dice);
  draw_electric(m, dice);
  draw_sensors(m, dice);
  draw_friction_imperfections(m, dice);
  draw_controller(m, dice);
  draw_records(m, dice);
  m.plain_plant = m.plant;
  m.plain_sensors = m.sensors;
  return m;
}

}  // namespace flexspline::worlds::machines
