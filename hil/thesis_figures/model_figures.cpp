#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hil/plant/excitation.hpp"
#include "hil/thesis_figures/figures.hpp"
#include "hil/thesis_models/dc_motor.hpp"
#include "hil/thesis_models/friction_block.hpp"
#include "hil/thesis_models/harmonic_drive.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/runge_kutta.hpp"

namespace flexspline::thesis_figures {
namespace {

namespace published = report::published;
using report::FrictionMethod;

std::vector<double> range(double low, double high, std::size_t points) {
  std::vector<double> x(points);
  for (std::size_t k = 0; k < points; ++k)
    x[k] = low + (high - low) * static_cast<double>(k) / static_cast<double>(points - 1);
  return x;
}

template <class F>
Curve curve(std::string label, const std::vector<double>& x, F&& f, Stroke stroke = Stroke::solid) {
  Curve c{std::move(label), x, {}, stroke};
  for (const double v : x) c.y.push_back(f(v));
  return c;
}

Drawn saturation(std::uint64_t) {
  const report::DcMotor motor = published::identified_motor();
  const auto current = range(-2.0 * motor.current_limit_a, 2.0 * motor.current_limit_a, 201);
  return {{{"eq. 26",
            "commanded current, A",
            "motor torque, N m",
            {curve("", current, [&](double i) { return motor.torque(i); })}}},
          fmt::format("torque ends at {:.3g} N m, reached at {:.3g} A", motor.torque(1e3), motor.current_limit_a)};
}

// Figures 4 and 6: what the block answers to a current in steps beyond the limit and to a load.
Drawn motor_block(std::uint64_t) {
  const report::DcMotor motor = published::identified_motor();
  const auto block =
      report::make_friction_block(FrictionMethod::implicit, {motor.inertia, {motor.friction}}, published::kSampleS);
  const std::size_t samples = 8000;
  Curve current{"current", {}, {}, Stroke::solid}, velocity{"", {}, {}, Stroke::solid},
      angle{"", {}, {}, Stroke::solid};
  double w = 0.0, q = 0.0, fastest = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * published::kSampleS;
    const double amps = (k / 2000) % 2 == 0 ? 0.4 : -0.4, load = t > 4.0 ? 0.003 : 0.0;
    current.x.push_back(t);
    current.y.push_back(amps);
    velocity.x.push_back(t);
    velocity.y.push_back(w);
    angle.x.push_back(t);
    angle.y.push_back(q);
    w = block->next_velocity(w, motor.driving_torque(amps, load));
    q += published::kSampleS * w;
    fastest = std::max(fastest, std::abs(w));
  }
  return {{{"input: current; from 4 s on a load of 3 mN m", "time, s", "current, A", {current}},
           {"output: velocity", "time, s", "velocity, rad/s", {velocity}},
           {"output: angle", "time, s", "angle, rad", {angle}}},
          fmt::format("fastest {:.4g} rad/s", fastest)};
}

Curve sliding(FrictionMethod method, double velocity, double driving, int& sign_changes) {
  // Figures 9 to 11 give neither mass nor force nor step: 1 kg at 0.5 m/s on 0.5 N; variable steps of 0.1 to 10 ms.
  const report::StepLimits limits{1e-4, 1e-2, 1e-6};
  const report::Shaft shaft{1.0, {report::FrictionCurve::symmetric({0.0, 0.5, 0.0, 1.0})}};
  const bool is_layer = method == FrictionMethod::boundary_layer;
  const auto block = report::make_friction_block(method, shaft, is_layer ? limits.longest_s : limits.shortest_s);
  Curve c{"", {0.0}, {velocity}, Stroke::solid};
  double last = 0.0;
  report::variable_step(
      [&](double, const std::array<double, 1>& y) {
        return std::array<double, 1>{driving - block->torque(y[0], driving)};
      },
      0.0, std::array<double, 1>{velocity}, 2.0, limits,
      [&](double t, const std::array<double, 1>& y) {
        c.x.push_back(t);
        c.y.push_back(y[0]);
        if (t > 1.1 && y[0] * last < 0.0) ++sign_changes;
        if (y[0] != 0.0) last = y[0];
      });
  return c;
}

Drawn chatter(FrictionMethod method) {
  int changes = 0;
  const Curve whole = sliding(method, 0.5, 0.0, changes);
  Curve rest{"", {}, {}, Stroke::solid};
  double largest = 0.0;
  for (std::size_t k = 0; k < whole.x.size(); ++k) {
    if (whole.x[k] < 1.1) continue;
    rest.x.push_back(whole.x[k]);
    rest.y.push_back(whole.y[k]);
    largest = std::max(largest, std::abs(whole.y[k]));
  }
  return {{{"a mass of 1 kg at 0.5 m/s on 0.5 N of friction", "time, s", "velocity, m/s", {whole}},
           {"after it should have stopped", "time, s", "velocity, m/s", {rest}}},
          fmt::format("from 1.1 s to 2 s: {} sign changes, at most {:.2g} m/s", changes, largest)};
}

Drawn chatter_1e_8(std::uint64_t) {
  return chatter(FrictionMethod::threshold_1e_8);
}
Drawn chatter_1e_4(std::uint64_t) {
  return chatter(FrictionMethod::threshold_1e_4);
}
Drawn no_chatter(std::uint64_t) {
  return chatter(FrictionMethod::boundary_layer);
}

// Figure 7: break-away under a force that rises slowly.
Drawn break_away(std::uint64_t) {
  const report::Shaft shaft{1.0, {report::FrictionCurve::symmetric({0.2, 0.5, 0.0, 1.0})}};
  const auto block = report::make_friction_block(FrictionMethod::implicit, shaft, 1e-3);
  Curve force{"driving", {}, {}, Stroke::dashed}, friction{"friction", {}, {}, Stroke::solid},
      speed{"", {}, {}, Stroke::solid};
  double v = 0.0, moves_at = -1.0;
  for (int k = 0; k < 2000; ++k) {
    const double t = 1e-3 * k, f = 0.5 * t;
    force.x.push_back(t);
    force.y.push_back(f);
    friction.x.push_back(t);
    friction.y.push_back(block->torque(v, f));
    speed.x.push_back(t);
    speed.y.push_back(v);
    v = block->next_velocity(v, f);
    if (moves_at < 0.0 && v > 0.0) moves_at = f;
  }
  return {{{"1 kg, 0.5 N of static friction", "time, s", "force, N", {force, friction}},
           {"velocity", "time, s", "velocity, m/s", {speed}}},
          fmt::format("it moves from a force of {:.3g} N on", moves_at)};
}

Drawn layer(std::uint64_t) {
  const report::Shaft shaft{published::kEffectiveInertia, {published::total_friction()}};
  const report::BoundaryLayerFriction block(shaft, published::kSampleS);
  const auto v = range(-1.5, 1.5, 601);
  return {
      {{"motor shaft of the drive, steps of 1 ms",
        "velocity, rad/s",
        "friction, N m",
        {curve("with the layer", v, [&](double w) { return block.torque(w, 0.0); }),
         curve(
             "the law", v, [&](double w) { return shaft.friction(w); }, Stroke::dashed)}}},
      fmt::format("layer of eq. 32: {:.3g} rad/s forwards, {:.3g} rad/s backwards", block.width(1), block.width(-1))};
}

Drawn static_viscous(std::uint64_t) {
  const report::FrictionCurve f = published::identified_motor().friction;
  const auto v = range(-400.0, 400.0, 801);
  return {{{"table 3, final decision",
            "velocity, rad/s",
            "friction, N m",
            {curve("", v, [&](double w) { return f.torque(w); })}}},
          fmt::format("break-away {:.3g} N m forwards, {:.3g} N m backwards", f.dry(0.0, 1), f.dry(0.0, -1))};
}

Drawn stribeck(std::uint64_t) {
  const report::FrictionCurve hess = published::simulated_motor().friction;
  report::FrictionCurve tustin = hess;
  tustin.shape = report::Stribeck::tustin;
  const auto v = range(-0.5, 0.5, 1001);
  return {{{"table 1",
            "velocity, rad/s",
            "friction, N m",
            {curve("Hess and Soom, eq. 52", v, [&](double w) { return hess.torque(w); }),
             curve(
                 "Tustin, eq. 53", v, [&](double w) { return tustin.torque(w); }, Stroke::dashed)}}},
          fmt::format("break-away {:.3g} N m, least friction {:.3g} N m", hess.dry(0.0, 1), [&] {
            double least = 1.0;
            for (double w = 1e-3; w < 1.0; w += 1e-3) least = std::min(least, hess.torque(w));
            return least;
          }())};
}

// Models 1 to 3: the same turn of the wave generator, the output held.
Drawn models(std::uint64_t) {
  const report::IdealDrive ideal{published::kGearRatio};
  report::CompliantDrive compliant;
  compliant.spring = published::cubic_spring();
  report::LossyDrive lossy;
  lossy.spring = report::CubicSpring(published::kStiffness, 0.0);
  lossy.damping_torque = published::kDampingTorque;
  lossy.damping_exponent = published::kDampingExponent;
  const auto torque = range(-40.0, 40.0, 401);
  Curve loop{"model 3 (eq. 42), 0.5 Hz", {}, {}, Stroke::solid},
      spring{"model 2 (eq. 37), cubic", {}, {}, Stroke::dashed};
  for (int k = 0; k <= 2000; ++k) {
    const double phase = 2.0 * M_PI * k / 1000.0, x = 5e-3 * std::sin(phase), v = 5e-3 * M_PI * std::cos(phase);
    loop.x.push_back(1e3 * x);
    loop.y.push_back(lossy.torsion_torque(x, v));
    spring.x.push_back(1e3 * x);
    spring.y.push_back(compliant.spring.torque(x));
  }
  return {{{"torque at the wave generator (eq. 35)",
            "flexspline torque, N m",
            "torque, N m",
            {curve("model 1", torque, [&](double t) { return ideal.input_torque(t); })}},
           {"torsion (eq. 38, solved without its cancellation)",
            "flexspline torque, N m",
            "torsion, mrad",
            {curve("model 2", torque, [&](double t) { return 1e3 * compliant.spring.torsion(t); })}},
           {"torque over torsion", "torsion, mrad", "torque, N m", {loop, spring}}},
          fmt::format("model 2 twists by {:.3g} mrad under 40 N m; loop of model 3 {:.3g} N m high at zero torsion",
                      1e3 * compliant.spring.torsion(40.0), 2.0 * lossy.structural_damping(5e-3 * M_PI))};
}

}  // namespace

std::vector<Figure> model_figures() {
  return {{4, "DC motor as a black box: its answer", "a drawing", motor_block, ""},
          {5, "saturation of the servo amplifier's current", "bounded by the amplifier", saturation, ""},
          {6, "DC motor model simulated", "a block diagram", motor_block, ""},
          {7, "a mass under driving and friction forces", "friction equals the driving force up to static friction",
           break_away, ""},
          {8, "modified friction curve", "finite slope within the layer", layer, ""},
          {9, "sliding mass, threshold 1e-8", "unrealistic chattering around zero", chatter_1e_8, ""},
          {10, "sliding mass, threshold 1e-4", "the velocity stays bounded by the threshold", chatter_1e_4, ""},
          {11, "sliding mass, boundary layer", "no chattering", no_chatter, ""},
          {12, "model 1, ideal transmission", "a drawing", models, ""},
          {14, "model 2, with compliance", "a drawing", models, ""},
          {15, "model 3, with compliance and friction", "a drawing", models, ""},
          {19, "static and viscous friction", "a sketch", static_viscous, ""},
          {20, "static, viscous and Stribeck friction", "a sketch", stribeck, ""}};
}

}  // namespace flexspline::thesis_figures
