// The drive's current control on the twin's motor and power stage, one PWM period at a time.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "hil/motor/power_stage.hpp"
#include "hil/motor/shunts.hpp"
#include "host/drive_link/deployment/foc_settings.hpp"
#include "shared/control/foc/field_oriented.hpp"

namespace flexspline::foc_rig {

namespace foc = control::foc;

struct Bench {
  motor::MotorParameters motor;
  motor::InverterParameters inverter;
  motor::SensorParameters sensors;
};

// What the control is told of a bench; parameters of the motor times 1 + error.
inline deployment::FocSetup setup_of(const Bench& b, double error_r = 0.0, double error_d = 0.0, double error_q = 0.0,
                                     double error_flux = 0.0) {
  deployment::FocSetup s;
  s.resistance_ohm = (b.motor.resistance_ohm + b.inverter.on_resistance_ohm) * (1.0 + error_r);
  s.inductance_d_h = b.motor.inductance_d_h * (1.0 + error_d);
  s.inductance_q_h = b.motor.inductance_q_h * (1.0 + error_q);
  s.flux_vs = b.motor.flux_vs * (1.0 + error_flux);
  s.current_full_scale_a = b.sensors.full_scale_a;
  s.bus_full_scale_v = b.sensors.bus_full_scale_v;
  s.pwm_hz = b.inverter.pwm_hz;
  s.dead_time_s = b.inverter.dead_time_s;
  // Where a leg has lost about all of it: a few times the current that recharges its capacitance in the dead time.
  if (s.dead_time_s > 0.0)
    s.dead_time_zone_a = 1.5 * b.inverter.leg_capacitance_f * b.inverter.supply_v / b.inverter.dead_time_s;
  s.diode_drop_v = b.inverter.diode_drop_v;
  s.bus_v = b.inverter.supply_v;
  s.shortest_pulse_s = 0.2e-6;
  s.sampling_window_s = 1.5e-6;
  return s;
}

inline std::int32_t q27(double share) {
  return static_cast<std::int32_t>(std::lround(std::ldexp(share, 27)));
}

class Rig {
 public:
  Rig(const Bench& bench, const deployment::FocSetup& setup, motor::Fidelity fidelity, double electrical_rad_s)
      : bench_(bench),
        setup_(setup),
        settings_(deployment::foc_settings(setup)),
        stage_(bench.motor, bench.inverter, bench.sensors, fidelity),
        shunts_(bench.sensors, 7),
        speed_(electrical_rad_s) {}

  // One period with the duties of the last one's sample; then the control, with currents wanted in A.
  const motor::Sample& step(double d_a, double q_a) {
    const motor::Rotor at{angle_, speed_};
    sample_ = stage_.run(duties_, at);
    const double period = stage_.period_s(), middle = angle_ + speed_ * period / 2.0;
    const motor::Readings r = shunts_.read(sample_);
    foc::Inputs& in = in_;
    in.readings = {r.current[0], r.current[1], r.current[2]};
    in.bus = r.bus;
    const auto turns = [](double rad) { return rad / (2.0 * std::numbers::pi); };
    in.angle = static_cast<std::uint32_t>(
        static_cast<std::int64_t>(std::floor(std::ldexp(turns(middle) - std::floor(turns(middle)), 32))));
    in.step = static_cast<std::int32_t>(std::lround(std::ldexp(turns(speed_ * period), 32)));
    in.set_point = {q27(d_a / bench_.sensors.full_scale_a), q27(q_a / bench_.sensors.full_scale_a)};
    foc::update(state_, settings_, in, out_);
    const double all = setup_.timer_counts;
    duties_ = {out_.counts.a / all, out_.counts.b / all, out_.counts.c / all};
    angle_ += speed_ * period;
    return sample_;
  }
  void set_speed(double electrical_rad_s) { speed_ = electrical_rad_s; }

  const motor::Sample& sample() const { return sample_; }
  const foc::Inputs& inputs() const { return in_; }
  const foc::Outputs& outputs() const { return out_; }
  const foc::Settings& settings() const { return settings_; }
  foc::State& state() { return state_; }
  const motor::Triple& duties() const { return duties_; }
  motor::PowerStage& stage() { return stage_; }
  double angle() const { return angle_; }

 private:
  Bench bench_;
  deployment::FocSetup setup_;
  foc::Settings settings_;
  motor::PowerStage stage_;
  motor::Shunts shunts_;
  foc::State state_;
  foc::Inputs in_;
  foc::Outputs out_;
  motor::Sample sample_;
  motor::Triple duties_{0.5, 0.5, 0.5};
  double angle_ = 0.3;
  double speed_;
};

// A motor whose R, L and flux are each 0.3 to 3 times those of the class that a strain-wave joint has.
inline Bench random_bench(std::mt19937_64& random) {
  const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
  const auto spread = [&] { return 0.3 * std::pow(10.0, uniform()); };
  Bench b;
  b.motor.resistance_ohm = 0.3 * spread();
  b.motor.inductance_d_h = 0.3e-3 * spread();
  b.motor.inductance_q_h = b.motor.inductance_d_h * (1.0 + 0.5 * uniform());
  b.motor.flux_vs = 0.006 * spread();
  return b;
}

// Rise from 10 to 90 % in seconds, and overshoot as a share, of samples a period apart.
struct Response {
  double rise_s = 0.0;
  double overshoot = 0.0;
};
template <class Samples>
Response response_of(const Samples& y, double start, double end, double period) {
  Response r;
  const auto crossing = [&](double share) {
    const double level = start + share * (end - start);
    for (std::size_t k = 1; k < y.size(); ++k) {
      const bool passed = (y[k] - level) * (end - start) >= 0.0;
      if (passed) return (static_cast<double>(k) - (y[k] - level) / (y[k] - y[k - 1])) * period;
    }
    return 1.0;
  };
  r.rise_s = crossing(0.9) - crossing(0.1);
  for (const double v : y) r.overshoot = std::max(r.overshoot, (v - end) / (end - start));
  return r;
}

}  // namespace flexspline::foc_rig
