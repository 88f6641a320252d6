#pragma once

#include "hil/motor/motor.hpp"

namespace flexspline::motor {

enum class Fidelity { averaged, switched };

/// What the sensors of one PWM period meet.
struct Sample {
  Triple seen_a{};       // phase currents as the shunts' amplifiers show them at each phase's sampling instant
  Axes current{};        // the true ones in the middle of the period
  double bus_v = 0.0;    // in the middle
  double torque_nm = 0;  // mean of the period
};

/// Inverter, bus and motor over one PWM period at a time. A period goes from the middle of the high sides' time to the
/// next; the low sides are on around its own middle, where the currents are sampled. Switched: each leg switches with
/// its dead time, in which its output capacitance is charged by the phase current until a diode conducts. Averaged:
/// each leg is a voltage, the mean of the period by its duty, dead time and drops.
class PowerStage {
 public:
  PowerStage(const MotorParameters& motor, const InverterParameters& inverter, const SensorParameters& sensors,
             Fidelity fidelity, const WiringParameters& wiring = {});

  /// Duties from 0 to 1; `at` is the rotor at the period's begin, its speed stands for the period.
  Sample run(const Triple& duties, const Rotor& at);
  /// A period with all switches open: no current flows, the bus goes on.
  void rest(const Rotor& at);

  /// What changes while it runs. Duty of the brake resistor from 0 to 1; wiring: averaged model only.
  void set_brake(double duty) { brake_duty_ = duty; }
  void set_brake_ohm(double ohm) { p_.brake_ohm = ohm; }
  void set_supply_v(double volt) { p_.supply_v = volt; }
  void set_wiring(const WiringParameters& wiring);
  Motor& motor() { return motor_; }
  double bus_v() const { return bus_v_; }
  double period_s() const { return 1.0 / p_.pwm_hz; }

 private:
  struct Leg {
    bool high = false;      // commanded
    double since_s = 1.0;   // the command's last edge
    double output_v = 0.0;  // while both switches are open
  };
  Sample run_switched(const Triple& duties, const Rotor& at);
  Sample run_averaged(const Triple& duties, const Rotor& at);
  Triple leg_voltages(const Triple& current, double dt);
  double mean_leg_voltage(double duty, double current) const;
  double shown(double current, double low_for_s) const;
  void charge_bus(double drawn_a, double dt);
  Triple leg_currents(const Rotor& at) const;
  void add_short_currents(Triple& legs, const Triple& duties) const;
  void step_motor(const Triple& leg_voltages, const Rotor& at, double dt);

  InverterParameters p_;
  SensorParameters sensors_;
  Fidelity fidelity_;
  WiringParameters wiring_;
  Motor motor_;
  std::array<Leg, 3> legs_{};
  double bus_v_;
  double brake_duty_ = 0.0;
};

}  // namespace flexspline::motor
