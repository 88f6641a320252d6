// Sensitivity against the transfer functions of linear drives, on which every change has a closed form.
#include "host/engine/sensitivity/sensitivity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "host/engine/sensitivity/lines.hpp"
#include "host/output/answers/sensitivity.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::sensitivity::sensitivity_test {
namespace {

using data::Column;
using std::numbers::pi;
using Complex = std::complex<double>;

constexpr double kSampleS = 1e-3;
constexpr double kGearRatio = 100.0;
constexpr double kInertia = 1e-4;  // kg m^2
constexpr double kViscous = 4e-4;  // N m s/rad
constexpr double kTorque = 0.1;    // amplitude of the effort, N m

struct Part {
  const char* type;
  std::vector<double> values;  // in the order of the catalogue
};

// Torque constant one: current is torque.
model::Model model_of(const std::vector<Part>& parts) {
  model::Model model;
  model.name = "linear";
  model.drive.gear_ratio.value = kGearRatio;
  model.drive.torque_constant_nm_a.value = 1.0;
  model.drive.rated_velocity_rad_s.value = 200.0;
  model.drive.temperature_reference_c.value = 30.0;
  for (const auto& [type, values] : parts) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(type), data::Axis::rotary);
    for (std::size_t k = 0; k < values.size(); ++k) effect.parameters.at(k).value = values[k];
    model.effects.push_back(effect);
  }
  return model;
}

model::Model motor_model() {
  return model_of({{"inertia", {kInertia}}, {"viscous_friction", {kViscous}}});
}

// The steady motion of a linear drive under a sine: its velocity is `response` (rad/s per N m) times the effort.
data::Experiment steady(const char* name, double frequency_hz, Complex response, double duration_s = 8.0) {
  data::Experiment e;
  e.name = name;
  e.sample_s = kSampleS;
  e.current_hold = data::CurrentHold::none;
  const double w = 2.0 * pi * frequency_hz;
  for (int k = 0; k < static_cast<int>(duration_s / kSampleS); ++k) {
    const double t = k * kSampleS;
    const Complex turn = std::polar(kTorque, w * t);
    e.time_s.push_back(t);
    e[Column::current].push_back(turn.real());
    e[Column::motor_velocity].push_back((response * turn).real());
    e[Column::motor_position].push_back((response / Complex(0.0, w) * turn).real());
  }
  e.segments = {{0, e.size()}};
  e.masked.assign(e.size(), 0);
  e.noise_std[static_cast<std::size_t>(Column::motor_velocity)] = 0.0;  // the first sample is to be trusted
  return e;
}

// Velocity over torque of a free motor.
Complex motor_response(double frequency_hz, double inertia, double viscous) {
  return 1.0 / Complex(viscous, 2.0 * pi * frequency_hz * inertia);
}

data::Dataset motor_data(std::initializer_list<double> frequencies_hz) {
  data::Dataset dataset;
  for (const double f : frequencies_hz) {
    const std::string name = std::to_string(f);
    dataset.experiments.push_back(steady(name.c_str(), f, motor_response(f, kInertia, kViscous)));
  }
  return dataset;
}

// Noiseless sines: any filter above them will do, and every sample counts.
const estimation::PipelineOptions kPipeline{.cutoff_hz = 40.0, .mask = false};

const Variant& variant(const Sensitivity& answer, std::string_view label) {
  for (const Variant& v : answer.variants)
    if (v.label() == label) return v;
  throw std::logic_error("no such variant: " + std::string(label));
}

double phase_deg(Complex z) {
  return std::arg(z) * 180.0 / pi;
}

void expect_response(const Response& found, Complex expected) {
  EXPECT_NEAR(found.amplitude_ratio, std::abs(expected), 2e-3 * std::abs(expected));
  EXPECT_NEAR(found.phase_deg, phase_deg(expected), 0.1);
}

TEST(MotionLines, AreTheFrequenciesOfASumOfSinesTheStrongestFirst) {
  std::vector<double> x;
  for (int k = 0; k < 10000; ++k) {
    const double t = k * kSampleS;
    x.push_back(5.0 + 3.0 * t + std::sin(2.0 * pi * 0.73 * t) + 2.0 * std::sin(2.0 * pi * 2.41 * t + 1.0) +
                0.1 * std::sin(2.0 * pi * 5.0 * t));  // the last one is too small
  }
  const std::vector<double> lines = motion_lines(x, 1.0 / kSampleS, 30.0);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_NEAR(lines[0], 2.41, 1e-3);
  EXPECT_NEAR(lines[1], 0.73, 1e-3);
  EXPECT_EQ(motion_lines(x, 1.0 / kSampleS, 2.0).size(), 1u);  // the faster one is above the limit
}

TEST(MotionLines, NeedTwoPeriodsAndSamplesEnough) {
  std::vector<double> x;
  for (int k = 0; k < 1000; ++k) x.push_back(std::sin(2.0 * pi * 1.5 * k * kSampleS));
  EXPECT_TRUE(motion_lines(x, 1.0 / kSampleS, 30.0).empty());
  EXPECT_TRUE(motion_lines(std::vector<double>(63, 1.0), 1.0 / kSampleS, 30.0).empty());
  EXPECT_TRUE(motion_lines(std::vector<double>(1000, 0.0), 1.0 / kSampleS, 30.0).empty());
}

TEST(SineAt, FindsAmplitudePhaseAndShareBesideADrift) {
  std::vector<double> x;
  for (int k = 0; k < 5000; ++k) {
    const double t = k * kSampleS;
    x.push_back(-7.0 + 20.0 * t + 3.0 * std::cos(2.0 * pi * 1.37 * t - 0.8));
  }
  const Sine sine = sine_at(x, 1.0 / kSampleS, 1.37);
  EXPECT_NEAR(std::abs(sine.amplitude), 3.0, 1e-8);
  EXPECT_NEAR(std::arg(sine.amplitude), -0.8, 1e-8);
  // A share of what a straight line leaves: all of it.
  EXPECT_GT(sine.share, 0.999);
  EXPECT_LT(sine_at(x, 1.0 / kSampleS, 6.0).share, 1e-3);
  x[2500] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(sine_at(x, 1.0 / kSampleS, 1.37).share));
}

TEST(Sensitivity, AmplitudeAndPhaseOfAMotorFollowItsTransferFunction) {
  constexpr double f = 2.0;
  const Options options{.pipeline = kPipeline,
                        .more = {{"viscous_friction", "coefficient", 10.0}, {"inertia", "inertia", 2.0}}};
  const Sensitivity answer = analyse(motor_data({f}), motor_model(), options);
  const Complex full = motor_response(f, kInertia, kViscous);

  const SignalError* velocity = answer.full.find("motor_velocity", "free");
  ASSERT_NE(velocity, nullptr);
  EXPECT_LT(velocity->nrmse, 2e-3);
  expect_response(velocity->response, 1.0);
  EXPECT_NEAR(answer.full.experiments[0].signals[1].response.frequency_hz, f, 1e-3);

  const auto response = [&](const char* label) {
    return variant(answer, label).find("motor_velocity", "free")->response;
  };
  expect_response(response("without viscous_friction"), motor_response(f, kInertia, 0.0) / full);
  expect_response(response("viscous_friction.coefficient x 10"), motor_response(f, kInertia, 10.0 * kViscous) / full);
  expect_response(response("inertia.inertia x 2"), motor_response(f, 2.0 * kInertia, kViscous) / full);
}

TEST(Sensitivity, BalanceErrorsAreTheTorqueThatIsMissing) {
  constexpr double f = 2.0;
  const Sensitivity answer = analyse(motor_data({f}), motor_model(), {.pipeline = kPipeline});
  const double speed = kTorque * std::abs(motor_response(f, kInertia, kViscous));
  const auto rmse = [&](const char* label) { return variant(answer, label).find("motor_balance")->rmse; };
  EXPECT_NEAR(rmse("without viscous_friction"), kViscous * speed / std::sqrt(2.0),
              5e-3 * kViscous * speed);  // not whole periods
  const double inertial = 2.0 * pi * f * kInertia * speed;
  EXPECT_NEAR(rmse("without inertia"), inertial / std::sqrt(2.0), 5e-3 * inertial);
  // Of the balance alone: nothing moves without inertia.
  EXPECT_EQ(variant(answer, "without inertia").find("motor_velocity", "free"), nullptr);
  EXPECT_NE(variant(answer, "without inertia").note.find("inertia"), std::string::npos);
  // Growth is in standard deviations of the torque, and the worst stands first.
  EXPECT_NEAR(variant(answer, "without inertia").growth, inertial / kTorque, 5e-3);
  for (std::size_t k = 1; k < answer.variants.size(); ++k)
    EXPECT_GE(answer.variants[k - 1].growth, answer.variants[k].growth);
}

TEST(Sensitivity, StiffnessMovesTheResonanceOfALockedDrive) {
  constexpr double kStiffness = 6300.0, kDamped = 4e-3, f = 8.0;
  const double w = 2.0 * pi * f;
  const auto response = [&](double stiffness) {
    return Complex(0.0, w) / Complex(stiffness / (kGearRatio * kGearRatio) - w * w * kInertia, w * kDamped);
  };
  data::Dataset dataset;
  dataset.experiments.push_back(steady("locked", f, response(kStiffness)));
  data::Experiment& e = dataset.experiments[0];
  e.load = data::Load::locked;
  e.motor_position_zero = data::PositionZero::absolute;
  for (const double q : e[Column::motor_position]) e[Column::torque].push_back(kStiffness * q / kGearRatio);
  const model::Model model =
      model_of({{"inertia", {kInertia}}, {"viscous_friction", {kDamped}}, {"linear_stiffness", {kStiffness}}});
  const Sensitivity answer = analyse(dataset, model, {.pipeline = kPipeline});
  EXPECT_EQ(answer.full.find("motor_velocity", "free"), nullptr);
  expect_response(answer.full.find("motor_velocity", "locked")->response, 1.0);
  for (const double factor : {0.1, 10.0}) {
    const Variant& v =
        variant(answer, factor < 1.0 ? "linear_stiffness.stiffness x 0.1" : "linear_stiffness.stiffness x 10");
    const Complex ratio = response(factor * kStiffness) / response(kStiffness);
    expect_response(v.find("motor_velocity", "locked")->response, ratio);
    expect_response(v.find("torque", "locked")->response, factor * ratio);
    // Friction at the motor is as it was.
    EXPECT_NEAR(v.find("motor_balance")->growth, 0.0, 1e-12);
  }
  // Across the resonance (12.6 Hz; at a tenth of the stiffness 4 Hz) the phase turns over.
  EXPECT_LT(variant(answer, "linear_stiffness.stiffness x 0.1").find("motor_velocity", "locked")->response.phase_deg,
            -90.0);
}

TEST(Sensitivity, OverExperimentsOneGainFitsAllSines) {
  const Sensitivity answer = analyse(motor_data({1.0, 4.0}), motor_model(), {.pipeline = kPipeline});
  const Variant& v = variant(answer, "without viscous_friction");
  Complex across = 0.0;
  double squared = 0.0;
  for (const double f : {1.0, 4.0}) {
    const Complex measured = motor_response(f, kInertia, kViscous), simulated = motor_response(f, kInertia, 0.0);
    across += std::conj(measured) * simulated;
    squared += std::norm(measured);
  }
  expect_response(v.find("motor_velocity", "free")->response, across / squared);
  // Friction matters most where the inertia does least.
  EXPECT_EQ(v.find("motor_velocity", "free")->worst_experiment, motor_data({1.0}).experiments[0].name);
}

TEST(Sensitivity, AModelThatDivergesComesFirstAndHasNoError) {
  model::Model model = motor_model();
  model.effects.push_back(catalogue::blank_effect(catalogue::get("viscous_asymmetry"), data::Axis::rotary));
  model.effects.back().parameters[0].value = 1e-9;
  // Friction that drives the motor in one direction, and soon without bound.
  const Sensitivity answer =
      analyse(motor_data({2.0}), model, {.pipeline = kPipeline, .more = {{"viscous_asymmetry", "coefficient", 1e7}}});
  const Variant& worst = answer.variants.front();
  EXPECT_EQ(worst.label(), "viscous_asymmetry.coefficient x 1e+07");
  EXPECT_TRUE(std::isinf(worst.growth));
  EXPECT_TRUE(std::isnan(worst.find("motor_velocity", "free")->rmse));
  EXPECT_TRUE(std::isnan(worst.find("motor_velocity", "free")->response.amplitude_ratio));
  EXPECT_TRUE(std::isfinite(worst.find("motor_balance")->rmse));
  const nlohmann::json json = output::sensitivity_json(answer)["variants"][0];
  EXPECT_TRUE(json["growth"].is_null());
  EXPECT_TRUE(json["overall"][1]["rmse"].is_null());
}

TEST(Sensitivity, RefittingMakesGoodWhatItCan) {
  // A model that is wrong by a factor of two is refitted first, and a scaled parameter stays where it was put.
  constexpr double f = 2.0;
  const model::Model wrong = model_of({{"inertia", {2.0 * kInertia}}, {"viscous_friction", {2.0 * kViscous}}});
  const Options options{.pipeline = kPipeline, .refit = true, .more = {{"viscous_friction", "coefficient", 10.0}}};
  const Sensitivity answer = analyse(motor_data({f}), wrong, options);
  EXPECT_TRUE(answer.refit);
  EXPECT_LT(answer.full.find("motor_balance")->nrmse, 1e-3);
  // The inertia's torque is a quarter turn away from that of friction: it can make nothing good.
  const double speed = kTorque * std::abs(motor_response(f, kInertia, kViscous));
  EXPECT_NEAR(variant(answer, "viscous_friction.coefficient x 10").find("motor_balance")->rmse,
              9.0 * kViscous * speed / std::sqrt(2.0), 5e-3 * 9.0 * kViscous * speed);
}

TEST(Sensitivity, TheAnswerDoesNotDependOnTheNumberOfThreads) {
  const data::Dataset dataset = motor_data({1.0, 2.0});
  Options options{.pipeline = kPipeline, .threads = 1};
  const nlohmann::json one = output::sensitivity_json(analyse(dataset, motor_model(), options));
  for (const unsigned threads : {2u, 7u}) {
    options.threads = threads;
    std::size_t told = 0;
    options.progress = [&told](std::size_t done, std::size_t all) {
      EXPECT_EQ(done, ++told);
      EXPECT_EQ(all, 2u);
    };
    EXPECT_EQ(output::sensitivity_json(analyse(dataset, motor_model(), options)), one) << threads;
    EXPECT_EQ(told, 2u);
  }
}

TEST(SensitivityChange, AnEffectThatScaledWhatIsLeftOutGoesWithIt) {
  const model::Model model = model_of({{"inertia", {kInertia}},
                                       {"viscous_friction", {kViscous}},
                                       {"coulomb_friction", {0.05}},
                                       {"temperature_viscous", {0.01}}});
  const ChangedModel changed = apply(model, {"viscous_friction", "", 0.0});
  EXPECT_EQ(changed.also_left_out, std::vector<std::string>{"temperature_viscous"});
  ASSERT_EQ(changed.model.effects.size(), 2u);
  EXPECT_TRUE(apply(model, {"coulomb_friction", "", 0.0}).also_left_out.empty());
  const ChangedModel scaled = apply(model, {"viscous_friction", "coefficient", 3.0});
  EXPECT_DOUBLE_EQ(*scaled.model.find("viscous_friction")->find("coefficient")->value, 3.0 * kViscous);
  EXPECT_TRUE(scaled.model.find("viscous_friction")->find("coefficient")->fixed);
  EXPECT_EQ(*scaled.model.find("inertia")->find("inertia")->value, kInertia);
}

TEST(SensitivityChange, EachEffectIsLeftOutAndAStiffnessScaledBothWays) {
  const model::Model model = model_of({{"inertia", {kInertia}}, {"linear_stiffness", {6300.0}}});
  std::vector<std::string> labels;
  for (const Change& change : usual_changes(model)) labels.push_back(change.label());
  EXPECT_EQ(labels, (std::vector<std::string>{"without inertia", "without linear_stiffness",
                                              "linear_stiffness.stiffness x 0.1", "linear_stiffness.stiffness x 10"}));
}

std::string refusal(const model::Model& model, const Change& change) {
  try {
    apply(model, change);
  } catch (const model::ModelError& error) {
    return error.what();
  }
  return "";
}

TEST(SensitivityChange, WhatCannotBeDoneIsSaidWithWhatCould) {
  for (const char* text : {"", "a", "a=1", "a.=1", ".b=1", "a.b=", "a.b=two", "a.b=1x", "a.b=inf", "a.b=nan"})
    EXPECT_THROW(parse_scaling(text), std::invalid_argument) << text;
  const Change good = parse_scaling("torque_ripple_2.sine=-1.5");
  EXPECT_EQ(good.effect, "torque_ripple_2");
  EXPECT_EQ(good.parameter, "sine");
  EXPECT_EQ(good.factor, -1.5);

  const model::Model model = motor_model();
  EXPECT_NE(refusal(model, {"viscous", "coefficient", 2.0}).find("it has inertia, viscous_friction"),
            std::string::npos);
  EXPECT_NE(refusal(model, {"viscous_friction", "torque", 2.0}).find("it has coefficient"), std::string::npos);
  EXPECT_NE(refusal(model, {"inertia", "inertia", -1.0}).find("choose another factor"), std::string::npos);
  model::Model empty = model;
  empty.find("inertia")->find("inertia")->value.reset();
  EXPECT_NE(refusal(empty, {"inertia", "inertia", 2.0}).find("no value to scale"), std::string::npos);
  EXPECT_THROW(analyse(motor_data({2.0}), empty, {}), model::ModelError);
}

}  // namespace
}  // namespace flexspline::sensitivity::sensitivity_test
