#pragma once

#include "hil/motor/parameters.hpp"

namespace flexspline::motor {

struct Rotor {
  double angle = 0.0;  // electrical, rad
  double speed = 0.0;  // electrical, rad/s
};
struct Axes {
  double d = 0.0;
  double q = 0.0;
};
struct Plane {
  double alpha = 0.0;
  double beta = 0.0;
};

Plane to_plane(const Triple& x);  // without what is common to all three
Triple to_phases(const Plane& x);
Axes to_axes(const Plane& x, double angle);
Plane to_plane(const Axes& x, double angle);

/// The winding: flux linkages in the rotor's axes are its state.
///   d(flux)/dt = v - R i - j w flux,   flux = L(i) i + magnet(angle)
/// Torque from the power that is not stored: 1.5 p (flux x i + d(magnet)/d(angle) . i), and the cogging.
class Motor {
 public:
  explicit Motor(const MotorParameters& parameters);

  Axes currents(double angle) const { return currents_of(flux_, angle); }
  double torque_nm(double angle) const;
  double temperature_c() const { return temperature_c_; }
  double resistance_ohm() const;

  /// A step of `dt` with a voltage that stands still in the stator, second order.
  void step(const Plane& voltage, const Rotor& at, double dt);
  /// The same where the wire of one phase is open: its terminal takes the voltage at which no current flows in it.
  void step_open(const Triple& voltages, std::size_t open_phase, const Rotor& at, double dt);
  /// No current flows.
  void stop(double angle);
  void set_temperature_c(double temperature) { temperature_c_ = temperature; }

 private:
  Axes magnet(double angle) const;
  Axes magnet_slope(double angle) const;
  Axes currents_of(const Axes& flux, double angle) const;
  Axes rates(const Axes& flux, const Plane& voltage, const Rotor& at) const;

  MotorParameters p_;
  Axes flux_{};
  double temperature_c_ = 20.0;
};

}  // namespace flexspline::motor
