#include "tests/worlds/machines/plant.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/worlds/machines/friction.hpp"

namespace flexspline::worlds::machines {
namespace {

constexpr double kDamping = 0.9;         // of the position loop
constexpr double kIntegral = 0.15;       // of the bandwidth
constexpr double kSteepness = 0.01;      // of the reference velocity, over which fed-forward friction turns round
constexpr double kGravityBelief = 0.95;  // what the controller knows of the sine part
constexpr double kRunaway_rad = 1e7;

double rounded_half_up(double value, double step) {
  return step > 0.0 ? step * std::floor(value / step + 0.5) : value;
}

FrictionParameters of_record(FrictionParameters friction, const Inputs& inputs) {
  friction.viscous_nms_rad *= inputs.viscous_factor;
  friction.coulomb_nm *= inputs.coulomb_factor;
  return friction;
}

// Position, velocity by filtered differences, integral, and what the maker knows of the machine fed forward.
class PositionController {
 public:
  PositionController(const Plant& plant, const FrictionParameters& friction, const Inputs& inputs)
      : plant_(plant), friction_(friction), inputs_(inputs), last_rad_(inputs.angle_rad.front()) {}

  // The current that is asked for at tick k.
  double at(std::size_t k, double angle_rad) {
    const ControllerParameters& c = plant_.controller;
    const ElectricParameters& e = plant_.electric;
    const EncoderParameters& s = plant_.encoder;
    const double period = 1.0 / kControlRate_hz, inertia = plant_.total_inertia_kgm2();
    const double seen =
        rounded_half_up(angle_rad + s.eccentricity_rad * std::sin(angle_rad + s.eccentricity_phase_rad) +
                            s.noise_rad * inputs_.encoder_noise[k],
                        s.step_rad);
    const double difference = k == 0 ? 0.0 : (seen - last_rad_) / period;
    last_rad_ = seen;
    velocity_rad_s_ += c.velocity_filter * (difference - velocity_rad_s_);
    const double error = inputs_.angle_rad[k] - seen, stiffness = inertia * c.bandwidth_rad_s * c.bandwidth_rad_s;
    const double most = 0.5 * e.limit_a * e.torque_constant_nm_a;
    integral_nm_ += stiffness * c.bandwidth_rad_s * kIntegral * error * period;
    integral_nm_ = std::clamp(integral_nm_, -most, most);
    const double torque = stiffness * error +
                          2.0 * kDamping * inertia * c.bandwidth_rad_s * (inputs_.velocity_rad_s[k] - velocity_rad_s_) +
                          integral_nm_ + feedforward(k);
    return rounded_half_up(std::clamp(torque / e.torque_constant_nm_a, -e.limit_a, e.limit_a), e.step_a);
  }

 private:
  double feedforward(std::size_t k) const {
    const ControllerParameters& c = plant_.controller;
    const double n = plant_.gear.ratio, w = inputs_.velocity_rad_s[k], output = inputs_.angle_rad[k] / n;
    const double gravity = plant_.load.gravity_cosine_nm * std::cos(output) +
                           kGravityBelief * plant_.load.gravity_sine_nm * std::sin(output);
    return c.inertia_feedforward * plant_.total_inertia_kgm2() * inputs_.acceleration_rad_s2[k] +
           c.viscous_feedforward * friction_.viscous_nms_rad * w +
           c.coulomb_feedforward * friction_.coulomb_nm *
               std::tanh(w / (kSteepness * friction_.reference_velocity_rad_s)) +
           (gravity + inputs_.known_output_torque_nm[k]) / n;
  }

  const Plant& plant_;
  const FrictionParameters& friction_;
  const Inputs& inputs_;
  double last_rad_, velocity_rad_s_ = 0.0, integral_nm_ = 0.0;
};

class Simulation {
 public:
  Simulation(const Plant& plant, const Inputs& inputs)
      : p_(plant),
        inputs_(inputs),
        h_(plant.step_s),
        friction_parameters_(of_record(plant.friction, inputs)),
        friction_(friction_parameters_, plant.gear.ratio, plant.step_s),
        controller_(plant, friction_parameters_, inputs),
        lag_(1.0 - std::exp(-plant.step_s / plant.electric.time_constant_s)),
        delayed_a_(1 + static_cast<std::size_t>(plant.electric.delay_s / plant.step_s + 0.5), 0.0) {}

  Log all() {
    Log log;
    log.reserve(inputs_.sample_step.size());
    angle_ = inputs_.angle_rad.front();
    output_angle_ = angle_ / p_.gear.ratio;
    if (!p_.gear.rigid) output_angle_ -= (gravity() + inputs_.output_torque_nm.front()) / p_.gear.stiffness_nm_rad;
    const auto hold = static_cast<std::size_t>(std::lround(1.0 / (kControlRate_hz * h_)));
    const std::size_t steps = hold * inputs_.angle_rad.size();
    for (std::size_t n = 0; n < steps && log.size() < inputs_.sample_step.size(); ++n) {
      tick_ = n / hold;
      if (n % hold == 0) {
        asked_a_ = controller_.at(tick_, angle_);
        const double warm = inputs_.temperature_c[tick_] - p_.friction.reference_temperature_c;
        sliding_.viscous_thermal = std::exp(-p_.friction.viscous_temperature_1_k * warm);
        sliding_.coulomb_thermal = std::exp(-p_.friction.coulomb_temperature_1_k * warm);
      }
      step(n);
      if (!std::isfinite(angle_) || std::abs(angle_) > kRunaway_rad) throw std::runtime_error("the machine ran away");
      if (inputs_.sample_step[log.size()] == n) log.push_back(sample_);
    }
    if (log.size() < inputs_.sample_step.size()) throw std::runtime_error("samples lie beyond the record's end");
    return log;
  }

 private:
  double gravity() const {
    if (p_.load.gravity_cosine_nm == 0.0 && p_.load.gravity_sine_nm == 0.0) return 0.0;
    return p_.load.gravity_cosine_nm * std::cos(output_angle_) + p_.load.gravity_sine_nm * std::sin(output_angle_);
  }

  double driving_torque(std::size_t n) {
    const ElectricParameters& e = p_.electric;
    current_ += lag_ * (asked_a_ - current_);
    delayed_a_[n % delayed_a_.size()] = current_;
    const double acting = delayed_a_[(n + 1) % delayed_a_.size()];
    sample_.current_a = current_;
    sample_.acting_current_a = acting;
    sample_.saturation_nm = e.torque_constant_nm_a * e.saturation_1_a2 * acting * acting * acting;
    return e.torque_constant_nm_a * acting - sample_.saturation_nm;
  }

  // Torque of the elastic gear at the output.
  double gear_torque() {
    const GearParameters& g = p_.gear;
    double shift = 0.0, slope = 0.0;
    if (g.kinematic_error_rad.order > 0.0) {
      const Wave& e = g.kinematic_error_rad;
      shift = e.at(angle_);
      slope = e.order * (e.sine * std::cos(e.order * angle_) - e.cosine * std::sin(e.order * angle_));
    }
    transmission_slope_ = 1.0 / g.ratio + slope;
    const double torsion = angle_ / g.ratio - output_angle_ + shift;
    const double rate = velocity_ * transmission_slope_ - output_velocity_;
    if (g.hysteresis_nm > 0.0 && rate != 0.0) {
      const double end = std::copysign(g.hysteresis_nm, rate);
      hysteresis_ =
          end + (hysteresis_ - end) * std::exp(-std::abs(rate) * h_ * g.hysteresis_stiffness_nm_rad / g.hysteresis_nm);
    }
    sample_.kinematic_nm = g.stiffness_nm_rad * shift;
    sample_.cubic_nm = g.cubic_stiffness_nm_rad3 * torsion * torsion * torsion;
    sample_.hysteresis_nm = hysteresis_;
    sample_.damping_nm = g.damping_nms_rad * rate;
    return g.stiffness_nm_rad * torsion + sample_.cubic_nm + sample_.damping_nm + hysteresis_;
  }

  void step(std::size_t n) {
    const double ratio = p_.gear.ratio, on_load = inputs_.output_torque_nm[tick_];
    const double driving = driving_torque(n);
    const double pull = gravity();
    const double gear = p_.gear.rigid ? on_load + pull : gear_torque();
    sliding_.angle_rad = angle_;
    sliding_.velocity_rad_s = velocity_;
    sliding_.gear_torque_nm = gear;
    const double friction = friction_.advance(sliding_, sample_);
    sample_.ripple_nm = 0.0;
    for (const Wave& wave : p_.ripples_nm) sample_.ripple_nm += wave.at(angle_);
    const double of_load = p_.load.viscous_nms_rad * output_velocity_;

    // The velocities first, then the angles by them.
    if (p_.gear.rigid) {
      const double rest = (pull + on_load + of_load) / ratio;
      velocity_ += h_ * (driving - friction - sample_.ripple_nm - rest) / p_.total_inertia_kgm2();
      angle_ += h_ * velocity_;
      output_velocity_ = velocity_ / ratio;
      output_angle_ = angle_ / ratio;
    } else {
      velocity_ += h_ * (driving - friction - sample_.ripple_nm - gear * transmission_slope_) / p_.rotor_inertia_kgm2;
      output_velocity_ += h_ * (gear - of_load - pull - on_load) / p_.load.inertia_kgm2;
      angle_ += h_ * velocity_;
      output_angle_ += h_ * output_velocity_;
    }
    sample_.time_s = static_cast<double>(n) * h_;
    sample_.angle_rad = angle_;
    sample_.velocity_rad_s = velocity_;
    sample_.output_angle_rad = output_angle_;
    sample_.gear_torque_nm = gear;
    sample_.gravity_nm = pull;
    sample_.output_torque_nm = on_load;
    sample_.temperature_c = inputs_.temperature_c[tick_];
  }

  const Plant& p_;
  const Inputs& inputs_;
  double h_;
  FrictionParameters friction_parameters_;
  MachineFriction friction_;
  PositionController controller_;
  double lag_;
  std::vector<double> delayed_a_;  // a ring
  SlidingState sliding_;
  Sample sample_;
  std::size_t tick_ = 0;
  double asked_a_ = 0.0, current_ = 0.0;
  double angle_ = 0.0, velocity_ = 0.0, output_angle_ = 0.0, output_velocity_ = 0.0;
  double hysteresis_ = 0.0, transmission_slope_ = 1.0;
};

}  // namespace

double Wave::at(double angle_rad) const {
  return cosine * std::cos(order * angle_rad) + sine * std::sin(order * angle_rad);
}

std::vector<double> column(const Log& log, double Sample::*of) {
  std::vector<double> out(log.size());
  for (std::size_t k = 0; k < log.size(); ++k) out[k] = log[k].*of;
  return out;
}

Log simulate(const Plant& plant, const Inputs& inputs) {
  return Simulation(plant, inputs).all();
}

}  // namespace flexspline::worlds::machines
