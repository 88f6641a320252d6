// Section 5.4 of the report: which effects matter, on recordings of the twin and a model that knows its true values.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "hil/plant/recorder.hpp"
#include "host/engine/sensitivity/sensitivity.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::sensitivity_test {
namespace {

using sensitivity::Sensitivity;
using sensitivity::SignalError;

plant::ExperimentPlan plan(const char* name, plant::Mode mode, plant::Waveform waveform, double amplitude,
                           double frequency_hz, bool locked) {
  plant::ExperimentPlan p;
  p.name = name;
  p.mode = mode;
  p.waveform = waveform;
  p.amplitude = amplitude;
  p.frequency_hz = frequency_hz;
  p.locked = locked;
  p.temperature_c = 30.0;
  return p;
}

// The twin with Stribeck friction, in the motions of the report's figures: free sines (55 to 60), one slow motion
// (section 4.3), and a locked sine (47, 48).
struct Study {
  Sensitivity answer;

  Study() {
    plant::Drive drive = plant::demo_plant().drive;
    plant::with(drive, "stribeck_gaussian");
    using plant::Mode;
    using plant::Waveform;
    const std::vector<plant::ExperimentPlan> plans{
        plan("free 1.2 Hz", Mode::velocity, Waveform::sine, 100.0, 1.2, false),
        plan("free 2 Hz", Mode::velocity, Waveform::sine, 100.0, 2.0, false),
        plan("slow", Mode::velocity, Waveform::triangle, 12.0, 0.2, false),
        plan("locked 1 Hz", Mode::current, Waveform::sine, 2.8, 1.0, true)};
    constexpr std::uint64_t kSeed = 7054;
    const data::Dataset dataset = tests::dataset_of(drive, plant::record_all(drive, plans, kSeed));
    answer = sensitivity::analyse(dataset, tests::model_of(drive, false, true), {});
  }

  const sensitivity::Variant& variant(std::string_view label) const {
    for (const auto& v : answer.variants)
      if (v.label() == label) return v;
    throw std::logic_error("no variant " + std::string(label));
  }
  const SignalError& overall(std::string_view label, const char* signal, const char* load) const {
    return *variant(label).find(signal, load);
  }
  const SignalError& in(const sensitivity::Variant& v, std::string_view experiment, std::string_view signal) const {
    for (const auto& e : v.experiments)
      for (const SignalError& s : e.signals)
        if (e.name == experiment && s.signal == signal) return s;
    throw std::logic_error("no such signal");
  }
};

const Study& study() {
  static const Study one;
  return one;
}

TEST(Section54, TheCompleteModelReplicatesAmplitudeAndPhase) {
  for (const SignalError& s : study().answer.full.overall) {
    if (s.is_balance() || s.drifts()) continue;
    EXPECT_NEAR(s.response.amplitude_ratio, 1.0, 0.01) << s.signal << s.load;
    EXPECT_NEAR(s.response.phase_deg, 0.0, 1.0) << s.signal << s.load;
  }
  // Gains and zero of the torque sensor and the like are not in the model's way.
  EXPECT_LT(study().answer.full.find("motor_velocity", "free")->nrmse, 0.03);
}

TEST(Section54, WithoutCoulombOrViscousFrictionTheModelIsNotCapableOfTheFreeMotion) {
  const double full = study().answer.full.find("motor_velocity", "free")->rmse;
  for (const char* label : {"without coulomb_friction", "without viscous_friction"}) {
    const SignalError& velocity = study().overall(label, "motor_velocity", "free");
    EXPECT_GT(velocity.rmse, 20.0 * full) << label;
    EXPECT_GT(velocity.response.amplitude_ratio, 1.15) << label;  // less friction, more motion, and later
    EXPECT_LT(velocity.response.phase_deg, -5.0) << label;
  }
}

TEST(Section54, StribeckFrictionContributesOnlyInVerySlowMotion) {
  const auto& without = study().variant("without stribeck_gaussian");
  const double slow = study().in(without, "slow", "motor_velocity").growth;
  const double typical = study().in(without, "free 2 Hz", "motor_velocity").growth;
  EXPECT_GT(slow, 0.1);
  EXPECT_LT(typical, 0.02);
  EXPECT_EQ(study().overall("without stribeck_gaussian", "motor_velocity", "free").worst_experiment, "slow");
  EXPECT_LT(without.growth, study().variant("without coulomb_friction").growth);
}

TEST(Section54, ATenthOfTheStiffnessMakesTheLockedVelocityLarger) {
  const auto& soft = study().variant("linear_stiffness.stiffness x 0.1");
  EXPECT_GT(soft.find("motor_velocity", "locked")->response.amplitude_ratio, 2.0);
}

TEST(Section54, TenTimesTheStiffnessChangesTheTwistAndNotTheFriction) {
  const auto& stiff = study().variant("linear_stiffness.stiffness x 10");
  const SignalError& locked = *stiff.find("motor_velocity", "locked");
  EXPECT_LT(locked.response.amplitude_ratio, 0.2);
  EXPECT_GT(std::abs(locked.response.phase_deg), 5.0);
  // What turns freely hardly twists, and the motor's balance does not hold the stiffness at all.
  EXPECT_NEAR(stiff.find("motor_velocity", "free")->response.amplitude_ratio, 1.0, 0.01);
  EXPECT_NEAR(stiff.find("motor_velocity", "free")->response.phase_deg, 0.0, 1.0);
  EXPECT_EQ(stiff.find("motor_balance")->growth, 0.0);
  EXPECT_EQ(stiff.find("load_balance")->growth, 0.0);
}

TEST(Section54, WithoutStructuralDampingThePhaseOfTheLockedVelocityIsWrong) {
  const SignalError& velocity = study().overall("without structural_damping", "motor_velocity", "locked");
  EXPECT_GT(std::abs(velocity.response.phase_deg), 10.0);
  EXPECT_LT(std::abs(study().overall("without structural_damping", "motor_velocity", "free").response.phase_deg), 1.0);
}

}  // namespace
}  // namespace flexspline::sensitivity_test
