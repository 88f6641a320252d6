#include "tests/worlds/machines/account.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flexspline::worlds::machines {
namespace {

constexpr double kMoving = 0.01;      // of the top speed: slower samples are left out
constexpr double kSignWidth = 0.003;  // of the top speed, of the smooth sign
constexpr double kEnds_s = 0.3;       // left out at both ends of a record
constexpr double kMostCutoff = 0.35;  // of the sample rate

ZeroPhaseLowPass account_filter(const Machine& m) {
  const double rate = m.sensors.sample_hz;
  return {std::min(m.account_cutoff_hz, kMostCutoff * rate), rate};
}

void subtract(Signal& from, const Signal& x, double factor = 1.0) {
  for (std::size_t k = 0; k < from.size(); ++k) from[k] -= factor * x[k];
}

Signal smooth_sign(const Machine& m, const Signal& velocity) {
  Signal out = velocity;
  for (double& v : out) v = std::tanh(v / (kSignWidth * m.limits.velocity_rad_s));
  return out;
}

void add_gravity(const Signal& angle, double factor, std::vector<Signal>& columns) {
  Signal cosine, sine;
  for (const double v : angle) {
    cosine.push_back(std::cos(factor * v));
    sine.push_back(std::sin(factor * v));
  }
  columns.push_back(std::move(cosine));
  columns.push_back(std::move(sine));
}

struct Regression {
  std::vector<Signal> columns;
  Signal target;
};

// The motor's balance without what a torque sensor or the bench's own load cell shows.
Regression motor_regression(const Machine& m, const Run& run, const ZeroPhaseLowPass& filter, const Signal& velocity) {
  const double ratio = m.plant.gear.ratio, rate = m.sensors.sample_hz;
  const Measured& seen = run.measured;
  Regression r;
  r.target = scaled(filter(seen.current_a), m.plant.electric.torque_constant_nm_a);
  if (m.sensors.torque) subtract(r.target, filter(seen.torque_nm), 1.0 / ratio);
  if (m.sensors.load_torque) subtract(r.target, filter(seen.load_torque_nm), 1.0 / ratio);
  r.columns = {derivative(velocity, rate), velocity};
  // The base model of such machines has presliding.
  r.columns.push_back(m.presliding == Presliding::known ? filter(column(run.log, &Sample::direction))
                                                        : filter(smooth_sign(m, velocity)));
  if (m.base.torque_offset) r.columns.emplace_back(velocity.size(), 1.0);
  if (m.base.gravity && !m.sensors.torque) add_gravity(seen.angle_rad, 1.0 / ratio, r.columns);
  return r;
}

Regression transmission_regression(const Machine& m, const Run& run, const ZeroPhaseLowPass& filter) {
  Signal torsion = scaled(run.measured.angle_rad, 1.0 / m.plant.gear.ratio);
  subtract(torsion, run.measured.output_angle_rad);
  Regression r{{filter(torsion)}, filter(run.measured.torque_nm)};
  if (m.base.torque_offset) r.columns.emplace_back(torsion.size(), 1.0);
  return r;
}

Regression load_regression(const Machine& m, const Run& run, const ZeroPhaseLowPass& filter) {
  const Signal angle = filter(run.measured.output_angle_rad);
  const Signal velocity = derivative(angle, m.sensors.sample_hz);
  Regression r{{derivative(velocity, m.sensors.sample_hz), velocity}, filter(run.measured.torque_nm)};
  if (m.base.torque_offset) r.columns.emplace_back(angle.size(), 1.0);
  if (m.base.gravity) add_gravity(angle, 1.0, r.columns);
  return r;
}

void append_kept(const Regression& one, const std::vector<bool>& kept, Regression& all) {
  all.columns.resize(one.columns.size());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!kept[k]) continue;
    all.target.push_back(one.target[k]);
    for (std::size_t j = 0; j < one.columns.size(); ++j) all.columns[j].push_back(one.columns[j][k]);
  }
}

Signal velocity_of(const Machine& m, const Run& run, const ZeroPhaseLowPass& filter) {
  return derivative(filter(run.measured.angle_rad), m.sensors.sample_hz);
}

Signal wave_term(const Wave& wave, const Run& run, double factor) {
  Signal out;
  for (const Sample& s : run.log) out.push_back(factor * wave.at(s.angle_rad));
  return out;
}

}  // namespace

std::vector<Run> run_all(const Machine& machine, const std::vector<Record>& records) {
  std::vector<Run> runs;
  for (const Record& r : records) {
    Run run{&r, simulate(machine.plant, r.inputs), {}};
    run.measured = measure(machine, r, run.log);
    runs.push_back(std::move(run));
  }
  return runs;
}

double tracking_error(const Record& record, const Log& log) {
  const Signal& asked = record.inputs.angle_rad;
  Signal off;
  for (const Sample& s : log) {
    const auto k = std::min(static_cast<std::size_t>(s.time_s * kControlRate_hz), asked.size() - 2);
    const double part = s.time_s * kControlRate_hz - static_cast<double>(k);
    off.push_back(s.angle_rad - asked[k] - part * (asked[k + 1] - asked[k]));
  }
  return standard_deviation(off) / standard_deviation(asked);
}

double rms_error(const Machine& machine, const std::vector<Run>& runs, Balance balance, const Terms& known,
                 Samples samples) {
  const ZeroPhaseLowPass filter = account_filter(machine);
  const auto ends = static_cast<std::size_t>(kEnds_s * machine.sensors.sample_hz);
  Regression all;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Signal velocity = velocity_of(machine, runs[i], filter);
    Regression one = balance == Balance::motor          ? motor_regression(machine, runs[i], filter, velocity)
                     : balance == Balance::transmission ? transmission_regression(machine, runs[i], filter)
                                                        : load_regression(machine, runs[i], filter);
    if (!known.empty()) subtract(one.target, filter(known[i]));
    // The torsion does not depend on the direction of the motion.
    const bool any_speed = samples == Samples::all || balance == Balance::transmission;
    std::vector<bool> kept(velocity.size());
    for (std::size_t k = 0; k < kept.size(); ++k)
      kept[k] = k >= ends && k + ends < kept.size() &&
                (any_speed || std::abs(velocity[k]) > kMoving * machine.limits.velocity_rad_s);
    append_kept(one, kept, all);
  }
  return rms_after_least_squares(std::move(all.columns), std::move(all.target));
}

Signal presliding_term(const Machine& machine, const Run& run, double coulomb_nm) {
  const Signal sign = smooth_sign(machine, velocity_of(machine, run, account_filter(machine)));
  Signal out = column(run.log, &Sample::direction);
  subtract(out, sign);
  return scaled(std::move(out), coulomb_nm);
}

HiddenTerms hidden_terms(const Machine& machine, const std::vector<Run>& runs) {
  struct Law {
    const char* effect;
    Balance balance;
    double Sample::*term;
  };
  static constexpr std::array<Law, 15> kLaws = {
      {{"viscous_asymmetry", Balance::motor, &Sample::viscous_asymmetry_nm},
       {"coulomb_asymmetry", Balance::motor, &Sample::coulomb_asymmetry_nm},
       {"stribeck_gaussian", Balance::motor, &Sample::stribeck_nm},
       {"stribeck_hess_soom", Balance::motor, &Sample::stribeck_nm},
       {"power_law_friction", Balance::motor, &Sample::power_law_nm},
       {"quadratic_drag", Balance::motor, &Sample::drag_nm},
       {"load_dependent_friction", Balance::motor, &Sample::load_friction_nm},
       {"temperature_viscous", Balance::motor, &Sample::viscous_temperature_nm},
       {"temperature_coulomb", Balance::motor, &Sample::coulomb_temperature_nm},
       {"torque_ripple", Balance::motor, &Sample::ripple_nm},
       {"torque_constant_saturation", Balance::motor, &Sample::saturation_nm},
       {"kinematic_error", Balance::transmission, &Sample::kinematic_nm},
       {"cubic_stiffness", Balance::transmission, &Sample::cubic_nm},
       {"dahl_hysteresis", Balance::transmission, &Sample::hysteresis_nm},
       {"gravity", Balance::load, &Sample::gravity_nm}}};
  const double constant = machine.plant.electric.torque_constant_nm_a, ratio = machine.plant.gear.ratio;
  const std::string& effect = machine.hidden->effect;
  HiddenTerms out;
  for (const Run& run : runs) {
    if (effect == "presliding") {
      out.terms.push_back(presliding_term(machine, run, machine.plant.friction.coulomb_nm));
    } else if (effect == "current_offset") {
      out.terms.emplace_back(run.log.size(), constant * machine.sensors.current_offset_a);
    } else if (effect == "current_delay") {
      Signal late = column(run.log, &Sample::current_a);
      subtract(late, column(run.log, &Sample::acting_current_a));
      out.terms.push_back(scaled(std::move(late), constant));
    } else if (effect == "torque_sensor_ripple") {
      out.terms.push_back(wave_term(machine.sensors.torque_ripple_nm, run, -1.0 / ratio));
    } else {
      const auto* law = std::find_if(kLaws.begin(), kLaws.end(), [&](const Law& l) { return effect == l.effect; });
      if (law == kLaws.end()) throw std::logic_error("no term for " + effect);
      out.balance = law->balance;
      out.terms.push_back(column(run.log, law->term));
    }
  }
  // Without a torque sensor the load's torques are part of the motor's balance.
  if (out.balance == Balance::load && !(machine.sensors.torque && machine.base.load)) {
    out.balance = Balance::motor;
    for (Signal& term : out.terms) term = scaled(std::move(term), 1.0 / ratio);
  }
  return out;
}

}  // namespace flexspline::worlds::machines
