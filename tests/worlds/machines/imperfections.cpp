#include "tests/worlds/machines/imperfections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>

namespace flexspline::worlds::machines {
namespace {

using Term = std::function<Signal(const Run&)>;

Signal added(Signal x, const Signal& y, double factor = 1.0) {
  for (std::size_t k = 0; k < x.size(); ++k) x[k] += factor * y[k];
  return x;
}

class Accountant {
 public:
  Accountant(const Machine& machine, const std::vector<Run>& runs) : m_(machine), runs_(runs) {
    for (const Run& run : runs) nothing_.emplace_back(run.log.size(), 0.0);
    if (machine.hidden) hidden_ = hidden_terms(machine, runs);
  }

  // By how much the error of a balance falls once `term` is known, too.
  double excess(Balance balance, const Term& term, Samples samples = Samples::moving) const {
    Terms known = of_hidden(balance);
    const double without = rms_error(m_, runs_, balance, known, samples);
    for (std::size_t k = 0; k < runs_.size(); ++k) known[k] = added(std::move(known[k]), term(runs_[k]));
    return without / rms_error(m_, runs_, balance, known, samples) - 1.0;
  }
  // The same for logs that the sensors would have without a fault.
  double excess_over(Balance balance, const std::vector<Run>& clean) const {
    const Terms known = of_hidden(balance);
    return rms_error(m_, runs_, balance, known) / rms_error(m_, clean, balance, known) - 1.0;
  }
  bool is_hidden(const char* effect) const { return m_.hidden && m_.hidden->effect == effect; }
  Terms of_hidden(Balance balance) const { return m_.hidden && hidden_.balance == balance ? hidden_.terms : nothing_; }

 private:
  const Machine& m_;
  const std::vector<Run>& runs_;
  Terms nothing_;
  HiddenTerms hidden_;
};

void add_ripples(const Machine& m, const Accountant& a, std::vector<Imperfection>& out) {
  for (const Wave& wave : m.plant.ripples_nm) {
    if (m.hidden && m.hidden->effect == "torque_ripple") continue;  // the account of what is hidden has them all
    const Term ripple = [&](const Run& run) {
      Signal torque;
      for (const Sample& s : run.log) torque.push_back(wave.at(s.angle_rad));
      return torque;
    };
    out.push_back({fmt::format("ripple of order {:g}", wave.order),
                   a.excess(Balance::motor, ripple),
                   {{"torque_ripple", wave.order}}});
  }
}

void add_friction(const Machine& m, const Accountant& a, std::vector<Imperfection>& out) {
  const auto of_column = [&](double Sample::*term) {
    return a.excess(Balance::motor, [term](const Run& run) { return column(run.log, term); });
  };
  out.push_back(
      {"friction over the position", of_column(&Sample::position_friction_nm), {{"angle_dependent_friction"}}});
  std::vector<CatalogueName> viscous, coulomb;
  if (m.sensors.temperature) viscous = {{"temperature_viscous"}}, coulomb = {{"temperature_coulomb"}};
  if (!a.is_hidden("temperature_viscous"))
    out.push_back({"viscous friction over the temperature", of_column(&Sample::viscous_temperature_nm), viscous});
  if (!a.is_hidden("temperature_coulomb"))
    out.push_back({"Coulomb friction over the temperature", of_column(&Sample::coulomb_temperature_nm), coulomb});
  const Term coulomb_drift = [&](const Run& run) {
    const double more = (run.record->inputs.coulomb_factor - 1.0) * m.plant.friction.coulomb_nm;
    return scaled(column(run.log, &Sample::direction), more);
  };
  const Term viscous_drift = [&](const Run& run) {
    return scaled(column(run.log, &Sample::viscous_nm), 1.0 - 1.0 / run.record->inputs.viscous_factor);
  };
  out.push_back({"Coulomb friction between records", a.excess(Balance::motor, coulomb_drift), {}});
  out.push_back({"viscous friction between records", a.excess(Balance::motor, viscous_drift), {}});
}

// Any machine turns friction round more slowly or faster than the smooth sign; the names are true where there is
// presliding.
void add_presliding(const Machine& m, const Accountant& a, std::vector<Imperfection>& out) {
  if (a.is_hidden("presliding") || m.presliding == Presliding::known) return;
  std::vector<CatalogueName> names;
  if (m.presliding == Presliding::short_travel) names = {{"dahl_friction"}, {"lugre_friction"}};
  const Term reversal = [&](const Run& run) {
    return presliding_term(m, run, m.plant.friction.coulomb_nm * run.record->inputs.coulomb_factor);
  };
  out.push_back({"friction around reversals, seen while moving", a.excess(Balance::motor, reversal), names});
  out.push_back({"friction around reversals", a.excess(Balance::motor, reversal, Samples::all), names});
}

void add_encoders(const Machine& m, const Accountant& a, const std::vector<Run>& runs, std::vector<Imperfection>& out) {
  std::vector<Run> at_motor = runs, at_output = runs;
  const EncoderParameters& e = m.plant.encoder;
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (std::size_t k = 0; k < runs[i].log.size(); ++k) {
      const Sample& now = runs[i].log[k];
      at_motor[i].measured.angle_rad[k] -= e.eccentricity_rad * std::sin(now.angle_rad + e.eccentricity_phase_rad);
      if (m.sensors.output_encoder) at_output[i].measured.output_angle_rad[k] -= output_eccentricity_rad(m, now);
    }
  // An error of the angle once per turn is an acceleration, or a torsion, once per turn.
  out.push_back({"eccentric encoder", a.excess_over(Balance::motor, at_motor), {{"torque_ripple", 1.0}}});
  if (!m.base.stiffness) return;
  const std::vector<CatalogueName> per_turn = {{"kinematic_error", 1.0}};
  out.push_back({"eccentric encoder, torsion", a.excess_over(Balance::transmission, at_motor), per_turn});
  // Over less than a turn of the output it is an angle that hardly changes.
  out.push_back({"eccentric output encoder", a.excess_over(Balance::transmission, at_output), {{"torsion_zero"}}});
}

void add_signals(const Machine& m, const Accountant& a, std::vector<Imperfection>& out) {
  const double ratio = m.plant.gear.ratio;
  const Term late = [&](const Run& run) {
    const Signal difference =
        added(column(run.log, &Sample::current_a), column(run.log, &Sample::acting_current_a), -1.0);
    return scaled(difference, m.plant.electric.torque_constant_nm_a);
  };
  if (!a.is_hidden("current_delay"))
    out.push_back({"delay of the current", a.excess(Balance::motor, late), {{"current_delay"}}});
  const Term link = [&](const Run& run) {
    const double rate = m.sensors.sample_hz;
    const Signal lag =
        added(column(run.log, &Sample::output_angle_rad), column(run.log, &Sample::angle_rad), -1.0 / ratio);
    return scaled(derivative(derivative(lag, rate), rate), m.plant.load.inertia_kgm2 / ratio);
  };
  // With a torque sensor the gear's torque is known.
  if (!m.plant.gear.rigid && !m.sensors.torque)
    out.push_back(
        {"elastic gear", a.excess(Balance::motor, link), {{"elastic_load"}, {"linear_stiffness"}, {"output_inertia"}}});
  if (m.base.stiffness) {
    const Term damping = [](const Run& run) { return column(run.log, &Sample::damping_nm); };
    out.push_back({"damping of the gear", a.excess(Balance::transmission, damping), {{"structural_damping"}}});
  }
}

}  // namespace

Account account_of(const Machine& machine, const std::vector<Run>& runs) {
  const Accountant a(machine, runs);
  Account out;
  out.base_error_nm = rms_error(machine, runs, Balance::motor, {});
  out.error_with_nm = out.error_floor_nm = out.base_error_nm;
  if (machine.hidden) {
    const HiddenTerms hidden = hidden_terms(machine, runs);
    out.balance = hidden.balance;
    out.error_with_nm = rms_error(machine, runs, hidden.balance, {});
    out.error_floor_nm = rms_error(machine, runs, hidden.balance, hidden.terms);
    out.excess = out.error_with_nm / out.error_floor_nm - 1.0;
  }
  add_ripples(machine, a, out.imperfections);
  add_friction(machine, a, out.imperfections);
  add_presliding(machine, a, out.imperfections);
  add_encoders(machine, a, runs, out.imperfections);
  add_signals(machine, a, out.imperfections);
  return out;
}

}  // namespace flexspline::worlds::machines
