#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "tests/worlds/drives/balance.hpp"
#include "tests/worlds/drives/truth.hpp"

namespace flexspline::worlds::drives {
namespace {

using Column = std::vector<double>;
constexpr double kExplained = 0.97;

/// The true signals at one instant, and the torque of what is hidden.
struct Instant {
  bool begins_record;
  double travel, acceleration, velocity, direction, output_angle, gear_nm, torsion, torsion_rate, current,
      current_slope, warmth, hidden_nm;
};

/// `plain` is the mechanics without what is hidden.
double hidden_torque_nm(const Case& drive, const Mechanics& plain, const RecordPlan& plan, const Trace& trace,
                        std::size_t step, const Instant& now) {
  const Mechanics& m = drive.mechanics;
  const std::string& effect = drive.hidden.effect;
  const double without_b = now.torsion - std::clamp(now.torsion, -m.backlash_rad, m.backlash_rad);
  if (effect == "cubic_stiffness") return m.cubic_nm_rad3 * std::pow(now.torsion, 3);
  if (effect == "backlash") return m.stiffness_nm_rad * (without_b - now.torsion);
  if (effect == "gravity") return gravity_torque_nm(m, now.output_angle) / m.gear_ratio;
  if (effect == "torque_constant_saturation")
    return m.torque_constant_nm_a * m.saturation_1_a2 * std::pow(now.current, 3);
  if (effect == "current_offset") return m.torque_constant_nm_a * drive.sensors.current_offset_a;
  if (effect == "current_delay") {
    const double later_s = drive.sensors.position_delay_s - drive.sensors.current_delay_s;
    const double other = value_at(trace.current_a, trace.step_s, static_cast<double>(step) * trace.step_s + later_s);
    return m.torque_constant_nm_a * (other - now.current);
  }
  if (effect == "temperature_viscous") {
    return m.friction.viscous_nms_rad * plan.viscous_scale * (std::exp(-drive.viscous_fall_1_c * now.warmth) - 1.0) *
           now.velocity;
  }
  if (effect == "torque_ripple") {
    return ripple_torque_nm(m, trace.motor_position_rad[step]) -
           ripple_torque_nm(plain, trace.motor_position_rad[step]);
  }
  const FrictionState state{plan.coulomb_scale, plan.viscous_scale, now.gear_nm / m.gear_ratio};
  if (effect == "dahl_friction")
    return m.friction.coulomb_nm * (dry_friction_share(drive, plan, trace, step) - now.direction);
  return steady_friction_nm(m.friction, state, now.velocity) - steady_friction_nm(plain.friction, state, now.velocity);
}

std::vector<Instant> instants_of(const Case& drive) {
  std::vector<Instant> all;
  const Mechanics& m = drive.mechanics;
  const Mechanics plain = without_hidden(drive).mechanics;
  Trace trace;
  for (const RecordPlan& plan : drive.records) {
    if (plan.is_holdout) continue;
    simulate(drive, plan, trace);
    const std::size_t steps = trace.current_a.size();
    const std::size_t stride = std::max<std::size_t>(2, steps / 1500);
    std::size_t last = 0;
    const auto slope = [&](const Column& column, std::size_t k) {
      return (column[k + 1] - column[k - 1]) / (2.0 * trace.step_s);
    };
    for (std::size_t k = stride; k + stride < steps; k += stride) {
      Instant now{};
      now.acceleration = slope(trace.motor_velocity_rad_s, k);
      now.velocity = trace.motor_velocity_rad_s[k];
      now.direction = now.velocity == 0.0 ? 0.0 : (now.velocity > 0.0 ? 1.0 : -1.0);
      now.output_angle = trace.output_position_rad[k];
      now.gear_nm = trace.gear_torque_nm[k];
      now.torsion = trace.motor_position_rad[k] / m.gear_ratio - now.output_angle;
      now.torsion_rate = now.velocity / m.gear_ratio - slope(trace.output_position_rad, k);
      now.current = trace.current_a[k];
      now.current_slope = slope(trace.current_a, k);
      now.warmth = temperature_c(plan, static_cast<double>(k) / static_cast<double>(steps)) - drive.reference_c;
      // At rest friction is whatever the other torques are.
      if (now.direction == 0.0) continue;
      now.begins_record = last == 0;
      now.travel = trace.motor_position_rad[k] - trace.motor_position_rad[last];
      last = k;
      now.hidden_nm = hidden_torque_nm(drive, plain, plan, trace, k, now);
      all.push_back(now);
    }
  }
  return all;
}

/// Columns of a name of the catalogue, at one value of its nonlinear parameter.
using Columns = std::function<std::vector<Column>(const std::vector<Instant>&, double)>;
using Law = std::function<Column(const Instant&, double)>;

struct Candidate {
  const char* name;
  std::vector<double> parameters;
  Columns columns;
};

/// Of a law without memory: its values at an instant.
Columns each(const Law& law) {
  return [law](const std::vector<Instant>& all, double parameter) {
    std::vector<Column> out;
    for (const Instant& s : all) {
      const Column values = law(s, parameter);
      out.resize(values.size());
      for (std::size_t j = 0; j < values.size(); ++j) out[j].push_back(values[j]);
    }
    return out;
  };
}

/// Dahl's law in place of Coulomb's: the difference of the two, at a level of 1.
std::vector<Column> dahl_columns(const std::vector<Instant>& all, double presliding_rad) {
  FrictionLaw law;
  law.coulomb_nm = 1.0;
  law.presliding = Presliding::kDahl;
  law.presliding_rad = presliding_rad;
  Column out;
  double contact = 0.0;
  for (const Instant& s : all) {
    contact = contact_torque_nm(law, s.begins_record ? 0.0 : contact, s.travel, 1.0);
    out.push_back(contact - s.direction);
  }
  return {out};
}

std::vector<double> geometric(double low, double high, double factor) {
  std::vector<double> out;
  for (double value = low; value <= high; value *= factor) out.push_back(value);
  return out;
}

std::vector<Candidate> motor_candidates(double fast_rad_s, double coulomb_presliding_rad) {
  const Law constant = [](const Instant&, double) { return Column{1.0}; };
  const auto by_direction = [](const Instant& s, double value) {
    return Column{s.direction > 0.0 ? value : 0.0, s.direction < 0.0 ? value : 0.0};
  };
  const std::vector<double> slow = geometric(0.005 * fast_rad_s, 0.25 * fast_rad_s, 1.35);
  const auto gaussian = [=](const Instant& s, double v) {
    return by_direction(s, std::exp(-s.velocity * s.velocity / (v * v)));
  };
  const auto rational = [=](const Instant& s, double v) {
    return by_direction(s, 1.0 / (1.0 + s.velocity * s.velocity / (v * v)));
  };
  const auto power = [](const Instant& s, double d) { return Column{s.direction * std::pow(std::abs(s.velocity), d)}; };
  const auto gravity = [](const Instant& s, double) {
    return Column{std::sin(s.output_angle), std::cos(s.output_angle)};
  };
  const auto load = [](const Instant& s, double) { return Column{std::abs(s.gear_nm) * s.direction}; };
  return {{"coulomb_asymmetry", {0.0}, each(constant)},
          {"current_offset", {0.0}, each(constant)},
          {"viscous_asymmetry", {0.0}, each([](const Instant& s, double) { return Column{std::abs(s.velocity)}; })},
          {"quadratic_drag", {0.0}, each([](const Instant& s, double) {
             return Column{s.velocity * std::abs(s.velocity)};
           })},
          {"power_law_friction", {0.2, 0.35, 0.5, 0.65, 0.8}, each(power)},
          {"stribeck_gaussian", slow, each(gaussian)},
          {"stribeck_hess_soom", slow, each(rational)},
          {"dahl_friction", geometric(0.3 * coulomb_presliding_rad, 1e3 * coulomb_presliding_rad, 1.6), dahl_columns},
          {"load_dependent_friction", {0.0}, each(load)},
          {"gravity", {0.0}, each(gravity)},
          {"torque_constant_saturation", {0.0}, each([](const Instant& s, double) {
             return Column{std::pow(s.current, 3)};
           })},
          {"temperature_viscous", {0.0}, each([](const Instant& s, double) { return Column{s.warmth * s.velocity}; })},
          {"temperature_coulomb", {0.0}, each([](const Instant& s, double) { return Column{s.warmth * s.direction}; })},
          {"current_delay", {0.0}, each([](const Instant& s, double) { return Column{s.current_slope}; })}};
}

std::vector<Candidate> transmission_candidates(double widest_rad) {
  const std::vector<double> corners = geometric(0.02 * widest_rad, 0.9 * widest_rad, 1.2);
  const auto beyond = [](double x, double corner) { return x - std::clamp(x, -corner, corner); };
  return {{"cubic_stiffness", {0.0}, each([](const Instant& s, double) { return Column{std::pow(s.torsion, 3)}; })},
          {"quadratic_stiffness", {0.0}, each([](const Instant& s, double) { return Column{s.torsion * s.torsion}; })},
          {"backlash", corners, each([=](const Instant& s, double c) { return Column{beyond(s.torsion, c)}; })},
          {"piecewise_stiffness", corners, each([=](const Instant& s, double c) {
             return Column{beyond(s.torsion, c), beyond(s.torsion, 2.0 * c)};
           })}};
}

std::vector<Column> base_columns(const Case& drive, bool is_transmission, const std::vector<Instant>& all) {
  std::vector<Column> out(is_transmission ? 3 : (drive.models_gravity ? 5 : 3));
  for (const Instant& s : all) {
    out[0].push_back(is_transmission ? s.torsion : s.acceleration);
    out[1].push_back(is_transmission ? s.torsion_rate : s.velocity);
    out[2].push_back(is_transmission ? 1.0 : s.direction);
    if (out.size() < 5) continue;
    out[3].push_back(std::sin(s.output_angle));
    out[4].push_back(std::cos(s.output_angle));
  }
  return out;
}

double left_by(const Candidate& candidate, double parameter, const std::vector<Column>& base,
               const std::vector<Instant>& all, Column target) {
  std::vector<Column> columns = base;
  for (Column& column : candidate.columns(all, parameter)) columns.push_back(std::move(column));
  return residual_square(columns, target);
}

double quantile(const std::vector<Instant>& all, double share, const std::function<double(const Instant&)>& size) {
  Column sizes;
  for (const Instant& s : all) sizes.push_back(std::abs(size(s)));
  std::sort(sizes.begin(), sizes.end());
  return sizes.empty() ? 0.0 : sizes[static_cast<std::size_t>(share * static_cast<double>(sizes.size() - 1))];
}

}  // namespace

std::vector<std::string> accepted_names(const Case& drive) {
  const std::string& hidden = drive.hidden.effect;
  std::vector<std::string> names{hidden};
  // The same law in the catalogue, or one that contains it.
  if (hidden == "dahl_friction") names.push_back("lugre_friction");
  if (hidden == "stribeck_gaussian") names.push_back("stribeck_hess_soom");
  if (hidden == "load_dependent_friction") names.push_back("driving_dependent_loss");
  const bool is_transmission = hidden == "cubic_stiffness" || hidden == "backlash";
  const std::vector<Instant> all = instants_of(drive);
  const std::vector<Column> base = base_columns(drive, is_transmission, all);
  Column target;
  for (const Instant& s : all) target.push_back(s.hidden_nm);
  std::vector<Column> used = base;
  Column rest = target;
  const double whole = residual_square(used, rest);
  const FrictionLaw& friction = drive.mechanics.friction;
  const auto torsion = [](const Instant& s) { return s.torsion; };
  const auto velocity = [](const Instant& s) { return s.velocity; };
  const auto candidates = is_transmission ? transmission_candidates(quantile(all, 0.999, torsion))
                                          : motor_candidates(quantile(all, 0.95, velocity), friction.presliding_rad);
  for (const Candidate& candidate : candidates) {
    double least = whole;
    for (const double parameter : candidate.parameters)
      least = std::min(least, left_by(candidate, parameter, used, all, rest));
    const bool is_new = std::find(names.begin(), names.end(), candidate.name) == names.end();
    if (is_new && least <= (1.0 - kExplained) * whole) names.emplace_back(candidate.name);
  }
  return names;
}

}  // namespace flexspline::worlds::drives
