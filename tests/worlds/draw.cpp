#include "tests/worlds/draw.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::worlds {
namespace {

double peak_velocity(const Twin& twin) {
  double peak = 0.0;
  for (const Record& r : twin.fit)
    for (double t = 0.0; t < r.trajectory.duration_s(); t += 0.02)
      peak = std::max(peak, std::abs(r.trajectory.at(t).velocity));
  return peak * twin.joint.gear_ratio;
}

void draw_joint(Twin& twin, Random& random) {
  Joint& j = twin.joint;
  j.gear_ratio = random.one_of({50.0, 80.0, 100.0, 100.0, 120.0, 160.0});
  j.rated_torque = random.log_uniform(5.0, 100.0);
  const double rated = j.rated_torque / 40.0, ratio = 100.0 / j.gear_ratio;
  j.torque_constant = j.rated_torque / j.gear_ratio / random.uniform(2.0, 8.0);
  j.motor_inertia = 1e-4 * std::pow(rated, 1.2) * random.uniform(0.5, 2.0);
  j.load_inertia = j.rated_torque * random.log_uniform(0.003, 0.03);
  j.coulomb = 0.045 * rated * ratio * random.uniform(0.5, 1.8);
  j.viscous = 3.5e-4 * rated * ratio * random.uniform(0.4, 2.5);
  j.law = random.one_of({PreslidingLaw::dahl, PreslidingLaw::lugre, PreslidingLaw::elastoplastic,
                         PreslidingLaw::maxwell_slip, PreslidingLaw::set_valued_and_bristles});
  j.presliding_length = random.log_uniform(0.01, 0.6);
  if (random.chance(0.2)) j.presliding_growth = random.uniform(1.0, 5.0);
}

void draw_sensors(Twin& twin, Random& random) {
  Sensors& s = twin.sensors;
  s.sample_hz = random.chance(0.15) ? 1000.0 : random.one_of({100.0, 125.0, 200.0, 250.0, 400.0, 500.0});
  s.jitter = random.chance(0.4) ? 0.0 : random.uniform(0.02, 0.25);
  s.stamps_are_true = random.chance(0.7);
  s.effort_noise = random.log_uniform(0.01, 0.05);
  s.coloured = random.chance(0.5);
  s.effort_bits = random.integer(8, 13);
  s.torque_noise = random.log_uniform(0.003, 0.02);
  if (twin.family == "joint-side" || (twin.family != "clean-free-load" && random.chance(0.55)))
    twin.units = random.chance(0.4) ? Units::joint : Units::scaled_joint;
  s.encoder_bits = twin.units == Units::motor ? random.integer(12, 17) : random.integer(14, 17);
  s.velocity_column = random.chance(0.5);
  s.velocity_lag_s = random.uniform(0.0, 0.02);
  s.torque_column = twin.family == "torque-sensor" || random.chance(0.25);
  s.temperature_column = random.chance(0.25);
  if (random.chance(0.2)) s.effort_lag_samples = random.uniform(-3.0, 3.0);
}

// The dirt that the family "clean-free-load" is without.
void clean(Twin& twin) {
  Sensors& s = twin.sensors;
  s.sample_hz = 1000.0;
  s.jitter = s.effort_lag_samples = 0.0;
  s.stamps_are_true = true;
  s.effort_noise = 0.005;
  s.coloured = false;
  s.effort_bits = 14;
  s.torque_noise = 0.01;
  s.encoder_bits = 14;
  s.velocity_column = s.temperature_column = false;
  s.torque_column = true;
  twin.joint.presliding_length = std::min(twin.joint.presliding_length, 0.1);
}

double record_length(const Twin& twin, int records, Random& random) {
  const double all = twin.sensors.sample_hz > 500.0 ? 30.0 : 60.0;
  return std::clamp(random.uniform(4.0, 20.0), 4.0, std::max(4.0, all / (records + 1)));
}

void draw_records(Twin& twin, Random& random) {
  int records = random.integer(1, 6);
  if (twin.family == "few-records") records = random.integer(1, 2);
  if (twin.family == "by-direction") records = random.integer(3, 6);
  const bool one_way = twin.family == "one-direction" || (twin.family == "robot-like" && random.chance(0.15));
  twin.motion = one_way ? MotionKind::one_direction
                        : random.one_of({MotionKind::multisine, MotionKind::multisine, MotionKind::trapezoids,
                                         MotionKind::trapezoids, MotionKind::slow_sweep});
  twin.same_trajectory = !one_way && random.chance(0.35);
  const double peak =
      twin.motion == MotionKind::slow_sweep ? random.log_uniform(0.1, 0.5) : random.log_uniform(0.3, 1.5);
  double length = record_length(twin, records, random);
  if (one_way) length = std::min(length, 1.5 / (0.6 * peak) + 0.6);
  const bool both_ways = random.chance(0.6);
  twin.friction_difference = random.one_of({0.0, 0.03, 0.03, 0.1});
  if (twin.family == "by-direction") twin.friction_difference = random.one_of({0.03, 0.1});
  if (twin.family == "clean-free-load") twin.friction_difference = random.one_of({0.0, 0.03});
  const double direction = random.sign();
  const double common_share = random.one_of({0.0, 0.5, 1.0});  // of the spread that both directions share
  const bool disturbed = twin.family != "clean-free-load";
  const double coloured = disturbed && random.chance(0.5) ? random.uniform(0.005, 0.03) * twin.joint.coulomb : 0.0;
  const double drift =
      disturbed && !twin.sensors.temperature_column && random.chance(0.2) ? random.uniform(0.03, 0.15) : 0.0;
  const bool pulses = disturbed && random.chance(0.15);
  const double rise = twin.sensors.temperature_column ? random.uniform(2.0, 10.0) : 0.0;
  const double external =
      twin.sensors.torque_column && disturbed ? twin.joint.rated_torque * random.uniform(0.03, 0.3) : 0.0;
  Trajectory first;
  for (int k = 0; k <= records; ++k) {
    const bool holdout = k == records;
    Record r;
    r.name = holdout ? "holdout-1" : "run-" + std::to_string(k + 1);
    const double way = both_ways && k % 2 == 1 ? -direction : direction;
    r.trajectory =
        Trajectory::draw(twin.motion, length, peak * (one_way ? random.uniform(0.6, 1.0) : 1.0), way, random);
    if (k == 0) first = r.trajectory;
    if (twin.same_trajectory && !holdout) r.trajectory = first;
    RecordConditions& c = r.conditions;
    const double spread = twin.friction_difference;
    const double common = spread * common_share * random.normal();
    const double own = spread * std::sqrt(1.0 - common_share * common_share);
    c.friction_forward = std::max(0.5, 1.0 + common + own * random.normal());
    c.friction_backward = std::max(0.5, 1.0 + common + own * random.normal());
    c.temperature_start_c = k * rise;
    c.temperature_rise_c = rise;
    c.viscous_drift = drift;
    c.coloured_friction = coloured;
    c.external_torque = external;
    if (pulses && !holdout)
      for (int n = random.integer(1, 4); n > 0; --n) c.pulses_s.push_back(random.uniform(0.5, length - 0.5));
    c.pulse_torque = 3.0 * twin.joint.coulomb * random.sign();
    c.seed = twin.seed * 64 + static_cast<std::uint64_t>(k) + 1;
    (holdout ? twin.holdout : twin.fit.emplace_back()) = std::move(r);
  }
  twin.joint.power_velocity = peak_velocity(twin);
}

// A candidate is offered where these signals could show it.
std::vector<HiddenEffect> possible(const Twin& twin, Random& random) {
  const bool one_way = twin.motion == MotionKind::one_direction;
  const bool loaded = twin.sensors.torque_column || twin.gravity_in_base;
  const bool current = twin.units != Units::joint;
  const double peak = twin.joint.power_velocity;
  std::vector<HiddenEffect> all;
  const auto offer = [&](bool can, std::string_view effect, std::vector<std::string> others = {}) {
    if (!can) return;
    HiddenEffect h;
    h.effect = effect;
    h.accepted = std::move(others);
    h.accepted.insert(h.accepted.begin(), h.effect);
    all.push_back(std::move(h));
  };
  offer(!one_way, "stribeck_gaussian", {"stribeck_hess_soom"});
  offer(!one_way, "stribeck_gaussian", {"stribeck_hess_soom"});
  offer(!one_way, "viscous_asymmetry");
  offer(!one_way && !twin.offset_in_base, "coulomb_asymmetry", {"current_offset", "torque_bias"});
  offer(!one_way, "power_law_friction");
  offer(!one_way, "power_law_friction");
  offer(!one_way, "quadratic_drag");
  offer(!one_way && loaded && twin.family != "clean-free-load", "load_dependent_friction");
  offer(!one_way && loaded && twin.family != "clean-free-load", "load_dependent_friction");
  if (current) {
    for (const int order : {2, random.one_of({4, 6, 12})}) {
      // Seen where most of the motion keeps it well within the band.
      const double at_hz = order * 0.6 * peak / kTurn;
      if (at_hz >= 0.25 * twin.sensors.sample_hz) continue;
      offer(true, "torque_ripple", {"kinematic_error", "load_scaled_ripple"});
      all.back().order = order;
      if (twin.sensors.torque_column) all.back().accepted.push_back("torque_sensor_ripple");
    }
  }
  offer(!twin.gravity_in_base && !twin.sensors.torque_column, "gravity");
  offer(!twin.gravity_in_base && !twin.sensors.torque_column, "gravity");
  offer(!one_way && !twin.offset_in_base && current, "current_offset", {"coulomb_asymmetry", "torque_bias"});
  offer(!one_way && current, "torque_constant_saturation");
  offer(!one_way && twin.sensors.torque_column && twin.family != "clean-free-load", "torque_sensor_gain",
        {"torque_constant_error"});
  offer(!one_way && twin.sensors.temperature_column && twin.fit.size() > 1, "temperature_viscous",
        {"temperature_coulomb"});
  offer(!one_way && twin.sensors.temperature_column && twin.fit.size() > 1, "temperature_coulomb",
        {"temperature_viscous"});
  return all;
}

void draw_hidden(Twin& twin, Random& random) {
  if (twin.family == "nothing-hidden" || random.chance(0.4)) return;
  const int count = random.chance(0.15) ? 2 : 1;
  for (int k = 0; k < count; ++k) {
    std::vector<HiddenEffect> all = possible(twin, random);
    // Two of one class would be one.
    std::erase_if(all, [&](const HiddenEffect& h) {
      return std::any_of(twin.hidden.begin(), twin.hidden.end(), [&](const HiddenEffect& other) {
        return std::find(other.accepted.begin(), other.accepted.end(), h.effect) != other.accepted.end();
      });
    });
    if (all.empty()) return;
    HiddenEffect h = all[static_cast<std::size_t>(random.integer(0, static_cast<int>(all.size()) - 1))];
    h.wanted_share = random.one_of({0.05, 0.1, 0.15, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}) / (1.0 + k);
    twin.hidden.push_back(std::move(h));
  }
}

void draw_second(Twin& twin, Random& random) {
  if (twin.family != "second-structure" && (twin.family == "clean-free-load" || !random.chance(0.25))) return;
  Joint& j = twin.joint;
  j.second =
      random.one_of({SecondStructure::bump_over_angle, SecondStructure::creep, SecondStructure::neighbour_vibration,
                     SecondStructure::friction_that_lags, SecondStructure::wave_over_travel});
  twin.second_share_wanted = random.uniform(0.1, 0.4);
  j.second_place = random.uniform(-0.8, 0.8);
  switch (j.second) {
    case SecondStructure::neighbour_vibration:
    case SecondStructure::wave_over_travel:
      j.second_width = random.uniform(4.0, 12.0);  // Hz; 1/rad
      break;
    case SecondStructure::bump_over_angle:
      j.second_width = random.uniform(0.1, 0.4);
      break;
    default:
      j.second_width = random.uniform(0.4, 2.0);  // s
      break;
  }
}

}  // namespace

Twin draw(std::uint64_t seed, std::string_view family) {
  Random random(seed);
  Twin twin;
  twin.seed = seed;
  twin.family = family;
  draw_joint(twin, random);
  draw_sensors(twin, random);
  if (family == "clean-free-load") clean(twin);
  Joint& j = twin.joint;
  const bool gravity = family != "clean-free-load" && random.chance(0.5);
  if (gravity) {
    const double size = j.rated_torque * random.uniform(0.05, 0.4), phase = random.uniform(0.0, kTurn);
    j.gravity_cosine = size * std::cos(phase);
    j.gravity_sine = size * std::sin(phase);
    twin.gravity_in_base = !twin.sensors.torque_column;
  }
  if (family == "elastic-load" || (family == "robot-like" && random.chance(0.2))) {
    const double rate = kTurn * random.log_uniform(10.0, 40.0);
    ElasticLoad e;
    e.stiffness = j.load_inertia * rate * rate;
    e.damping = 2.0 * random.uniform(0.04, 0.15) * j.load_inertia * rate;
    e.coulomb = j.rated_torque * random.uniform(0.0, 0.02);
    e.viscous = e.coulomb * random.uniform(0.0, 1.0);
    j.elastic = e;
  }
  twin.offset_in_base = random.chance(0.5);
  if (twin.offset_in_base) twin.sensors.current_offset = random.uniform(-0.3, 0.3) * j.coulomb / j.torque_constant;
  twin.controller.bandwidth_hz = random.uniform(6.0, 20.0);
  // A loop must not be faster than the elastic load lets it.
  if (j.elastic) twin.controller.bandwidth_hz = random.uniform(1.5, 3.0);
  twin.controller.feedforward_error = random.uniform(-0.2, 0.2);
  draw_records(twin, random);
  draw_hidden(twin, random);
  draw_second(twin, random);
  for (HiddenEffect& h : twin.hidden) {
    if (h.effect == "stribeck_gaussian") j.stribeck_velocity = j.power_velocity * random.log_uniform(0.03, 0.15);
    if (h.effect == "power_law_friction") j.power_exponent = random.uniform(0.35, 0.7);
    if (h.effect == "torque_ripple") j.ripple = Ripple{h.order, 0.0, random.uniform(0.0, kTurn)};
  }
  return twin;
}

double largest_size(const Twin& twin, const HiddenEffect& effect) {
  const Joint& j = twin.joint;
  const std::string& e = effect.effect;
  if (e == "stribeck_gaussian") return 0.6 * j.coulomb;
  if (e == "viscous_asymmetry") return 0.5 * j.viscous;
  if (e == "coulomb_asymmetry") return 0.35 * j.coulomb;
  if (e == "power_law_friction") return 2.0 * j.coulomb;
  if (e == "quadratic_drag") return 1.5 * j.coulomb / (j.power_velocity * j.power_velocity);
  if (e == "load_dependent_friction") return 0.15;
  if (e == "torque_ripple") return 0.5 * j.coulomb;
  if (e == "gravity") return 0.4 * j.rated_torque;
  if (e == "current_offset") return 0.5 * j.coulomb / j.torque_constant;
  if (e == "torque_constant_saturation") {
    // A quarter of the torque at half the rated torque's current.
    const double current = 0.5 * j.rated_torque / j.gear_ratio / j.torque_constant;
    return 0.25 / (current * current);
  }
  if (e == "torque_sensor_gain") return 0.15;
  return 0.04;  // of a temperature, 1/degC
}

void set_size(Twin& twin, const HiddenEffect& effect, double size) {
  Joint& j = twin.joint;
  const std::string& e = effect.effect;
  if (e == "stribeck_gaussian") j.stribeck = size;
  if (e == "viscous_asymmetry") j.viscous_asymmetry = size;
  if (e == "coulomb_asymmetry") j.coulomb_asymmetry = size;
  if (e == "power_law_friction") j.power_torque = size;
  if (e == "quadratic_drag") j.quadratic_drag = size;
  if (e == "load_dependent_friction") j.load_friction = size;
  if (e == "torque_ripple") j.ripple->amplitude = size;
  if (e == "gravity") {
    const double phase = 0.7 * static_cast<double>(twin.seed % 9);
    j.gravity_cosine = size * std::cos(phase);
    j.gravity_sine = size * std::sin(phase);
  }
  if (e == "current_offset") twin.sensors.current_offset = size;
  if (e == "torque_constant_saturation") j.saturation = size;
  if (e == "torque_sensor_gain") twin.sensors.torque_gain = 1.0 + size;
  if (e == "temperature_viscous") j.temperature_viscous = size;
  if (e == "temperature_coulomb") j.temperature_coulomb = size;
}

}  // namespace flexspline::worlds
