#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hil/plant/excitation.hpp"
#include "hil/thesis_figures/figures.hpp"
#include "hil/thesis_figures/twin_runs.hpp"
#include "hil/thesis_models/published.hpp"

namespace flexspline::thesis_figures {
namespace {

namespace published = report::published;

Drawn signals(std::uint64_t) {
  Drawn drawn;
  const std::pair<const char*, plant::Waveform> kinds[] = {{"saw-tooth", plant::Waveform::triangle},
                                                           {"square", plant::Waveform::square},
                                                           {"sine", plant::Waveform::sine},
                                                           {"composite, eq. 60", plant::Waveform::composite}};
  for (const auto& [name, waveform] : kinds) {
    Curve c{"", {}, {}, Stroke::solid};
    for (int k = 0; k <= 2000; ++k) {
      c.x.push_back(1e-3 * k);
      c.y.push_back(plant::waveform(waveform, 1e-3 * k));
    }
    drawn.panels.push_back({name, "cycles", "current, share of full", {c}});
  }
  drawn.ours = "eq. 60 is divided by its largest magnitude, so that it stays within the current's limit";
  return drawn;
}

// The bare motor under the measured current, held from sample to sample.
std::vector<double> motor_velocity(const report::DcMotor& motor, const std::vector<double>& current) {
  const auto block = report::make_friction_block(report::FrictionMethod::implicit, {motor.inertia, {motor.friction}},
                                                 published::kSampleS);
  std::vector<double> velocity;
  double w = 0.0;
  for (const double i : current) {
    velocity.push_back(w);
    w = block->next_velocity(w, motor.torque_constant * i);
  }
  return velocity;
}

// Table 2, final decision: one friction for both directions.
report::DcMotor one_friction() {
  report::DcMotor motor = published::identified_motor();
  motor.torque_constant = 4.27e-2;
  motor.friction = report::FrictionCurve::symmetric({4.0e-5, 1.2e-2, 0.0, 1.0});
  return motor;
}

Drawn typical(std::uint64_t seed) {
  const plant::Record r = twin_record(rhs100::table_3_fast(), "composite", seed);
  return {{{"current", "time, s", "current, A", {part("", r, r.current_a, 2.0, 8.0, Stroke::solid)}},
           {"velocity", "time, s", "velocity, rad/s", {part("", r, r.motor_velocity_rad_s, 2.0, 8.0, Stroke::solid)}}},
          fmt::format("noise of the tachometer {:.2g} rad/s, {:.2g} % of the peak", r.tachometer_noise_std,
                      100.0 * r.tachometer_noise_std /
                          std::abs(*std::max_element(r.motor_velocity_rad_s.begin(), r.motor_velocity_rad_s.end())))};
}

Drawn verification(const rhs100::Set& set, const std::vector<const char*>& names, double from_s, double to_s,
                   bool with_modified, std::uint64_t seed) {
  Drawn drawn;
  for (const char* name : names) {
    const plant::Record r = twin_record(set, name, seed);
    const std::vector<double> first = motor_velocity(one_friction(), r.current_a);
    Panel panel{name,
                "time, s",
                "velocity, rad/s",
                {part("measured (twin)", r, r.motor_velocity_rad_s, from_s, to_s, Stroke::dotted),
                 part("one friction", r, first, from_s, to_s, Stroke::solid)}};
    std::string text = fmt::format("{}: {:.0f} %", name, error_percent(r.motor_velocity_rad_s, first));
    if (with_modified) {
      const std::vector<double> second = motor_velocity(published::identified_motor(), r.current_a);
      panel.curves.push_back(part("by direction", r, second, from_s, to_s, Stroke::dashed));
      text += fmt::format(" / {:.1f} %", error_percent(r.motor_velocity_rad_s, second));
    }
    drawn.panels.push_back(std::move(panel));
    drawn.ours += (drawn.ours.empty() ? "" : "; ") + text;
  }
  drawn.ours = (with_modified ? "velocity, one friction / by direction: " : "velocity: ") + drawn.ours;
  return drawn;
}

Drawn slow(std::uint64_t seed) {
  return verification(rhs100::table_3_slow(), {"slow-1", "slow-2"}, 4.0, 12.0, false, seed);
}
Drawn fast(std::uint64_t seed) {
  return verification(rhs100::table_3_fast(), {"saw-tooth", "square", "sine", "composite"}, 4.0, 10.0, false, seed);
}
Drawn slow_modified(std::uint64_t seed) {
  return verification(rhs100::table_3_slow(), {"slow-1", "slow-2"}, 4.0, 12.0, true, seed);
}
Drawn fast_modified(std::uint64_t seed) {
  return verification(rhs100::table_3_fast(), {"saw-tooth", "square", "sine", "composite"}, 4.0, 10.0, true, seed);
}

}  // namespace

std::vector<Figure> motor_figures() {
  return {{22, "four current inputs", "saw-tooth, square, sine, composite", signals, ""},
          {23, "typical input and output", "noise below 0.5 % of the peak", typical, ""},
          {24, "motor, low velocity, one friction", "faster in negative direction; break-away too late", slow, ""},
          {25, "motor, high velocity, one friction", "differs by direction", fast, ""},
          {26, "motor, low velocity, friction by direction", "matching is accomplished", slow_modified, ""},
          {27, "motor, high velocity, friction by direction", "still little discrepancy", fast_modified, ""}};
}

}  // namespace flexspline::thesis_figures
