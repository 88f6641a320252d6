#include "host/output/answers/effect_curve.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string_view>

#include "host/output/answers/json.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::output {
namespace {

using catalogue::Balance;
using catalogue::Entry;
using catalogue::Phase;
using catalogue::Real;
using Inputs = effects::Inputs<Real>;

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kPoints = 240;
constexpr std::size_t kCycles = 3;  // a loop is drawn when it has closed

// A drive of the report's class.
constexpr double kGear = 100.0;
constexpr double kTorqueConstant = 0.05;
constexpr double kStiffness = 6300.0;
constexpr double kTorsion = 1.6e-3;  // some 10 N m
constexpr double kLoad = 10.0;
constexpr double kRatedTorque = 40.0;
constexpr double kVelocity = 100.0;
constexpr double kTravel = 0.5;
constexpr double kCurrent = 4.0;
constexpr double kWarm = 30.0;

catalogue::DriveConstants<double> drive() {
  catalogue::DriveConstants<double> d;
  d.gear_ratio = kGear;
  d.torque_constant = kTorqueConstant;
  d.rated_velocity = kRatedVelocityOfCurves;
  d.reference_temperature = kWarm;
  return d;
}

std::vector<double> usual_values(const Entry& entry) {
  std::vector<double> values;
  for (const auto& p : entry.parameters) values.push_back(p.usual);
  return values;
}

// A motion, and which of its signals is the x axis.
struct Sweep {
  unsigned reads = 0;  // the signal that an effect must read for this to be tried
  std::string x_label;
  std::vector<double> x;
  std::vector<Inputs> inputs;
  std::size_t drawn_from = 0;  // the samples before only bring the memory to its steady cycle
  bool one_way = false;        // points are in the order of x; a change of direction is a gap
};

// Motor and output at ease: warm, loaded, turning slowly forward.
Inputs at_ease() {
  Inputs in{};
  in.velocity = in.speed = 1.0;
  in.direction = in.output_direction = in.torsion_direction = 1.0;
  in.output_velocity = in.velocity / kGear;
  in.torque = in.torque_magnitude = kLoad;
  in.torsion = kLoad / kStiffness;
  in.current = 1.0;
  in.temperature = kWarm;
  in.viscous_scale = in.coulomb_scale = 1.0;
  in.elapsed = 1e-3;
  return in;
}

void set_velocity(Inputs& in, double velocity) {
  in.velocity = velocity;
  in.speed = std::abs(velocity);
  in.direction = in.output_direction = velocity < 0.0 ? -1.0 : 1.0;
  in.output_velocity = velocity / kGear;
}

void set_torque(Inputs& in, double torque) {
  in.torque = torque;
  in.torque_magnitude = std::abs(torque);
}

// An even number of values, so that none between -top and top is zero: there a direction would be missing.
Sweep sweep_of(unsigned reads, std::string x_label, double low, double high,
               const std::function<void(Inputs&, double)>& set) {
  Sweep sweep{reads, std::move(x_label), {}, {}, 0, true};
  for (std::size_t k = 0; k < kPoints; ++k) {
    const double x = low + (high - low) * static_cast<double>(k) / (kPoints - 1.0);
    Inputs in = at_ease();
    set(in, x);
    sweep.x.push_back(x);
    sweep.inputs.push_back(in);
  }
  return sweep;
}

// A sine of one second, a few times.
Sweep loop_of(unsigned reads, std::string x_label, double top,
              const std::function<void(Inputs&, double x, double slope)>& set) {
  Sweep sweep{reads, std::move(x_label), {}, {}, (kCycles - 1) * kPoints, false};
  for (std::size_t k = 0; k <= kCycles * kPoints; ++k) {
    const double phase = kTurn * static_cast<double>(k) / static_cast<double>(kPoints);
    Inputs in = at_ease();
    in.elapsed = 1.0 / static_cast<double>(kPoints);
    const double x = top * std::sin(phase);
    set(in, x, kTurn * top * std::cos(phase));
    sweep.x.push_back(x);
    sweep.inputs.push_back(in);
  }
  return sweep;
}

// How far a signal must go for the effect to show: a few times what its parameters state in that signal's unit.
double range_of(const Entry& entry, std::string_view unit, std::string_view inverse, double otherwise) {
  double range = 0.0;
  for (const auto& p : entry.parameters) {
    if (p.kind == catalogue::Kind::linear || p.usual == 0.0) continue;
    // A grid ends at its largest value.
    const double factor = p.kind == catalogue::Kind::grid ? 1.2 : 5.0;
    if (p.unit.rotary == unit) range = std::max(range, factor * std::abs(p.usual));
    if (!inverse.empty() && p.unit.rotary == inverse) range = std::max(range, factor / std::abs(p.usual));
  }
  return range > 0.0 ? range : otherwise;
}

// A torsion swings against a locked output, so that the motor moves with it.
void set_torsion(Inputs& in, double torsion, double rate) {
  in.torsion = torsion;
  in.torsion_rate = rate;
  in.torsion_direction = rate < 0.0 ? -1.0 : 1.0;
  in.angle = kGear * torsion;
  set_velocity(in, kGear * rate);
  in.output_velocity = 0.0;
  set_torque(in, kStiffness * torsion);
}

// The most special signal first.
std::vector<Sweep> sweeps_for(const Entry& entry) {
  const double turn = 2.0 * std::numbers::pi;
  const double torsion = range_of(entry, "rad", "1/rad", kTorsion);
  const double travel = range_of(entry, "rad", "1/rad", kTravel);
  const double velocity = range_of(entry, "rad/s", "s/rad", kVelocity);
  std::vector<Sweep> sweeps;
  sweeps.push_back(
      sweep_of(effects::kTemperature, "temperature (degC)", 10.0, 60.0, [](Inputs& in, double temperature) {
        set_velocity(in, kVelocity);
        in.temperature = temperature;
      }));
  sweeps.push_back(sweep_of(effects::kOutputAngle, "output angle (rad)", 0.0, turn,
                            [](Inputs& in, double angle) { in.output_angle = angle; }));
  if (!entry.has_state)
    sweeps.push_back(sweep_of(effects::kMotorAngle, "motor angle (rad)", 0.0, turn,
                              [](Inputs& in, double angle) { in.angle = angle; }));
  sweeps.push_back(loop_of(effects::kTorsion, "torsion (rad)", torsion, set_torsion));
  if (!entry.has_state) {
    sweeps.push_back(
        sweep_of(effects::kTorque, "torque through the gear (N*m)", -kRatedTorque, kRatedTorque, set_torque));
    sweeps.push_back(sweep_of(effects::kCurrent, "motor current (A)", -kCurrent, kCurrent,
                              [](Inputs& in, double current) { in.current = current; }));
  }
  sweeps.push_back(loop_of(effects::kCurrent, "motor current (A)", kCurrent,
                           [](Inputs& in, double current, double) { in.current = current; }));
  sweeps.push_back(
      loop_of(effects::kMotorMotion, "motor angle (rad)", travel, [&](Inputs& in, double angle, double rate) {
        in.angle = angle;
        set_velocity(in, rate);
      }));
  // Only an effect with memory differs between the two directions over the angle; without memory a curve over the
  // velocity shows more.
  if (!entry.has_state) sweeps.pop_back();
  sweeps.push_back(sweep_of(effects::kMotorMotion, "motor velocity (rad/s)", -velocity, velocity, set_velocity));
  sweeps.push_back(sweep_of(effects::kMotorMotion, "motor acceleration (rad/s^2)", -1000.0, 1000.0,
                            [](Inputs& in, double acceleration) { in.acceleration = acceleration; }));
  sweeps.push_back(sweep_of(effects::kOutputMotion, "output velocity (rad/s)", -velocity / kGear, velocity / kGear,
                            [](Inputs& in, double v) { set_velocity(in, kGear * v); }));
  sweeps.push_back(sweep_of(effects::kOutputMotion, "output acceleration (rad/s^2)", -10.0, 10.0,
                            [](Inputs& in, double acceleration) { in.output_acceleration = acceleration; }));
  return sweeps;
}

double torque_on(const effects::Torques<Real>& torques, Balance balance) {
  switch (balance) {
    case Balance::motor:
      return torques.motor;
    case Balance::transmission:
      return torques.transmission;
    case Balance::load:
      return torques.load;
  }
  return 0.0;
}

// The effect, and what it acts on where it adds no torque of its own.
class SweepModel {
 public:
  explicit SweepModel(const Entry& entry) : entry_(entry), balance_(entry.info->balance) {
    const Entry* other = nullptr;
    if (entry.info->phase == Phase::shift) {
      other = catalogue::find("linear_stiffness");
      caption_ = "a linear stiffness behind it";
      change_caption_ = "what it changes of a linear stiffness";
    } else if (entry.info->phase == Phase::modulate) {
      const auto names = catalogue::split_names(entry.info->modulates);
      other = names.empty() ? nullptr : catalogue::find(names.front());
      if (other) caption_ = std::string(other->name()) + ", as it is modulated";
    }
    if (other == nullptr) return;
    const std::vector<double> others = usual_values(*other);
    acted_on_ = other->make(others.data(), drive());
    balance_ = other->info->balance;
  }

  Balance balance() const { return balance_; }
  // Over the torsion a shift is drawn with the stiffness behind it; over other signals that would hide it.
  bool only_change(const Sweep& sweep) const {
    return entry_.info->phase == Phase::shift && sweep.reads != effects::kTorsion;
  }
  const std::string& caption(const Sweep& sweep) const { return only_change(sweep) ? change_caption_ : caption_; }

  std::vector<double> torques(const Sweep& sweep, Balance balance) {
    const std::vector<double> values = usual_values(entry_);
    effect_ = entry_.make(values.data(), drive());  // memory from rest
    std::vector<double> torque;
    for (std::size_t k = 0; k < sweep.inputs.size(); ++k) {
      const Inputs& in = sweep.inputs[k];
      if (k > 0) effect_->advance(in, sweep.inputs[k - 1]);
      effects::Torques<Real> sum{};
      effect_->evaluate(in, sum);
      if (acted_on_) {
        Inputs changed = in;
        effect_->shift(changed);
        effect_->modulate(changed);
        acted_on_->evaluate(changed, sum);
      }
      double total = torque_on(sum, balance);
      if (acted_on_ && only_change(sweep)) {
        effects::Torques<Real> unchanged{};
        acted_on_->evaluate(in, unchanged);
        total -= torque_on(unchanged, balance);
      }
      torque.push_back(total);
    }
    torque.erase(torque.begin(), torque.begin() + static_cast<std::ptrdiff_t>(sweep.drawn_from));
    return torque;
  }

 private:
  const Entry& entry_;
  Balance balance_;
  std::string caption_, change_caption_;
  std::unique_ptr<catalogue::Instance> effect_, acted_on_;
};

bool varies(const std::vector<double>& y) {
  const auto [low, high] = std::minmax_element(y.begin(), y.end());
  return *high - *low > 1e-9 * std::max(std::abs(*low), std::abs(*high));
}

std::string y_label(Balance balance) {
  return balance == Balance::motor          ? "torque on the motor (N*m)"
         : balance == Balance::transmission ? "torque through the gear (N*m)"
                                            : "torque on the output (N*m)";
}

EffectCurve drawn(const Sweep& sweep, const std::vector<double>& y, Balance balance, const std::string& caption) {
  EffectCurve curve{{}, {}, sweep.x_label, y_label(balance), caption};
  for (std::size_t k = 0; k < y.size(); ++k) {
    const std::size_t at = sweep.drawn_from + k;
    // A step between two directions is no part of the law.
    if (sweep.one_way && k > 0 && sweep.inputs[at].direction != sweep.inputs[at - 1].direction) {
      curve.x.push_back(0.5 * (sweep.x[at] + sweep.x[at - 1]));
      curve.y.push_back(kGap);
    }
    curve.x.push_back(sweep.x[at]);
    curve.y.push_back(y[k]);
  }
  return curve;
}

}  // namespace

EffectCurve effect_curve(const Entry& entry) {
  SweepModel sweep_model(entry);
  const std::vector<Sweep> sweeps = sweeps_for(entry);
  std::vector<Balance> balances{sweep_model.balance()};
  for (const Balance b : {Balance::motor, Balance::transmission, Balance::load})
    if (b != sweep_model.balance() && entry.adds_to(b)) balances.push_back(b);
  for (const Balance balance : balances)
    for (const bool all : {false, true})
      for (const Sweep& sweep : sweeps) {
        if (!all && (entry.info->reads & sweep.reads) == 0) continue;
        const std::vector<double> y = sweep_model.torques(sweep, balance);
        if (varies(y)) return drawn(sweep, y, balance, sweep_model.caption(sweep));
      }
  // The same everywhere.
  const auto over = std::find_if(sweeps.begin(), sweeps.end(),
                                 [](const Sweep& s) { return s.one_way && s.reads == effects::kMotorMotion; });
  return drawn(*over, sweep_model.torques(*over, sweep_model.balance()), sweep_model.balance(),
               sweep_model.caption(*over));
}

nlohmann::json curve_json(const EffectCurve& curve) {
  nlohmann::json x = nlohmann::json::array(), y = nlohmann::json::array();
  for (const double value : curve.x) x.push_back(json_number(value));
  for (const double value : curve.y) y.push_back(json_number(value));
  return {{"x", std::move(x)},
          {"y", std::move(y)},
          {"x_label", curve.x_label},
          {"y_label", curve.y_label},
          {"caption", curve.caption}};
}

}  // namespace flexspline::output
