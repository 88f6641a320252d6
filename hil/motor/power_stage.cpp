#include "hil/motor/power_stage.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace flexspline::motor {
namespace {

constexpr double kStep_s = 1e-6;       // within which the winding is of second order far below any sensor's error
constexpr double kDeadStep_s = 40e-9;  // while a leg's capacitance is charged
constexpr double kNothing_s = 1e-12;

// Where f falls through zero, within -most and most.
template <class F>
double falling_zero(const F& f, double most) {
  double low = -most, high = most;
  constexpr int kHalves = 60;
  for (int k = 0; k < kHalves; ++k) {
    const double middle = (low + high) / 2.0;
    (f(middle) > 0.0 ? low : high) = middle;
  }
  return (low + high) / 2.0;
}

}  // namespace

PowerStage::PowerStage(const MotorParameters& motor, const InverterParameters& inverter,
                       const SensorParameters& sensors, Fidelity fidelity, const WiringParameters& wiring)
    : p_(inverter), sensors_(sensors), fidelity_(fidelity), motor_(motor), bus_v_(inverter.supply_v) {
  set_wiring(wiring);
  for (Leg& leg : legs_) leg.since_s = 1.0;
}

void PowerStage::set_wiring(const WiringParameters& wiring) {
  const bool open = wiring.open[0] || wiring.open[1] || wiring.open[2];
  if (fidelity_ == Fidelity::switched && (open || wiring.short_ohm > 0.0 || wiring.ground_ohm > 0.0))
    throw std::invalid_argument("open phases and shorts are in the averaged model only");
  wiring_ = wiring;
}

void PowerStage::rest(const Rotor& at) {
  motor_.stop(at.angle + at.speed * period_s());
  charge_bus(0.0, period_s());
}

Sample PowerStage::run(const Triple& duties, const Rotor& at) {
  return fidelity_ == Fidelity::switched ? run_switched(duties, at) : run_averaged(duties, at);
}

// Of the motor, in the order of the legs.
Triple PowerStage::leg_currents(const Rotor& at) const {
  const Triple motor = to_phases(to_plane(motor_.currents(at.angle), at.angle));
  return {motor[wiring_.motor_phase[0]], motor[wiring_.motor_phase[1]], motor[wiring_.motor_phase[2]]};
}
// A leg's voltage falls with its current, so that each balance has one solution.
void PowerStage::add_short_currents(Triple& legs, const Triple& duties) const {
  if (wiring_.short_ohm > 0.0) {
    const std::size_t from = wiring_.short_from, to = wiring_.short_to;
    const double through = falling_zero(
        [&](double i) {
          return mean_leg_voltage(duties[from], legs[from] + i) - mean_leg_voltage(duties[to], legs[to] - i) -
                 wiring_.short_ohm * i;
        },
        2.0 * p_.supply_v / wiring_.short_ohm);
    legs[from] += through;
    legs[to] -= through;
  }
  if (wiring_.ground_ohm > 0.0) {
    const std::size_t leg = wiring_.ground_leg;
    legs[leg] +=
        falling_zero([&](double i) { return mean_leg_voltage(duties[leg], legs[leg] + i) - wiring_.ground_ohm * i; },
                     2.0 * p_.supply_v / wiring_.ground_ohm);
  }
}
void PowerStage::step_motor(const Triple& leg_voltages, const Rotor& at, double dt) {
  const Triple current = leg_currents(at);
  Triple v{};
  int open = 0;
  std::size_t open_phase = 0;
  for (std::size_t x = 0; x < 3; ++x) {
    const std::size_t phase = wiring_.motor_phase[x];
    v[phase] = leg_voltages[x] - wiring_.contact_ohm[x] * current[x];
    if (!wiring_.open[x]) continue;
    open_phase = phase;
    ++open;
  }
  if (open == 0)
    motor_.step(to_plane(v), at, dt);
  else if (open == 1)
    motor_.step_open(v, open_phase, at, dt);
  else
    motor_.stop(at.angle + at.speed * dt);
}

void PowerStage::charge_bus(double drawn_a, double dt) {
  // Implicit in its own voltage, so that a small capacitance stays stable.
  const double g = dt / p_.bus_capacitance_f, braked = p_.brake_ohm > 0.0 ? g * brake_duty_ / p_.brake_ohm : 0.0;
  const auto bus_with = [&](double supply_a, double supply_share) {
    return (bus_v_ + g * (supply_a - drawn_a)) / (1.0 + supply_share + braked);
  };
  const double connected = bus_with(p_.supply_v / p_.supply_resistance_ohm, g / p_.supply_resistance_ohm);
  bus_v_ = connected > p_.supply_v && !p_.supply_takes_back ? bus_with(0.0, 0.0) : connected;
}

// From when the low side carries the current, the amplifier follows with its time constant.
double PowerStage::shown(double current, double low_for_s) const {
  if (low_for_s <= 0.0) return 0.0;
  return sensors_.settling_s > 0.0 ? current * (1.0 - std::exp(-low_for_s / sensors_.settling_s)) : current;
}

// Of legs as they are now; advances the charge of those that float.
Triple PowerStage::leg_voltages(const Triple& current, double dt) {
  Triple v{};
  for (std::size_t x = 0; x < 3; ++x) {
    Leg& leg = legs_[x];
    const bool floats = leg.since_s < p_.dead_time_s - kNothing_s;
    if (!floats) {
      leg.output_v = (leg.high ? bus_v_ : 0.0) - p_.on_resistance_ohm * current[x];
      v[x] = leg.output_v;
      continue;
    }
    // The mean of the step, while the current of the phase takes charge from the capacitance.
    const double before = leg.output_v;
    leg.output_v =
        std::clamp(before - current[x] * dt / p_.leg_capacitance_f, -p_.diode_drop_v, bus_v_ + p_.diode_drop_v);
    v[x] = (before + leg.output_v) / 2.0;
    const double moved = std::abs(leg.output_v - before), would = std::abs(current[x]) * dt / p_.leg_capacitance_f;
    // Where a diode takes over within the step, the rest of it stands at its voltage.
    if (would > moved && would > 0.0) v[x] = leg.output_v + (before - leg.output_v) / 2.0 * moved / would;
  }
  return v;
}

Sample PowerStage::run_switched(const Triple& duties, const Rotor& start) {
  const double period = period_s(), middle = period / 2.0;
  Sample sample;
  Rotor at = start;
  bool middle_seen = false;
  std::array<bool, 3> phase_seen{};
  for (double t = 0.0; t < period - kNothing_s;) {
    double next = std::min(period, t + kStep_s);
    const auto until = [&](double event) {
      if (event > t + kNothing_s) next = std::min(next, event);
    };
    const Triple current = leg_currents(at);
    double drawn = 0.0;
    for (std::size_t x = 0; x < 3; ++x) {
      Leg& leg = legs_[x];
      const double off = duties[x] * middle, on = period - off;
      const bool high = duties[x] >= 1.0 || (duties[x] > 0.0 && (t < off - kNothing_s || t >= on - kNothing_s));
      if (high != leg.high) {
        leg.high = high;
        leg.since_s = 0.0;
      }
      until(off);
      until(on);
      if (leg.since_s < p_.dead_time_s - kNothing_s) {
        until(std::min(t + kDeadStep_s, t + p_.dead_time_s - leg.since_s));
        if (leg.output_v > bus_v_) drawn += current[x];  // through the upper diode
      } else if (leg.high) {
        drawn += current[x];
      }
      const double instant = middle + sensors_.delay_s[x];
      until(instant);
      if (!phase_seen[x] && t >= instant - kNothing_s) {
        phase_seen[x] = true;
        sample.seen_a[x] = leg.high ? 0.0 : shown(current[x], leg.since_s - p_.dead_time_s + kNothing_s);
      }
    }
    until(middle);
    if (!middle_seen && t >= middle - kNothing_s) {
      middle_seen = true;
      sample.current = motor_.currents(at.angle);
      sample.bus_v = bus_v_;
    }
    const double dt = next - t;
    const Triple voltages = leg_voltages(current, dt);
    sample.torque_nm += motor_.torque_nm(at.angle) * dt / period;
    step_motor(voltages, at, dt);
    charge_bus(drawn, dt);
    for (Leg& leg : legs_) leg.since_s += dt;
    at.angle += at.speed * dt;
    t = next;
  }
  return sample;
}

// A leg that switches loses or gains up to the dead time, by its current: below C V/(dead time) the capacitance is not
// recharged within it, and the loss is in proportion; above, the recharging takes C V/i of it.
double PowerStage::mean_leg_voltage(double duty, double current) const {
  const double drop = p_.on_resistance_ohm * current;
  if (duty <= 0.0) return -drop;
  if (duty >= 1.0) return bus_v_ - drop;
  const double share = p_.dead_time_s * p_.pwm_hz;
  if (share == 0.0) return duty * bus_v_ - drop;
  const double corner = p_.leg_capacitance_f * bus_v_ / p_.dead_time_s, size = std::abs(current);
  const double part = size < corner ? size / (2.0 * corner) : 1.0 - corner / (2.0 * size);
  const double lost = share * (bus_v_ + 2.0 * p_.diode_drop_v) * part;
  return duty * bus_v_ - std::copysign(lost, current) - drop;
}

Sample PowerStage::run_averaged(const Triple& duties, const Rotor& start) {
  Sample sample;
  Rotor at = start;
  const int steps = p_.averaged_steps;
  const double dt = period_s() / steps;
  for (int k = 0; k < steps; ++k) {
    Triple current = leg_currents(at);
    add_short_currents(current, duties);
    if (k == steps / 2) {
      sample.current = motor_.currents(at.angle);
      sample.bus_v = bus_v_;
      for (std::size_t x = 0; x < 3; ++x)
        sample.seen_a[x] = shown(current[x], (1.0 - duties[x]) * period_s() / 2.0 - p_.dead_time_s);
    }
    Triple v{};
    double drawn = 0.0;
    for (std::size_t x = 0; x < 3; ++x) {
      v[x] = mean_leg_voltage(duties[x], current[x]);
      drawn += duties[x] * current[x];
    }
    sample.torque_nm += motor_.torque_nm(at.angle) / steps;
    step_motor(v, at, dt);
    charge_bus(drawn, dt);
    at.angle += at.speed * dt;
  }
  return sample;
}

}  // namespace flexspline::motor
