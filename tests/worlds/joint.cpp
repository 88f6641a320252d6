#include "tests/worlds/joint.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexspline::worlds {
namespace {

constexpr double kLead_s = 0.6;
constexpr double kWarmUp_s = 20.0;
constexpr double kFrictionNoise_s = 0.05;  // correlation time of coloured friction
constexpr double kPulse_s = 0.02;
// Bristles shorter than this turn round within a step.
constexpr double kNoPresliding = 1e-9;

// The neighbours' torque: slow and known to nobody but the torque sensor.
struct External {
  std::array<double, 3> amplitude{}, rate{}, phase{};

  External(double size, Random& random) {
    for (std::size_t k = 0; k < 3; ++k) {
      amplitude[k] = size * random.uniform(0.3, 0.6);
      rate[k] = kTurn * random.log_uniform(0.1, 1.5);
      phase[k] = random.uniform(0.0, kTurn);
    }
  }
  double at(double time_s) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < 3; ++k) sum += amplitude[k] * std::sin(rate[k] * time_s + phase[k]);
    return sum;
  }
};

class Run {
 public:
  Run(const Joint& joint, const RecordConditions& conditions, const Controller& controller,
      const Trajectory& trajectory, double step_s)
      : joint_(joint),
        conditions_(conditions),
        controller_(controller),
        trajectory_(trajectory),
        h_(step_s),
        random_(conditions.seed),
        external_(conditions.external_torque, random_),
        coloured_(std::exp(-step_s / kFrictionNoise_s)),
        bristles_(joint.presliding_present ? joint.law : PreslidingLaw::elastoplastic,
                  joint.presliding_present ? joint.presliding_length : kNoPresliding) {}

  Motion all() {
    const Joint& p = joint_;
    const double n = p.gear_ratio;
    Motion m;
    m.start_s = -kLead_s;
    m.step_s = h_;
    const Reference start = trajectory_.at(m.start_s);
    q_ = n * start.position;
    w_ = n * start.velocity;
    output_q_ = start.position;
    output_w_ = start.velocity;
    load_torque_ = p.load_inertia * start.acceleration + gravity(output_q_);
    const auto steps = static_cast<std::size_t>(std::llround((kLead_s + trajectory_.duration_s()) / h_));
    const auto hold = static_cast<std::size_t>(std::max(1ll, std::llround(controller_.period_s / h_)));
    for (auto* column : {&m.angle, &m.velocity, &m.acceleration, &m.output_angle, &m.current, &m.load_torque,
                         &m.temperature, &m.direction})
      column->reserve(steps);
    for (std::size_t k = 0; k < steps; ++k) {
      time_s_ = m.start_s + static_cast<double>(k) * h_;
      if (k % hold == 0) control();
      m.angle.push_back(q_);
      m.velocity.push_back(w_);
      m.output_angle.push_back(output_q_);
      m.current.push_back(current_);
      step();
      m.acceleration.push_back(acceleration_);
      m.load_torque.push_back(load_torque_);
      m.temperature.push_back(temperature_);
      m.direction.push_back(direction_);
    }
    return m;
  }

 private:
  double gravity(double angle) const {
    return joint_.gravity_cosine * std::cos(angle) + joint_.gravity_sine * std::sin(angle);
  }
  double total_inertia() const {
    return joint_.motor_inertia + joint_.load_inertia / (joint_.gear_ratio * joint_.gear_ratio);
  }

  // Proportional, integral and derivative action, with what the maker believes of the joint fed forward.
  void control() {
    const Reference r = trajectory_.at(time_s_);
    const double n = joint_.gear_ratio, inertia = total_inertia(), rate = kTurn * controller_.bandwidth_hz;
    const double error = n * r.position - q_;
    integral_ = std::clamp(integral_ + error * controller_.period_s, -1.0, 1.0);
    const double believed = 1.0 + controller_.feedforward_error;
    const double forward = believed * (inertia * n * r.acceleration + joint_.viscous * n * r.velocity +
                                       joint_.coulomb * std::tanh(n * r.velocity / 3.0) + gravity(r.position) / n);
    const double torque = forward + inertia * (rate * rate * error + 1.4 * rate * (n * r.velocity - w_) +
                                               0.3 * rate * rate * rate * integral_);
    current_ = torque / joint_.torque_constant;
  }

  // Torque of steady sliding, per direction of the bristles' load.
  double sliding_level(double direction) const {
    const Joint& p = joint_;
    const double dip = std::exp(-(w_ / p.stribeck_velocity) * (w_ / p.stribeck_velocity));
    const double thermal = std::exp(-p.temperature_coulomb * temperature_);
    double level = p.coulomb * thermal + p.stribeck * dip + direction * p.coulomb_asymmetry +
                   p.load_friction * std::abs(load_torque_) / p.gear_ratio;
    switch (p.second) {
      case SecondStructure::bump_over_angle: {
        const double x = (output_q_ - p.second_place) / p.second_width;
        level += p.second_size * std::exp(-x * x);
        break;
      }
      case SecondStructure::creep:
        level += p.second_size * std::exp(-since_turn_s_ / p.second_width);
        break;
      case SecondStructure::friction_that_lags:
        level += p.second_size * lagged_;
        break;
      default:
        break;
    }
    return std::max(0.02 * p.coulomb, level * run_factor(direction));
  }
  double run_factor(double direction) const {
    return direction > 0.0 ? conditions_.friction_forward : conditions_.friction_backward;
  }

  // What acts apart from inertia, current, friction of the bristles and the load.
  double smooth_resistance() {
    const Joint& p = joint_;
    const double speed = std::abs(w_), direction = w_ < 0.0 ? -1.0 : 1.0;
    double torque = p.viscous_asymmetry * speed + p.quadratic_drag * w_ * speed;
    if (p.power_torque != 0.0)
      torque += direction * p.power_torque * std::pow(speed / p.power_velocity, p.power_exponent);
    if (p.ripple) torque += p.ripple->amplitude * std::cos(p.ripple->order * q_ + p.ripple->phase);
    if (p.second == SecondStructure::neighbour_vibration)
      torque += p.second_size * std::sin(kTurn * p.second_width * time_s_ + p.second_place);
    if (p.second == SecondStructure::wave_over_travel)
      torque += p.second_size * std::sin(output_q_ * p.second_width + p.second_place);
    if (conditions_.coloured_friction > 0.0)
      torque += conditions_.coloured_friction * std::abs(bristles_.load()) * coloured_.next(random_);
    for (const double at : conditions_.pulses_s)
      if (time_s_ >= at && time_s_ < at + kPulse_s) torque += conditions_.pulse_torque;
    return torque;
  }

  void step() {
    const Joint& p = joint_;
    const double n = p.gear_ratio;
    const double elapsed = std::max(0.0, time_s_);
    temperature_ =
        conditions_.temperature_start_c + conditions_.temperature_rise_c * (1.0 - std::exp(-elapsed / kWarmUp_s));
    const double warm = 1.0 - conditions_.viscous_drift * std::min(1.0, elapsed / trajectory_.duration_s());
    const double sliding = w_ < 0.0 ? -1.0 : 1.0;
    const double viscous = p.viscous * warm * run_factor(sliding) * std::exp(-p.temperature_viscous * temperature_);
    lagged_ += h_ / p.second_width * (std::min(1.0, std::abs(w_) / p.power_velocity) - lagged_);

    const double level = sliding_level(bristles_.load() < 0.0 ? -1.0 : 1.0);
    double bristle_damping = 0.0;
    if (p.presliding_present && p.law == PreslidingLaw::lugre && std::abs(bristles_.load()) < 0.9)
      bristle_damping = 0.4 * std::sqrt(p.coulomb * bristles_.stiffness() * p.motor_inertia);
    const double driving = p.torque_constant * (current_ - p.saturation * current_ * current_ * current_);
    const double external = external_.at(time_s_);

    double inertia = total_inertia(), load = gravity(output_q_) + external;
    if (p.elastic) {
      inertia = p.motor_inertia;
      load = spring(external);
    }
    double stop = bristles_.set_valued(level), bristle = bristles_.torque(level);
    if (!p.presliding_present) {
      stop = level;
      bristle = 0.0;
    }
    const double torque = driving - smooth_resistance() - bristle - load / n;
    const double damping = viscous + bristle_damping;
    const double free = (w_ + h_ / inertia * torque) / (1.0 + h_ * damping / inertia);
    const double next = after_set_valued_friction(free, h_ / inertia * stop / (1.0 + h_ * damping / inertia));
    acceleration_ = (next - w_) / h_;
    const double share = level > 0.0 ? stop / level : 0.0;
    direction_ = bristle / level + (next > 0.0 ? share : next < 0.0 ? -share : 0.0);
    since_turn_s_ = next * w_ <= 0.0 ? 0.0 : since_turn_s_ + h_;
    w_ = next;
    const double travel = h_ * w_;
    q_ += travel;
    bristles_.advance(travel, level, 1.0 + p.presliding_growth * std::abs(load_torque_) / p.rated_torque);
    if (p.elastic) {
      load_torque_ = load;
    } else {
      output_q_ = q_ / n;
      output_w_ = w_ / n;
      load_torque_ = p.load_inertia * acceleration_ / n + load;
    }
  }

  // Moves the elastic load by one step; the torque of the spring before it.
  double spring(double external) {
    const ElasticLoad& e = *joint_.elastic;
    const double n = joint_.gear_ratio, inertia = joint_.load_inertia;
    const double torque = e.stiffness * (q_ / n - output_q_) + e.damping * (w_ / n - output_w_);
    const double free =
        (output_w_ + h_ / inertia * (torque - gravity(output_q_) - external)) / (1.0 + h_ * e.viscous / inertia);
    output_w_ = after_set_valued_friction(free, h_ / inertia * e.coulomb);
    output_q_ += h_ * output_w_;
    return torque;
  }

  const Joint& joint_;
  const RecordConditions& conditions_;
  const Controller& controller_;
  const Trajectory& trajectory_;
  double h_;
  Random random_;
  External external_;
  ColouredNoise coloured_;
  Presliding bristles_;

  double time_s_ = 0.0, q_ = 0.0, w_ = 0.0, acceleration_ = 0.0, output_q_ = 0.0, output_w_ = 0.0;
  double current_ = 0.0, integral_ = 0.0, load_torque_ = 0.0, temperature_ = 0.0;
  double since_turn_s_ = 1e3, lagged_ = 0.0, direction_ = 0.0;
};

}  // namespace

Motion simulate(const Joint& joint, const RecordConditions& conditions, const Controller& controller,
                const Trajectory& trajectory, double step_s) {
  return Run(joint, conditions, controller, trajectory, step_s).all();
}

}  // namespace flexspline::worlds
