#pragma once

#include <array>
#include <cstddef>

namespace flexspline::motor {

using Triple = std::array<double, 3>;  // of the phases a, b, c

/// A permanent-magnet synchronous motor in star connection. Amplitude-invariant: the flux is the amplitude of a phase.
struct MotorParameters {
  int pole_pairs = 7;
  double resistance_ohm = 0.3;  // of a phase at 20 degrees Celsius
  double inductance_d_h = 0.3e-3;
  double inductance_q_h = 0.3e-3;
  double saturation_d_a = 0.0;  // flux = L i/sqrt(1 + (i/saturation)^2); zero: none
  double saturation_q_a = 0.0;
  double flux_vs = 0.006;
  double harmonic_5 = 0.0;  // of the flux, as shares of it
  double harmonic_7 = 0.0;
  double cogging_nm = 0.0;
  double cogging_per_turn = 42.0;  // the least common multiple of slots and poles
  double ambient_c = 20.0;
  double heat_capacity_j_k = 30.0;
  double thermal_resistance_k_w = 3.0;
};

/// Three half bridges on a supply.
struct InverterParameters {
  double supply_v = 48.0;
  double supply_resistance_ohm = 0.05;
  double bus_capacitance_f = 500e-6;
  double brake_ohm = 0.0;         // of the brake resistor; zero: none
  bool supply_takes_back = true;  // not: a rectifier or a battery switch between supply and bus
  double on_resistance_ohm = 0.004;
  double diode_drop_v = 0.8;
  double dead_time_s = 0.5e-6;
  double leg_capacitance_f = 1e-9;  // of both switches of a leg, seen from its output
  double pwm_hz = 20e3;
  int averaged_steps = 20;  // a period of the averaged model; even, so that its middle is between two
};

/// Shunts in the low sides, amplifiers and converter; and the reading of the bus voltage.
struct SensorParameters {
  double full_scale_a = 40.0;
  Triple offset_a{};
  Triple gain{1.0, 1.0, 1.0};
  double noise_a = 0.0;     // standard deviation of a reading
  Triple delay_s{};         // of each phase's sampling instant after the middle of the low sides' time
  double settling_s = 0.0;  // time constant of the amplifier, from when the low side begins to carry the current
  int bits = 12;
  std::array<std::size_t, 3> order{0, 1, 2};  // of which leg each reading is
  double bus_full_scale_v = 60.0;
};

/// How the motor's wires are connected to the legs, and faults of them. Shorts and open phases: averaged model only.
struct WiringParameters {
  std::array<std::size_t, 3> motor_phase{0, 1, 2};  // of each leg
  std::array<bool, 3> open{};                       // a leg whose wire is open
  Triple contact_ohm{};                             // of each leg's wire, beyond the motor's resistance
  double short_ohm = 0.0;                           // between `short_from` and `short_to`; zero: no short
  std::size_t short_from = 0;
  std::size_t short_to = 0;
  double ground_ohm = 0.0;  // from leg `ground_leg` to the negative side of the bus; zero: none
  std::size_t ground_leg = 0;
};

/// The rotor with what turns with it, for tests of the electrical side alone.
struct ShaftParameters {
  double inertia_kg_m2 = 1e-4;
  double coulomb_nm = 0.02;
  double viscous_nms = 1e-4;
  bool blocked = false;
};

/// An encoder on that shaft. It slips by `slip_turns` whenever the shaft has moved on by `slip_every_turns`.
struct EncoderParameters {
  int counts_per_turn = 16384;
  bool reversed = false;
  double offset_turns = 0.0;
  bool stands = false;
  double slip_turns = 0.0;
  double slip_every_turns = 0.0;
};

}  // namespace flexspline::motor
