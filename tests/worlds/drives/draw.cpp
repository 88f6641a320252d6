#include "tests/worlds/drives/draw.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace flexspline::worlds::drives {
namespace {

double in(Random& random, const Range& range) {
  return range.low > 0.0 ? random.log_uniform(range.low, range.high) : 0.0;
}

double whole_inertia_kgm2(const Mechanics& m) {
  return m.motor_inertia_kgm2 + m.output_inertia_kgm2 / (m.gear_ratio * m.gear_ratio);
}

bool is_direct(const Kind& kind) {
  return kind.name == "rotary-table" || kind.name == "gimbal";
}

void draw_mechanics(Case& drive, const Kind& kind, bool hides, Random& random) {
  Mechanics& m = drive.mechanics;
  m.gear_ratio = kind.gear_ratio.low == kind.gear_ratio.high ? kind.gear_ratio.low
                                                             : std::round(in(random, kind.gear_ratio) * 10.0) / 10.0;
  m.torque_constant_nm_a = in(random, kind.torque_constant_nm_a);
  m.motor_inertia_kgm2 = in(random, kind.motor_inertia_kgm2);
  m.output_inertia_kgm2 = m.motor_inertia_kgm2 * in(random, kind.inertia_ratio) * m.gear_ratio * m.gear_ratio;
  drive.rated_current_a = in(random, kind.rated_current_a);
  drive.rated_velocity_rad_s = in(random, kind.rated_velocity_rad_s);
  m.is_rigid = kind.antiresonance_hz.high == 0.0;
  if (!m.is_rigid) {
    const double antiresonance_rad_s = kTurn * in(random, kind.antiresonance_hz);
    m.stiffness_nm_rad = m.output_inertia_kgm2 * antiresonance_rad_s * antiresonance_rad_s;
    m.damping_nms_rad = 2.0 * random.uniform(0.01, 0.05) * m.stiffness_nm_rad / antiresonance_rad_s;
  }
  const double rated_nm = m.torque_constant_nm_a * drive.rated_current_a;
  FrictionLaw& f = m.friction;
  f.coulomb_nm = rated_nm * in(random, kind.coulomb_share);
  f.viscous_nms_rad = rated_nm * in(random, kind.viscous_share) / drive.rated_velocity_rad_s;
  f.reference_velocity_rad_s = drive.rated_velocity_rad_s;
  f.presliding_rad = in(random, kind.presliding_rad);
  // It often is the larger of the two, and what is hidden is to be seen.
  if (random.chance(kind.presliding_chance * (hides ? 0.3 : 1.0))) f.presliding = Presliding::kElastoPlastic;
  if (kind.name == "leg") {
    drive.models_gravity = true;
    m.gravity_nm = rated_nm * m.gear_ratio * random.uniform(0.06, 0.25);
    m.gravity_phase_rad = random.uniform(-0.5, 0.5);
  }
  if (kind.name == "cable-instrument") f.load_coefficient = random.uniform(0.02, 0.12);
}

void draw_ripple(Case& drive, const Kind& kind, Random& random) {
  drive.pole_pairs =
      kind.name == "leg" ? random.integer(14, 21) : (is_direct(kind) ? random.integer(7, 16) : random.integer(3, 5));
  if (!random.chance(is_direct(kind) ? 0.6 : 0.25)) return;
  const double size = drive.mechanics.friction.coulomb_nm * random.log_uniform(0.005, 0.03);
  const double phase = random.uniform(0.0, kTurn);
  const double order = random.chance(0.4) ? 1.0 : (random.chance(0.5) ? 2.0 : 6.0) * drive.pole_pairs;
  drive.residual_ripples = {{order, size * std::cos(phase), size * std::sin(phase)}};
  drive.mechanics.ripples = drive.residual_ripples;
}

void draw_sensors(Case& drive, const Kind& kind, Random& random) {
  Sensors& s = drive.sensors;
  s.rate_hz = random.one_of(kind.rates_hz);
  s.motor_counts = random.one_of(kind.motor_counts);
  const bool is_fine = s.motor_counts > 1e5;
  if (random.chance(0.5))
    s.eccentricity_rad = is_fine ? random.log_uniform(3e-6, 5e-5) : random.log_uniform(3e-5, 6e-4);
  s.eccentricity_phase_rad = random.uniform(0.0, kTurn);
  s.has_velocity = random.chance(0.4);
  s.velocity_noise_rad_s = drive.rated_velocity_rad_s * kind.used_velocity.high * random.log_uniform(3e-4, 3e-3);
  s.current_noise_a = drive.rated_current_a * random.log_uniform(0.002, 0.012);
  s.current_step_a = 2.0 * drive.control.current_limit_a / (random.chance(0.5) ? 4096.0 : 65536.0);
  const double period_s = 1.0 / s.rate_hz;
  // Later than this would be a fault of the log and not an imperfection.
  const double most_s = kind.name == "antenna" ? 0.006 : 0.0015;
  const double late_s = std::min(most_s, random.uniform(0.3, 4.0) * period_s);
  const int way = random.integer(0, 3);
  if (way == 0) s.position_delay_s = late_s;
  if (way == 1) s.current_delay_s = late_s;
  if (way == 2) s.current_filter_s = std::min(0.75 * most_s, random.uniform(0.3, 2.0) * period_s);
  if (random.chance(0.4)) s.jitter_s = random.uniform(0.002, 0.01) * period_s;
  s.states_jitter = random.chance(0.6);
  s.has_temperature = random.chance(0.35);
  s.knows_zero = kind.name == "leg" || random.chance(0.7);
  if (kind.name == "leg" && random.chance(0.4)) s.output_counts = random.chance(0.5) ? 16384.0 : 131072.0;
  if (kind.name == "antenna" && random.chance(0.5)) s.output_counts = random.chance(0.5) ? 1048576.0 : 16777216.0;
  if (kind.name == "cable-instrument" && random.chance(0.3)) s.output_counts = 65536.0;
  if (kind.name == "ball-screw" && random.chance(0.3)) s.output_counts = 100000.0;
}

void draw_control(Case& drive, const Kind& kind, Random& random) {
  const Mechanics& m = drive.mechanics;
  ControlSettings& c = drive.control;
  const bool is_slow = kind.name == "antenna";
  const double control_hz = is_slow ? (random.chance(0.5) ? 500.0 : 1000.0) : 2000.0 * random.integer(1, 3);
  c.period_s = 1.0 / control_hz;
  drive.step_s = c.period_s / std::ceil(c.period_s / (is_slow ? 1.25e-4 : 5e-5) - 1e-9);
  const double rated_emf_v = m.torque_constant_nm_a * drive.rated_velocity_rad_s;
  c.resistance_ohm = random.uniform(0.1, 0.2) * rated_emf_v / drive.rated_current_a;
  c.inductance_h = c.resistance_ohm * random.uniform(5e-4, 3e-3);
  c.bus_voltage_v = 1.4 * rated_emf_v + c.resistance_ohm * c.current_limit_a;
  c.current_bandwidth_rad_s = kTurn * (is_slow ? random.uniform(80.0, 200.0) : random.uniform(200.0, 600.0));
  const double inertia = whole_inertia_kgm2(m);
  const double crossing = inertia / m.motor_inertia_kgm2;  // the loop is that much faster above the resonance
  double bandwidth_rad_s = kTurn * random.uniform(5.0, 22.0);
  if (!m.is_rigid) bandwidth_rad_s = std::sqrt(m.stiffness_nm_rad / m.output_inertia_kgm2) * random.uniform(0.15, 0.35);
  bandwidth_rad_s = std::min(bandwidth_rad_s, 0.25 / (c.period_s * (m.is_rigid ? 1.0 : crossing)));
  // The encoder's steps are to make no more than a fifteenth of the rated current.
  const double step_rad = kTurn / drive.sensors.motor_counts;
  const double quiet_rad_s =
      std::sqrt(drive.rated_current_a / 15.0 * m.torque_constant_nm_a / (inertia * 8.0 * step_rad));
  bandwidth_rad_s = std::min(bandwidth_rad_s, quiet_rad_s);
  c.velocity_gain_as_rad = inertia * bandwidth_rad_s / m.torque_constant_nm_a;
  c.velocity_filter_rad_s = 8.0 * bandwidth_rad_s;
  c.integral_rate_1_s = bandwidth_rad_s / random.uniform(4.0, 8.0);
  c.position_gain_1_s = bandwidth_rad_s / random.uniform(4.0, 7.0);
  if (random.chance(0.5)) c.feedforward_as2_rad = inertia / m.torque_constant_nm_a * random.uniform(0.7, 1.0);
}

void draw_disturbances(Case& drive, const Kind& kind, Random& random) {
  const double coulomb_nm = drive.mechanics.friction.coulomb_nm;
  drive.disturbances = {coulomb_nm * random.log_uniform(0.005, 0.05), random.log_uniform(0.5, 40.0), 0.0, 0.1};
  if (kind.name != "antenna") return;
  drive.disturbances.wind_nm = coulomb_nm * drive.mechanics.gear_ratio * random.uniform(0.03, 0.15);
  drive.disturbances.wind_hz = random.uniform(0.05, 0.4);
}

/// The brake of the bench: its load is measured by a flange behind the gear, by the brake itself, or not at all.
struct Bench {
  bool has_brake = false;
  double most_nm = 0.0;
};

Bench draw_bench(Case& drive, const Kind& kind, std::string_view hidden, Random& random) {
  if (kind.name != "dynamometer") return {};
  int way = random.integer(0, 2);
  if (hidden == "cubic_stiffness" || hidden == "backlash") way = 0;
  if (hidden == "load_dependent_friction") way = random.integer(0, 1);
  const double rated_nm = drive.mechanics.torque_constant_nm_a * drive.rated_current_a * drive.mechanics.gear_ratio;
  drive.sensors.torque_noise_nm = rated_nm * random.uniform(0.001, 0.004);
  if (way == 0) {
    drive.sensors.has_torque = true;
    drive.sensors.output_counts = random.chance(0.5) ? 1048576.0 : 4194304.0;
  }
  if (way == 1) drive.sensors.has_load_torque = true;
  const double unmeasured_nm =
      drive.mechanics.friction.coulomb_nm * drive.mechanics.gear_ratio * random.uniform(0.02, 0.12);
  return {true, way == 2 ? unmeasured_nm : rated_nm * random.uniform(0.25, 0.6)};
}

Brake draw_brake(const Bench& bench, Random& random) {
  Brake brake;
  if (!bench.has_brake || random.chance(0.2)) return brake;
  brake.is_wave = random.chance(0.3);
  const int levels = brake.is_wave ? 1 : random.integer(1, 5);
  for (int k = 0; k < levels; ++k)
    brake.levels_nm.push_back(bench.most_nm * random.uniform(0.05, brake.is_wave ? 0.55 : 1.0));
  return brake;
}

RecordPlan draw_record(const Case& drive, const Kind& kind, const Bench& bench, std::size_t place, Random& random) {
  RecordPlan plan;
  const Mechanics& m = drive.mechanics;
  MotionRequest request;
  request.name = kind.motions[place % kind.motions.size()];
  request.duration_s = random.uniform(kind.record_s.low, kind.record_s.high);
  request.period_s = drive.control.period_s;
  request.low_hz = kind.band_hz.low;
  request.high_hz = kind.band_hz.high;
  request.limits.velocity_rad_s = drive.rated_velocity_rad_s * in(random, kind.used_velocity);
  // Saturation shows only where the motor is used in full.
  const double used =
      drive.hidden.effect == "torque_constant_saturation" ? random.uniform(0.9, 1.6) : random.uniform(0.25, 0.8);
  const double free_nm = used * m.torque_constant_nm_a * drive.rated_current_a - m.friction.coulomb_nm;
  request.limits.acceleration_rad_s2 = free_nm / whole_inertia_kgm2(m);
  request.limits.range_rad = kTurn * m.gear_ratio * in(random, kind.range_turns);
  plan.motion = make_motion(request, random);
  plan.start_rad = m.gear_ratio * (drive.models_gravity || kind.name == "gimbal" ? random.uniform(-0.4, 0.4)
                                                                                 : random.uniform(0.0, kTurn));
  plan.brake = draw_brake(bench, random);
  plan.noise_seed = random.bits();
  return plan;
}

void draw_records(Case& drive, const Kind& kind, const Bench& bench, Random& random) {
  const int fitted = random.integer(4, 10);
  const int held_out = random.integer(2, 4);
  const double coulomb_spread = random.uniform(0.003, 0.03);
  const double viscous_spread = random.uniform(0.005, 0.05);
  const double warming = drive.sensors.has_temperature ? 0.0 : random.uniform(0.0, 0.06);
  const double wide_c = drive.hidden.effect == "temperature_viscous" ? 16.0 : 8.0;
  const auto first = static_cast<std::size_t>(random.integer(0, 5));
  for (int k = 0; k < fitted + held_out; ++k) {
    RecordPlan plan = draw_record(drive, kind, bench, first + static_cast<std::size_t>(k), random);
    plan.is_holdout = k >= fitted;
    plan.name = (plan.is_holdout ? "holdout-" : "fit-") + std::to_string(plan.is_holdout ? k - fitted + 1 : k + 1);
    const double done = static_cast<double>(k) / (fitted + held_out);
    plan.coulomb_scale = 1.0 + coulomb_spread * random.normal();
    plan.viscous_scale = (1.0 + viscous_spread * random.normal()) * (1.0 - warming * done);
    plan.drift_share = -0.3 * warming;
    plan.temperature_start_c = drive.reference_c + random.uniform(-wide_c, wide_c);
    plan.temperature_end_c = plan.temperature_start_c + random.uniform(0.1, 2.5);
    drive.records.push_back(std::move(plan));
  }
}

}  // namespace

Case draw(const Kind& kind, std::uint64_t seed, int attempt) {
  Random what(seed, std::string(kind.name) + " hides");
  const std::string_view effect = what.chance(0.5) ? std::string_view{} : what.one_of(kind.hidden);
  Random random(seed, std::string(kind.name) + " " + std::to_string(attempt));
  Case drive;
  drive.kind = kind.name;
  drive.seed = seed;
  drive.drawn_again = attempt;
  draw_mechanics(drive, kind, !effect.empty(), random);
  draw_ripple(drive, kind, random);
  drive.control.current_limit_a = drive.rated_current_a * random.uniform(1.7, 3.0);
  draw_sensors(drive, kind, random);
  draw_control(drive, kind, random);
  draw_disturbances(drive, kind, random);
  const Bench bench = draw_bench(drive, kind, effect, random);
  if (!effect.empty()) hide(drive, kind, effect, random);
  draw_records(drive, kind, bench, random);
  return drive;
}

}  // namespace flexspline::worlds::drives
