#include "host/drive_link/deployment/commissioning_settings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "host/drive_link/deployment/foc_settings.hpp"

namespace flexspline::deployment {
namespace {

namespace commissioning = control::commissioning;
using commissioning::Fault;

void demand(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}
std::int32_t fixed_point(double x, int bits, const std::string& what) {
  const double scaled = std::round(std::ldexp(x, bits));
  demand(std::isfinite(scaled) && std::abs(scaled) <= 2147483647.0, what + " does not fit its format");
  return static_cast<std::int32_t>(scaled);
}
double real(std::int32_t x, int bits) {
  return std::ldexp(static_cast<double>(x), -bits);
}

// The modulation is that of field-oriented control without its compensation of the dead time; the rest of its numbers
// depends on a motor, which nothing is known of.
control::foc::ModulationSettings modulation_of(const CommissioningSetup& s) {
  FocSetup f;
  f.resistance_ohm = s.bus_full_scale_v / s.current_full_scale_a;
  f.inductance_d_h = f.inductance_q_h = f.resistance_ohm / s.pwm_hz;
  f.current_full_scale_a = s.current_full_scale_a;
  f.bus_full_scale_v = s.bus_full_scale_v;
  f.pwm_hz = s.pwm_hz;
  f.timer_counts = s.timer_counts;
  f.shortest_pulse_s = s.shortest_pulse_s + s.dead_time_s;
  f.sampling_window_s = s.sampling_window_s + 3.0 * s.dead_time_s;
  f.bandwidth_hz = s.pwm_hz / 20.0;
  return foc_settings(f).modulation;
}

}  // namespace

commissioning::Settings commissioning_settings(const CommissioningSetup& s) {
  demand(s.current_full_scale_a > 0.0 && s.bus_full_scale_v > 0.0 && s.pwm_hz > 0.0 && s.timer_counts > 0,
         "full scales, the PWM rate and the timer's counts have to be above zero");
  const double most = s.most_current_a > 0.0 ? s.most_current_a : 1.5 * s.current_a;
  demand(s.current_a > 0.0 && most > 1.3 * s.current_a && most < 0.95 * s.current_full_scale_a,
         "the test current has to be above zero, its limit 1.3 times that and below the sensors' full scale");
  demand(s.current_a > 0.02 * s.current_full_scale_a,
         "the test current is below a fiftieth of the sensors' full scale, too little to measure with");
  demand(s.bus_v > 0.0 && s.bus_v < s.bus_full_scale_v, "the nominal bus voltage is not within its full scale");
  demand(s.voltage_share > 0.0 && s.voltage_share <= 0.45, "the share of the voltage is not between 0 and 0.45");
  demand(s.slow_hz > 0.0 && s.fast_hz > s.slow_hz && s.fast_hz <= s.pwm_hz / 100.0,
         "the speeds have to rise from slow to fast, and that is at most a hundredth of the PWM rate");
  demand(s.most_travel_turns > 0.0 && s.most_travel_turns < 32000.0, "the travel is not between 0 and 32000 turns");
  demand(s.pole_pairs >= 0 && s.pole_pairs <= 40, "the stated pole pairs are not between 0 and 40");
  commissioning::Settings c;
  c.sensors.gain = {4096, 4096, 4096};
  c.sensors.two = s.two_sensors;
  c.modulation = modulation_of(s);
  c.offsets.offset = fixed_point(s.offset_a / s.current_full_scale_a, 15, "the sensors' offset");
  c.offsets.spread = fixed_point(s.spread_a / s.current_full_scale_a, 15, "the sensors' noise");
  c.timer_counts = s.timer_counts;
  const double least_bus = s.least_bus_v > 0.0 ? s.least_bus_v : 0.75 * s.bus_v;
  c.least_bus = fixed_point(least_bus / s.bus_full_scale_v, 15, "the least bus voltage");
  c.current = fixed_point(s.current_a / s.current_full_scale_a, 27, "the test current");
  c.most_current = fixed_point(most / s.current_full_scale_a, 27, "the limit of the current");
  c.most_voltage = fixed_point(s.voltage_share * s.bus_v / std::sqrt(3.0) / s.bus_full_scale_v, 28, "the voltage");
  c.voltage_ramp = fixed_point(s.voltage_ramp_v_s / s.pwm_hz / s.bus_full_scale_v, 28, "the ramp of the voltage");
  c.slow_step = fixed_point(s.slow_hz / s.pwm_hz, 32, "the slow speed");
  c.fast_step = fixed_point(s.fast_hz / s.pwm_hz, 32, "the fast speed");
  c.most_shaft_step = fixed_point(s.most_shaft_hz / s.pwm_hz, 32, "the motor's speed");
  c.step_ramp = fixed_point(s.ramp_hz_s / s.pwm_hz / s.pwm_hz, 32, "the ramp of the speed");
  demand(c.voltage_ramp > 0 && c.step_ramp > 0, "a ramp is too slow");
  c.most_travel = fixed_point(s.most_travel_turns, 16, "the travel");
  c.most_periods = fixed_point(s.most_time_s * s.pwm_hz, 0, "the time");
  c.stated_pole_pairs = s.pole_pairs;
  return c;
}

CommissioningFindings commissioning_findings(const CommissioningSetup& s, const commissioning::Result& r) {
  const double ohm = s.bus_full_scale_v / s.current_full_scale_a, period = 1.0 / s.pwm_hz;
  constexpr int kBits = commissioning::kSharesBits;
  CommissioningFindings f;
  f.resistance_ohm = real(r.resistance, kBits) * ohm;
  f.inductance_d_h = real(r.inductance_d, kBits) * ohm * period;
  f.inductance_q_h = real(r.inductance_q, kBits) * ohm * period;
  f.flux_vs = real(r.flux, kBits) * s.bus_full_scale_v * period / (2.0 * std::numbers::pi);
  f.lost_v = real(r.lost_voltage, 28) * s.bus_full_scale_v;
  f.pole_pairs = r.pole_pairs;
  f.reversed = r.reversed;
  f.offset_turns = std::ldexp(static_cast<double>(r.offset_angle), -32);
  f.lag_turns = real(r.lag, 32);
  f.gain = {real(r.gain.a, 12), real(r.gain.b, 12), real(r.gain.c, 12)};
  const auto ampere = [&](std::int32_t x) { return real(x, 27) * s.current_full_scale_a; };
  f.offset_a = {ampere(r.offset.a), ampere(r.offset.b), ampere(r.offset.c)};
  return f;
}

double usual_bandwidth_hz(double pwm_hz) {
  return std::min(1000.0, pwm_hz / 20.0);
}

control::MotorSettings motor_settings(const CommissioningSetup& s, const commissioning::Result& r, double pulse,
                                      std::uint32_t encoder_counts, double bandwidth_hz) {
  const CommissioningFindings found = commissioning_findings(s, r);
  FocSetup f;
  f.resistance_ohm = found.resistance_ohm;
  f.inductance_d_h = found.inductance_d_h;
  f.inductance_q_h = found.inductance_q_h;
  f.flux_vs = found.flux_vs;
  f.current_full_scale_a = s.current_full_scale_a;
  f.bus_full_scale_v = s.bus_full_scale_v;
  f.pwm_hz = s.pwm_hz;
  f.timer_counts = s.timer_counts;
  f.shortest_pulse_s = pulse / s.pwm_hz;
  f.bandwidth_hz = bandwidth_hz;
  const control::foc::Settings made = foc_settings(f);
  control::MotorSettings m;
  m.pole_pairs = static_cast<std::uint32_t>(r.pole_pairs);
  m.reversed = r.reversed;
  m.offset_angle = r.offset_angle;
  m.encoder_counts = encoder_counts;
  m.gain = r.gain;
  m.current = made.current;
  m.circle = made.circle;
  m.resistance = r.resistance;
  m.inductance_d = r.inductance_d;
  m.inductance_q = r.inductance_q;
  m.flux = r.flux;
  m.bandwidth_mhz = static_cast<std::uint32_t>(std::lround(1e3 * bandwidth_hz));
  return m;
}

std::string_view commissioning_step_text(commissioning::Step step) {
  using commissioning::Step;
  switch (step) {
    case Step::bus:
      return "bus voltage";
    case Step::offsets:
      return "zeros of the current sensors";
    case Step::short_to_ground:
      return "short to ground";
    case Step::resistance:
      return "resistance, wiring, gains of the current sensors";
    case Step::first_inductance:
      return "inductance at rest";
    case Step::pole_pairs:
      return "pole pairs; the motor turns";
    case Step::forward:
      return "angle of the encoder, forward; the motor turns";
    case Step::backward:
      return "angle of the encoder, backward; the motor turns";
    case Step::does_it_turn:
      return "whether the rotor turns";
    case Step::inductances:
      return "inductances in d and q";
    case Step::flux_forward:
      return "flux linkage, forward; the motor turns fast";
    case Step::flux_backward:
      return "flux linkage, backward; the motor turns fast";
    case Step::stop:
      return "the motor comes to rest";
    case Step::done:
      return "done";
  }
  return "a step that this tool does not know";
}

CommissioningFaultText commissioning_fault_text(Fault fault) {
  switch (fault) {
    case Fault::none:
      return {"none", "the motor was measured", ""};
    case Fault::bus_too_low:
      return {"bus_too_low", "the bus voltage is below its limit", "switch the supply on, or raise its current limit"};
    case Fault::offset_too_large:
      return {"offset_too_large", "a current sensor's zero is too far off",
              "check the shunt, its amplifier and the reference of the converter"};
    case Fault::current_flows:
      return {"current_flows", "readings of a current sensor differ while no current should flow",
              "hold the rotor still; if it stands, look for noise at the sensor"};
    case Fault::short_to_ground:
      return {"short_to_ground", "current flows from a phase to the negative side of the bus",
              "unplug the motor and repeat: without it the board is at fault, else the cable or the winding"};
    case Fault::current_sum:
      return {"current_sum", "a current sensor shows none, and the phase currents do not add up to zero",
              "check the shunt of that phase and its amplifier"};
    case Fault::sensor_order:
      return {"sensor_order", "a voltage on a phase shows as current of another one, or with the wrong sign",
              "match the order and the sign of the current sensors with the half bridges"};
    case Fault::overcurrent:
      return {"overcurrent", "a phase current passed the limit of the test", "lower the test current"};
    case Fault::not_connected:
      return {"not_connected", "at most one phase of the motor is connected", "connect the motor's three wires"};
    case Fault::phase_open:
      return {"phase_open", "no current flows in a phase", "check its wire, plug and half bridge"};
    case Fault::phases_shorted:
      return {"phases_shorted", "two phases are shorted with each other", "unplug the motor and measure between wires"};
    case Fault::resistances_differ:
      return {"resistances_differ", "the resistances of the phases differ by more than a fifth",
              "look for a bad contact in the named phase, or shorted turns"};
    case Fault::gains_differ:
      return {"gains_differ", "the gains of the current sensors differ by more than a quarter",
              "check the shunts' values and their amplifiers' gains, then the insulation of motor and cable"};
    case Fault::voltage_too_low:
      return {"voltage_too_low", "the test current is not reached with the voltage there is",
              "lower the test current, or raise the bus voltage"};
    case Fault::rotor_blocked:
      return {"rotor_blocked", "the rotor does not turn with the test current",
              "release brake and load, look for an end stop, or raise the test current"};
    case Fault::encoder_stands:
      return {"encoder_stands", "the rotor turns and the encoder does not",
              "check the encoder's plug, supply and magnet"};
    case Fault::encoder_slips:
      return {"encoder_slips", "the encoder does not turn with the rotor",
              "fasten the encoder's coupling or magnet; check its counts per turn"};
    case Fault::wrong_pole_pairs:
      return {"wrong_pole_pairs", "the motor has other pole pairs than stated",
              "state those that were measured, or leave them out"};
    case Fault::too_far:
      return {"too_far", "the rotor has turned further than the limit of the travel",
              "raise the limit, if there is room"};
    case Fault::too_long:
      return {"too_long", "commissioning took longer than its limit", "raise the limit of the time"};
  }
  return {"unknown", "the drive reports a fault that this tool does not know",
          "use the tool of the firmware's version"};
}

}  // namespace flexspline::deployment
