#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "hil/thesis_figures/figures.hpp"
#include "hil/thesis_figures/twin_runs.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"

namespace flexspline::thesis_figures {
namespace {

namespace published = report::published;

// ---- friction, figures 37 to 42 ----

constexpr double kMotionCutoffHz = 50.0;  // the model's jumps at reversals then go through the filter of the torque
constexpr double kMoves = 0.3;            // rad/s, above the tachometer's noise

// Both sides of eq. 82: what the current leaves after the gear, and inertia with friction.
struct Balance {
  plant::Record record;
  std::vector<double> measured, velocity, acceleration;

  Balance(const rhs100::Set& set, const char* name, std::uint64_t seed) : record(twin_record(set, name, seed)) {
    const auto torque = zero_phase(record.torque_nm, kCutoffHz, kHz);
    // The current that is recorded flows from its sample to the next: half a sample later than the other signals.
    std::vector<double> current = record.current_a;
    for (std::size_t k = current.size() - 1; k > 0; --k) current[k] = 0.5 * (current[k] + current[k - 1]);
    current = zero_phase(current, kCutoffHz, kHz);
    velocity = zero_phase(record.motor_velocity_rad_s, kMotionCutoffHz, kHz);
    acceleration.assign(velocity.size(), 0.0);
    for (std::size_t k = 1; k + 1 < velocity.size(); ++k)
      acceleration[k] = 0.5 * kHz * (velocity[k + 1] - velocity[k - 1]);
    const double km = published::identified_motor().torque_constant;
    for (std::size_t k = 0; k < torque.size(); ++k)
      measured.push_back(km * current[k] - torque[k] / published::kGearRatio);
  }
  std::vector<double> model(double inertia, const report::FrictionCurve& friction) const {
    std::vector<double> out;
    for (std::size_t k = 0; k < velocity.size(); ++k)
      out.push_back(inertia * acceleration[k] + friction.torque(velocity[k]));
    return zero_phase(out, kCutoffHz, kHz);
  }
  // At standstill friction is what holds the shaft, which no function of the velocity says.
  double error_in_motion(const std::vector<double>& model) const {
    std::vector<double> a, b;
    for (std::size_t k = 0; k < model.size(); ++k)
      if (std::abs(velocity[k]) > kMoves) {
        a.push_back(measured[k]);
        b.push_back(model[k]);
      }
    return error_percent(a, b);
  }
};

report::FrictionCurve average_without_stribeck() {
  report::FrictionCurve curve = published::total_friction();
  curve.shape = report::Stribeck::none;
  return curve;
}

report::FrictionCurve row_of(const char* name, double& inertia) {
  for (const auto& row : published::kTable7)
    if (std::string_view(row.experiment) == name) {
      inertia = row.inertia;
      return {{row.viscous_positive, row.coulomb_positive}, {row.viscous_negative, row.coulomb_negative}};
    }
  throw std::invalid_argument(std::string("table 7 has no row ") + name);
}

Drawn friction_torques(const rhs100::Set& set, const std::vector<const char*>& names, bool own_row,
                       std::uint64_t seed) {
  Drawn drawn{{}, own_row ? "torque in motion, each row's own values:" : "torque in motion, averages:"};
  for (const char* name : names) {
    const Balance balance(set, name, seed);
    double inertia = published::kEffectiveInertia;
    const bool slow = set.name == "table-8";
    const report::FrictionCurve friction = own_row ? row_of(name, inertia)
                                           : slow  ? published::total_friction()
                                                   : average_without_stribeck();
    const auto y = balance.model(inertia, friction);
    drawn.panels.push_back({name,
                            "time, s",
                            "torque, N m",
                            {part("measured (twin)", balance.record, balance.measured, 3.0, 8.0, Stroke::dotted),
                             part("model", balance.record, y, 3.0, 8.0, Stroke::solid)}});
    drawn.ours += fmt::format(" {} {:.2g} %;", name, balance.error_in_motion(y));
  }
  return drawn;
}

Drawn four_inputs(std::uint64_t seed) {
  return friction_torques(rhs100::table_7(), {"50-1-06", "50-3-06", "85-4-04", "50-7-02"}, true, seed);
}
Drawn nominal_sines(std::uint64_t seed) {
  return friction_torques(rhs100::table_7(), {"50-1-06", "70-1-04", "85-1-04", "100-1-04"}, false, seed);
}
Drawn nominal_others(std::uint64_t seed) {
  return friction_torques(rhs100::table_7(), {"50-3-04", "85-4-04", "50-7-03"}, false, seed);
}
Drawn nominal_slow(std::uint64_t seed) {
  return friction_torques(rhs100::table_8(), {"18-3-02", "22-3-02"}, false, seed);
}

Drawn low_velocity(std::uint64_t seed) {
  const plant::Record r = twin_record(rhs100::table_8(), "18-3-02", seed);
  return {{{"18-3-02", "time, s", "velocity, rad/s", {part("", r, r.motor_velocity_rad_s, 3.0, 12.0, Stroke::solid)}},
           {"18-3-02, near zero", "time, s", "velocity, rad/s", {[&] {
              Curve c = part("", r, zero_phase(r.motor_velocity_rad_s, kCutoffHz, kHz), 3.0, 12.0, Stroke::solid);
              for (double& v : c.y) v = std::abs(v) < 1.0 ? v : std::nan("");
              return c;
            }()}}},
          "see the second panel: standstill, then break-away without a jump back"};
}

Drawn friction_curve(std::uint64_t) {
  const report::FrictionCurve f = published::total_friction();
  Curve c{"", {}, {}, Stroke::solid};
  for (int k = -600; k <= 600; ++k) {
    const double v = 1e-3 * k;
    if (k == 0) continue;
    c.x.push_back(v);
    c.y.push_back(f.torque(v));
  }
  return {{{"tables 7 and 8, averages", "velocity, rad/s", "friction, N m", {c}}},
          fmt::format("rises from {:.3g} to {:.3g} N m forwards, from {:.3g} to {:.3g} N m backwards", f.dry(0.0, 1),
                      f.dry(0.6, 1), f.dry(0.0, -1), f.dry(0.6, -1))};
}

// ---- the whole drive, figures 45 to 60 ----

struct Verified {
  plant::Record record;
  std::vector<double> velocity, torque, simulated_velocity, simulated_torque;

  Verified(plant::Record r, const report::DriveSystemParts& parts) : record(std::move(r)) {
    velocity = zero_phase(record.motor_velocity_rad_s, kCutoffHz, kHz);
    torque = zero_phase(record.torque_nm, kCutoffHz, kHz);
    const report::SystemTrace trace = simulate(parts, record);
    simulated_velocity = zero_phase(input_velocity(trace), kCutoffHz, kHz);
    simulated_torque = zero_phase(trace.torque_nm, kCutoffHz, kHz);
  }
  double from() const { return 2.0; }
  double to() const { return 6.0; }
  void add_to(Drawn& drawn, const std::string& name) const {
    const Stroke measured = Stroke::solid, simulated = Stroke::dotted;
    drawn.panels.push_back({name + ", motor velocity",
                            "time, s",
                            "velocity, rad/s",
                            {part("measured (twin)", record, velocity, from(), to(), measured),
                             part("simulation", record, simulated_velocity, from(), to(), simulated)}});
    drawn.panels.push_back({name + ", torque",
                            "time, s",
                            "torque, N m",
                            {part("measured (twin)", record, torque, from(), to(), measured),
                             part("simulation", record, simulated_torque, from(), to(), simulated)}});
    drawn.ours += fmt::format("{}{}: velocity {:.2g} %, torque {:.2g} %", drawn.ours.empty() ? "" : "; ", name,
                              error_percent(velocity, simulated_velocity), error_percent(torque, simulated_torque));
  }
};

Drawn one(const std::string& name, const plant::Record& record) {
  Drawn drawn;
  Verified(record, nominal_parts()).add_to(drawn, name);
  return drawn;
}

constexpr double kHalfSpeed = 0.5 * rhs100::kFullVelocity;

Drawn free_and_locked(std::uint64_t seed) {
  Drawn drawn;
  Verified(twin_record(free_sine(kHalfSpeed, 1.0), seed), nominal_parts()).add_to(drawn, "free, 1 Hz");
  Verified(twin_record(rhs100::table_4(), "50-1", seed), nominal_parts()).add_to(drawn, "locked, 50-1");
  return drawn;
}

struct Variant {
  const char* name;
  report::DriveSystemParts parts;
  Stroke stroke;
};

Drawn compare(const plant::Record& record, const std::vector<Variant>& variants, const char* title) {
  const std::vector<double> velocity = zero_phase(record.motor_velocity_rad_s, kCutoffHz, kHz);
  Drawn drawn{{}, "velocity:"};
  for (std::size_t k = 1; k < variants.size(); ++k) {
    Panel panel{std::string(title) + ", " + variants[k].name,
                "time, s",
                "velocity, rad/s",
                {part("measured (twin)", record, velocity, 2.0, 5.0, Stroke::solid)}};
    for (const std::size_t at : {std::size_t{0}, k}) {
      const auto v = zero_phase(input_velocity(simulate(variants[at].parts, record)), kCutoffHz, kHz);
      panel.curves.push_back(part(variants[at].name, record, v, 2.0, 5.0, variants[at].stroke));
      if (at == k || k == 1) drawn.ours += fmt::format(" {} {:.2g} %;", variants[at].name, error_percent(velocity, v));
    }
    drawn.panels.push_back(std::move(panel));
  }
  return drawn;
}

Drawn friction_matters(std::uint64_t seed) {
  const report::DriveSystemParts full = nominal_parts();
  report::DriveSystemParts no_coulomb = full, no_viscous = full;
  // Without Coulomb friction its negative Stribeck term would drive.
  for (report::DirectionalFriction* f : {&no_coulomb.motor.friction.positive, &no_coulomb.motor.friction.negative})
    f->coulomb = f->stribeck = 0.0;
  no_viscous.motor.friction.positive.viscous = no_viscous.motor.friction.negative.viscous = 0.0;
  return compare(twin_record(free_sine(kHalfSpeed, 1.0), seed),
                 {{"complete", full, Stroke::dash_dotted},
                  {"without Coulomb", no_coulomb, Stroke::dashed},
                  {"without viscous", no_viscous, Stroke::dashed}},
                 "free, 1 Hz");
}

Drawn compliance_matters(std::uint64_t seed) {
  const report::DriveSystemParts full = nominal_parts();
  report::DriveSystemParts soft = full, undamped = full;
  soft.drive.spring = report::CubicSpring(0.1 * published::kStiffness, 0.0);
  undamped.drive.damping_torque = 0.0;
  return compare(twin_record(locked(plant::Waveform::sine, 0.5, 0.5), seed),
                 {{"complete", full, Stroke::dash_dotted},
                  {"a tenth of the stiffness", soft, Stroke::dashed},
                  {"without structural damping", undamped, Stroke::dashed}},
                 "locked, 50 %");
}

using plant::Waveform;
Drawn figure_48(std::uint64_t s) {
  return one("locked sine, 80 %", twin_record(locked(Waveform::sine, 0.8, 0.8), s));
}
Drawn figure_49(std::uint64_t s) {
  return one("100-8", twin_record(rhs100::table_4(), "100-8", s));
}
Drawn figure_50(std::uint64_t s) {
  return one("50-8", twin_record(rhs100::table_4(), "50-8", s));
}
Drawn figure_51(std::uint64_t s) {
  return one("50-1", twin_record(rhs100::table_4(), "50-1", s));
}
Drawn figure_52(std::uint64_t s) {
  return one("locked inverted sine, 50 %", twin_record(locked(Waveform::inverted_sine, 0.5, 0.5), s));
}
Drawn figure_53(std::uint64_t s) {
  return one("50-3", twin_record(rhs100::table_4(), "50-3", s));
}
Drawn figure_54(std::uint64_t s) {
  return one("50-7", twin_record(rhs100::table_4(), "50-7", s));
}
Drawn figure_55(std::uint64_t s) {
  return one("free sine, 1.2 Hz", twin_record(free_sine(kHalfSpeed, 1.2), s));
}
Drawn figure_56(std::uint64_t s) {
  return one("free sine, 1.4 Hz", twin_record(free_sine(kHalfSpeed, 1.4), s));
}
Drawn figure_57(std::uint64_t s) {
  return one("free sine, 1.6 Hz", twin_record(free_sine(kHalfSpeed, 1.6), s));
}
Drawn figure_58(std::uint64_t s) {
  return one("free sine, 1.8 Hz", twin_record(free_sine(kHalfSpeed, 1.8), s));
}
Drawn figure_59(std::uint64_t s) {
  return one("free sine, 2 Hz", twin_record(free_sine(kHalfSpeed, 2.0), s));
}
Drawn figure_60(std::uint64_t s) {
  return one("free sine, 2.5 Hz", twin_record(free_sine(kHalfSpeed, 2.5), s));
}

}  // namespace

std::vector<Figure> friction_figures() {
  return {{37, "least-squares torque for four inputs", "a very good match", four_inputs, ""},
          {38, "nominal model, sine inputs", "a very close match", nominal_sines, ""},
          {39, "nominal model, other inputs", "a very close match", nominal_others, ""},
          {40, "low velocity: break-away", "between -0.1 and 0.1 rad/s", low_velocity, ""},
          {41, "identified friction curve", "rising friction at low velocity, no stiction", friction_curve, ""},
          {42, "nominal model, low speed", "a fairly good match", nominal_slow, ""}};
}

std::vector<Figure> system_figures() {
  return {
      {45, "free and locked: simulation and measurement", "almost perfect velocity in free motion", free_and_locked,
       ""},
      {46, "free, without Coulomb or viscous friction", "not capable of the motion", friction_matters, ""},
      {47, "locked, a tenth of the stiffness or no damping", "larger velocity; wrong phase", compliance_matters, ""},
      {48, "locked sine, 80 %", "a match", figure_48, ""},
      {49, "locked asymmetric sine, 100 %", "a match", figure_49, ""},
      {50, "locked asymmetric sine, 50 %", "a match", figure_50, ""},
      {51, "locked sine, 50 %", "a match", figure_51, ""},
      {52, "locked inverted sine, 50 %", "a match", figure_52, ""},
      {53, "locked triangle, 50 %", "a match", figure_53, ""},
      {54, "locked composite, 50 %", "a match", figure_54, ""},
      {55, "free sine, 1.2 Hz", "a match", figure_55, ""},
      {56, "free sine, 1.4 Hz", "a match", figure_56, ""},
      {57, "free sine, 1.6 Hz", "a match", figure_57, ""},
      {58, "free sine, 1.8 Hz", "a match", figure_58, ""},
      {59, "free sine, 2 Hz", "a match", figure_59, ""},
      {60, "free sine, 2.5 Hz", "a match", figure_60, ""}};
}

}  // namespace flexspline::thesis_figures
