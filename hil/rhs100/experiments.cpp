#include "hil/rhs100/experiments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "hil/rhs100/models.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"

namespace flexspline::rhs100 {
namespace {

namespace published = report::published;

constexpr double kTorqueConstant = 4.275e-2;  // table 3
constexpr double kFastNoise = 0.01;           // of each record's peak
constexpr double kSlowNoise = 0.02;
constexpr double kMotorNoise = 0.005;  // fast runs of the bare motor (section 3.5)

void set_effect(plant::Drive& drive, std::string_view type,
                std::initializer_list<std::pair<const char*, double>> parameters) {
  std::erase_if(drive.effects, [&](const plant::Effect& e) { return e.type == type; });
  plant::Effect effect;
  effect.type = type;
  effect.present = true;
  for (const auto& [key, value] : parameters) effect.parameters.push_back({key, "", value, false});
  drive.effects.push_back(std::move(effect));
}

void set_noise(plant::Drive& drive, double share) {
  drive.sensors.current = {share, 1e-4, 0.0, 0.0};
  drive.sensors.torque = {share, 1e-4, 0.0, 0.0};
  drive.sensors.tachometer = {share, 1e-4, 0.0, 0.0};
}

void set_friction(plant::Drive& drive, const published::FrictionRow& row) {
  set_effect(drive, "inertia", {{"inertia", row.inertia}});
  set_effect(drive, "viscous_friction", {{"coefficient", 0.5 * (row.viscous_positive + row.viscous_negative)}});
  set_effect(drive, "viscous_asymmetry", {{"coefficient", 0.5 * (row.viscous_positive - row.viscous_negative)}});
  set_effect(drive, "coulomb_friction", {{"torque", 0.5 * (row.coulomb_positive + row.coulomb_negative)}});
  set_effect(drive, "coulomb_asymmetry", {{"torque", 0.5 * (row.coulomb_positive - row.coulomb_negative)}});
}

void set_stribeck(plant::Drive& drive, const published::StribeckRow& row) {
  set_effect(drive, "stribeck_gaussian",
             {{"amplitude_positive", row.positive},
              {"amplitude_negative", row.negative},
              {"velocity", published::kTable8Velocity}});
}

void set_compliance(plant::Drive& drive, const published::ComplianceRow& row) {
  set_effect(drive, "linear_stiffness", {{"stiffness", row.stiffness}});
  if (row.cubic != 0.0) set_effect(drive, "cubic_stiffness", {{"stiffness", row.cubic}});
  set_effect(drive, "structural_damping", {{"torque", row.damping}, {"exponent", published::kDampingExponent}});
}

// The drive with the averages of all tables.
plant::Drive average_drive() {
  plant::Drive drive;
  drive.name = "rhs-100";
  drive.gear_ratio = published::kGearRatio;
  drive.torque_constant_nm_a = kTorqueConstant;
  drive.rated_current_a = published::kMotorRatedTorque / kTorqueConstant;
  drive.rated_velocity_rad_s = kFullVelocity;
  drive.rated_torque_nm = published::kRatedTorqueNm;
  drive.current_limit_a = kFullSlowCurrent;
  drive.sensors.has_tachometer = true;
  drive.sensors.motor_counts = kMotorCounts;
  drive.sensors.output_counts = kOutputCounts;
  drive.loop = {0.2, 4.0};
  set_noise(drive, kFastNoise);
  set_friction(drive, published::kTable7Average);
  set_stribeck(drive, published::kTable8Average);
  set_compliance(drive, {"", published::kStiffness, 0.0, published::kDampingTorque});
  set_effect(drive, "output_inertia", {{"inertia", kOutputInertia}});
  set_effect(drive, "output_viscous_friction", {{"coefficient", kOutputViscous}});
  set_effect(drive, "output_coulomb_friction", {{"torque", kOutputCoulomb}});
  return drive;
}

plant::Waveform waveform_of(int code) {
  switch (code) {
    case 1:
      return plant::Waveform::sine;
    case 3:
      return plant::Waveform::triangle;
    case 4:
      return plant::Waveform::square;
    case 7:
      return plant::Waveform::composite;
    case 8:
      return plant::Waveform::asymmetric_sine;
    default:
      throw std::logic_error(fmt::format("rhs-100: no wave form has the code {}", code));
  }
}

// "50-1-02": half of `full`, a sine of 0.2 Hz; without a frequency 0.5 Hz (section 4.2.2).
plant::ExperimentPlan plan_of(const std::string& name, plant::Mode mode, double full, double shortest_s) {
  int percent = 0, code = 0, tenths = 5;
  if (std::sscanf(name.c_str(), "%d-%d-%d", &percent, &code, &tenths) < 2)
    throw std::logic_error("rhs-100: " + name + " is not a name of an experiment");
  plant::ExperimentPlan plan;
  plan.name = name;
  plan.mode = mode;
  plan.waveform = waveform_of(code);
  plan.amplitude = 0.01 * percent * full;
  plan.frequency_hz = 0.1 * tenths;
  // The larger half of the asymmetric sine is the amplitude.
  if (plan.waveform == plant::Waveform::asymmetric_sine) plan.amplitude /= 1.2;
  plan.duration_s = std::max(shortest_s, 3.0 / plan.frequency_hz);
  return plan;
}

Experiment locked_experiment(const published::ComplianceRow& row, bool holdout) {
  Experiment e{average_drive(), plan_of(row.experiment, plant::Mode::current, kFullLockedCurrent, 12.0)};
  set_compliance(e.drive, row);
  e.plan.locked = true;
  e.plan.holdout = holdout;
  return e;
}

// A motor without gear: with a gear of a very large ratio, a locked output and a very small stiffness, the stiffness at
// its shaft is 1e-11 N m/rad. A constant load is modelled by the plant's asymmetry, which acts at rest as well.
plant::Drive bare_motor(double torque_constant, double inertia, double load_nm) {
  plant::Drive drive;
  drive.name = "dc-motor";
  drive.gear_ratio = 1e4;
  drive.torque_constant_nm_a = torque_constant;
  drive.current_limit_a = kFullSlowCurrent;
  drive.sensors.has_tachometer = true;
  set_effect(drive, "inertia", {{"inertia", inertia}});
  set_effect(drive, "coulomb_asymmetry", {{"torque", load_nm}});
  set_effect(drive, "linear_stiffness", {{"stiffness", 1e-3}});
  return drive;
}

plant::ExperimentPlan motor_plan(const char* name, plant::Waveform waveform, double amplitude_a, double frequency_hz,
                                 double duration_s) {
  plant::ExperimentPlan plan;
  plan.name = name;
  plan.mode = plant::Mode::current;
  plan.waveform = waveform;
  plan.amplitude = amplitude_a;
  plan.frequency_hz = frequency_hz;
  plan.duration_s = duration_s;
  plan.locked = true;
  return plan;
}

Set motor_set(std::string name, std::string title, std::string base_model) {
  Set set;
  set.name = std::move(name);
  set.title = std::move(title);
  set.sensors = Sensors::motor;
  set.gear_ratio = 1.0;
  set.base_model = std::move(base_model);
  return set;
}

struct MotorRow {
  double torque_constant, viscous_positive, viscous_negative, coulomb_positive, coulomb_negative;
};

Experiment motor_experiment(const MotorRow& row, plant::ExperimentPlan plan, double noise) {
  const report::DcMotor motor = published::identified_motor();
  Experiment e{bare_motor(row.torque_constant, motor.inertia, 0.0), std::move(plan)};
  set_friction(e.drive, {"", motor.inertia, row.viscous_positive, row.viscous_negative, row.coulomb_positive,
                         row.coulomb_negative});
  set_noise(e.drive, noise);
  return e;
}

MotorRow final_decision() {
  const report::DcMotor motor = published::identified_motor();
  return {motor.torque_constant, motor.friction.positive.viscous, motor.friction.negative.viscous,
          motor.friction.positive.coulomb, motor.friction.negative.coulomb};
}

Experiment simulated_motor(double load_nm, plant::ExperimentPlan plan) {
  const report::DcMotor motor = published::simulated_motor();
  const report::DirectionalFriction& friction = motor.friction.positive;
  Experiment e{bare_motor(motor.torque_constant, motor.inertia, load_nm), std::move(plan)};
  set_effect(e.drive, "viscous_friction", {{"coefficient", friction.viscous}});
  set_effect(e.drive, "coulomb_friction", {{"torque", friction.coulomb}});
  set_effect(e.drive, "stribeck_hess_soom",
             {{"amplitude_positive", friction.stribeck},
              {"amplitude_negative", friction.stribeck},
              {"velocity", friction.stribeck_velocity}});
  set_noise(e.drive, kSlowNoise);
  return e;
}

}  // namespace

Set table_4() {
  Set set{
      "table-4",         "compliance, output locked: linear stiffness and structural damping by row", {}, 100.0, {}, {},
      compliance_model()};
  for (const auto& row : published::kTable4) set.experiments.push_back(locked_experiment(row, false));
  for (const char* name : {"50-3", "50-4", "20-1-02", "40-1-04", "60-1-06", "80-1-08", "100-1-10"}) {
    set.experiments.push_back(locked_experiment({name, published::kStiffness, 0.0, published::kDampingTorque}, true));
  }
  return set;
}

Set table_6() {
  Set set{"table-6", "compliance, output locked: cubic stiffness by row", {}, 100.0, {}, {}, cubic_compliance_model()};
  for (const auto& row : published::kTable6) set.experiments.push_back(locked_experiment(row, false));
  return set;
}

Set table_7() {
  Set set{"table-7", "friction at speed, output free, velocity mode", {}, 100.0, {}, {}, fast_friction_model()};
  for (const auto& row : published::kTable7) {
    Experiment e{average_drive(), plan_of(row.experiment, plant::Mode::velocity, kFullVelocity, 10.0)};
    set_friction(e.drive, row);
    plant::without(e.drive, "stribeck_gaussian");
    set.experiments.push_back(std::move(e));
  }
  return set;
}

Set table_8() {
  Set set{"table-8", "friction at low speed, output free, current mode", {}, 100.0, {}, {}, slow_friction_model()};
  for (const auto& row : published::kTable8) {
    Experiment e{average_drive(), plan_of(row.experiment, plant::Mode::current, kFullSlowCurrent, 15.0)};
    set_stribeck(e.drive, row);
    set_noise(e.drive, kSlowNoise);
    set.experiments.push_back(std::move(e));
  }
  return set;
}

Set table_3_fast() {
  Set set = motor_set("table-3-fast", "the bare motor: saw-tooth, square, sine and composite", motor_model());
  // Of these rows the scan has the last column only. The others are varied by the table's ratio of std to final
  // decision, up in two rows and down in two.
  constexpr double kSpread[] = {0.0082, 0.115, 0.233, 0.09};
  constexpr int kPattern[4][4] = {{1, 1, 1, 1}, {-1, 1, -1, -1}, {-1, -1, 1, -1}, {1, -1, -1, 1}};
  constexpr plant::Waveform kWaveforms[] = {plant::Waveform::triangle, plant::Waveform::square, plant::Waveform::sine,
                                            plant::Waveform::composite};
  constexpr const char* kNames[] = {"saw-tooth", "square", "sine", "composite"};
  for (std::size_t k = 0; k < 4; ++k) {
    MotorRow row = final_decision();
    row.torque_constant *= 1.0 + kSpread[0] * kPattern[k][0];
    row.viscous_positive *= 1.0 + kSpread[1] * kPattern[k][1];
    row.viscous_negative *= 1.0 + kSpread[2] * kPattern[k][2];
    row.coulomb_negative *= 1.0 + kSpread[3] * kPattern[k][3];
    row.coulomb_positive = published::kTable3CoulombPositive[k];
    set.experiments.push_back(motor_experiment(row, motor_plan(kNames[k], kWaveforms[k], 0.5, 0.5, 16.0), kMotorNoise));
  }
  return set;
}

Set table_3_slow() {
  Set set = motor_set("table-3-slow", "the bare motor: slow saw-teeth, the final decision's friction", motor_model());
  const std::pair<double, double> kRuns[] = {{0.30, 0.5}, {0.32, 0.4}, {0.34, 0.3}, {0.36, 0.2}};
  const char* kNames[] = {"slow-1", "slow-2", "slow-3", "slow-4"};
  for (std::size_t k = 0; k < 4; ++k) {
    set.experiments.push_back(motor_experiment(
        final_decision(), motor_plan(kNames[k], plant::Waveform::triangle, kRuns[k].first, kRuns[k].second, 20.0),
        kSlowNoise));
  }
  return set;
}

Set table_1_composite() {
  Set set = motor_set("table-1-composite", "simulation check: a composite of three harmonics, constant load",
                      simulated_motor_model());
  set.load_torque_nm = kSimulationLoad;
  set.experiments.push_back(
      simulated_motor(kSimulationLoad, motor_plan("composite", plant::Waveform::composite, 3.0, 0.25, 180.0)));
  return set;
}

Set table_1_saw_tooth() {
  Set set =
      motor_set("table-1-saw-tooth", "simulation check: a slow saw-tooth, constant load", simulated_stribeck_model());
  set.load_torque_nm = kSlowSimulationLoad;
  set.experiments.push_back(
      simulated_motor(kSlowSimulationLoad, motor_plan("saw-tooth", plant::Waveform::triangle, 0.7, 0.5, 60.0)));
  return set;
}

std::vector<Set> all_sets() {
  return {table_4(),      table_6(),      table_7(),           table_8(),
          table_3_fast(), table_3_slow(), table_1_composite(), table_1_saw_tooth()};
}

plant::Record record(const Set& set, std::size_t experiment, std::uint64_t seed) {
  const Experiment& e = set.experiments.at(experiment);
  std::uint64_t place = 0;
  for (const char c : set.name) place = 131 * place + static_cast<unsigned char>(c);
  plant::Record made = plant::record_one(e.drive, e.plan, seed, 1000 * place + experiment);
  if (set.sensors == Sensors::motor) made.locked = false;
  return made;
}

}  // namespace flexspline::rhs100
