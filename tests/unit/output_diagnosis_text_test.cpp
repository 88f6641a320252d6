// How much of a diagnosis the terminal shows: sizes, times and lists that a reader can use.
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/output/answers/diagnosis.hpp"
#include "host/output/answers/explanation.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::output::output_diagnosis_text_test {
namespace {

using selection::Candidate;
using selection::Diagnosis;

// In one line a paragraph.
std::string text_of(const Diagnosis& d, const data::Dataset* dataset = nullptr, const model::Drive* drive = nullptr) {
  ::testing::internal::CaptureStdout();
  {
    Console console("diagnose", false);
    print_diagnosis(console, d, "", drive, dataset);
    std::fflush(stdout);
  }
  return ::testing::internal::GetCapturedStdout();
}
std::string unwrapped(std::string text) {
  for (std::size_t at = 0; (at = text.find("\n  ", at)) != std::string::npos;) text.replace(at, 3, " ");
  return text;
}
bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

Diagnosis with_ripple(double rms, double percent_of_rated) {
  Diagnosis d;
  d.unit = "N*m";
  d.verdict = selection::Verdict::missing_effect;
  d.named = {{"torque_ripple", 2.0}};
  Candidate ripple;
  ripple.effect = "torque_ripple";
  ripple.order = 2.0;
  ripple.size = {rms, 2.0 * rms, percent_of_rated};
  d.candidates.push_back(ripple);
  return d;
}

data::Dataset record_from(double first_s) {
  data::Dataset dataset;
  dataset.experiments.push_back(tests::written_experiment("run", 1e-3, 20000, [](double, data::Experiment&) {}));
  for (double& t : dataset.experiments.front().time_s) t += first_s;
  return dataset;
}

// One each second, the later the larger, but for the first one.
Diagnosis with_disturbances(int count, double first_s = 0.0) {
  Diagnosis d;
  d.unit = "N*m";
  for (int k = 0; k < count; ++k)
    d.disturbances.push_back({"run", first_s + k, first_s + k + 0.25, k == 0 ? 1.0 : 0.01 * k, "N*m"});
  return d;
}

TEST(DiagnosisText, SaysBelowTheVerdictHowLargeTheNamedEffectIsAndWhetherThatIsSmall) {
  EXPECT_TRUE(contains(unwrapped(text_of(with_ripple(0.00077, 0.16))),
                       "The model lacks torque_ripple (2 per turn). torque_ripple (2 per turn): 0.00077 N*m (RMS), "
                       "0.16 % of the rated torque (0.481 N*m at the motor), small. error"));
  EXPECT_TRUE(contains(unwrapped(text_of(with_ripple(0.077, 16.0))),
                       "(RMS), 16 % of the rated torque (0.481 N*m at the motor). error"));
}

TEST(DiagnosisText, ShowsTheEightLargestDisturbancesInTheOrderOfTimeAndHowManyMoreThereAre) {
  const std::string text = text_of(with_disturbances(81));
  EXPECT_TRUE(contains(text, "and 73 more; --json lists all")) << text;
  EXPECT_FALSE(contains(text, "73.000 s"));
  std::size_t at = text.find("disturbance in");
  for (const char* from : {" 0.000 s", "74.000 s", "75.000 s", "80.000 s"}) {
    at = text.find(from, at);
    EXPECT_NE(at, std::string::npos) << from << "\n" << text;
  }
  EXPECT_EQ(diagnosis_json(with_disturbances(81)).at("disturbances").size(), 81u);
  EXPECT_FALSE(contains(text_of(with_disturbances(8)), "more;"));
}

TEST(DiagnosisText, HasTheTimesOfDisturbancesAfterTheFirstSampleWhereTheColumnIsADate) {
  constexpr double kDate_s = 1694512345.125;
  const data::Dataset late = record_from(kDate_s), early = record_from(2.0);
  const std::string dated = text_of(with_disturbances(3, kDate_s), &late);
  EXPECT_TRUE(contains(dated, "1.250 s")) << dated;
  EXPECT_TRUE(contains(dated, "after the first sample")) << dated;
  EXPECT_FALSE(contains(dated, "1694512"));
  const std::string plain = text_of(with_disturbances(3, 2.0), &early);
  EXPECT_TRUE(contains(plain, "3.250 s")) << plain;
  EXPECT_FALSE(contains(plain, "after the first sample"));
}

TEST(DiagnosisText, SaysHowCertainANameIsByTheMethodThatDecided) {
  Diagnosis d = with_ripple(0.1, 10.0);
  d.candidates.front().score = 347.2;
  EXPECT_TRUE(contains(unwrapped(text_of(d)),
                       "Score 347.2 for torque_ripple (2 per turn); a name needs 19.5, which 1 of 1000 simulated "
                       "drives with nothing missing exceeds."));
  d.resampling.emplace();
  d.resampling->decides = true;
  d.resampling->subsamples = 84.0;
  d.resampling->lowest_hz = 5.0;
  d.resampling->highest_hz = 20.0;
  const std::string resampled = unwrapped(text_of(d));
  EXPECT_FALSE(contains(resampled, "Score 347")) << resampled;
  EXPECT_TRUE(contains(resampled, "84 halves of the data, low-pass filters from 5 to 20 Hz")) << resampled;
  EXPECT_TRUE(contains(resampled, "nothing is chosen often enough")) << resampled;
}

TEST(DiagnosisText, SaysOnceOfEachParameterWithWhatItDiffersAndNotThatItIsMissingWhereSomethingIsNamed) {
  Diagnosis d = with_ripple(0.1, 10.0);
  for (const char* over : {"speed", "time"}) {
    selection::Trend trend;
    trend.id = "coulomb_friction";
    trend.parameter = "torque";
    trend.over = over;
    d.parameter_trends.push_back(trend);
  }
  EXPECT_TRUE(contains(unwrapped(text_of(d)),
                       "Without what is named, coulomb_friction.torque differs between experiments with speed and "
                       "time; see whether it still does with it."));
  d.named.clear();
  EXPECT_TRUE(contains(unwrapped(text_of(d)),
                       "coulomb_friction.torque differs between experiments with speed and time: the model lacks "
                       "something that depends on one of these."));
}

TEST(DiagnosisText, HasSharesOfTheErrorFromZeroToAHundredPerCentAndTheJsonAsTheyWereFound) {
  Diagnosis d = with_ripple(0.1, 10.0);
  d.resampling.emplace();
  d.resampling->decides = true;
  selection::Resampling::FoundTerm found;
  found.group = d.named;
  found.frequency = 1.0;
  found.share_percent = 104.0;
  found.share_low_percent = -3.0;
  found.share_high_percent = 171.0;
  d.resampling->found = {found};
  EXPECT_TRUE(contains(unwrapped(text_of(d)), "(100 % of the squared error above the noise, 0 to 100 %)"));
  EXPECT_EQ(diagnosis_json(d).at("resampling").at("found")[0].at("share_high_percent"), 171.0);
}

TEST(DiagnosisText, HasADelayOfASampleOrMoreDirectlyBelowTheVerdict) {
  Diagnosis d = with_ripple(0.1, 10.0);
  d.delay_s = 0.0136;
  d.delay_advice = "The effort lags the motion by 13.6 ms.";
  const data::Dataset dataset = record_from(0.0);
  EXPECT_TRUE(contains(unwrapped(text_of(d, &dataset)), "(2 per turn). The effort lags the motion by 13.6 ms. torque"));
  d.delay_s = 0.0005;
  EXPECT_FALSE(contains(unwrapped(text_of(d, &dataset)), "(2 per turn). The effort lags"));
  EXPECT_TRUE(contains(text_of(d, &dataset), "The effort lags"));
}

TEST(DiagnosisText, CallsAnEffectNotVisibleThatWouldHaveToBeLargerThanTheDriveCanBear) {
  model::Drive drive;
  drive.rated_torque_nm.value = 10.0;
  drive.gear_ratio.value = 50.0;
  drive.rated_velocity_rad_s.value = 200.0;
  const auto said = [&](const char* effect, const char* parameter, double value, const char* unit) {
    Candidate c;
    c.effect = effect;
    c.balance = estimation::Balance::motor;
    c.minimum_detectable.emplace();
    c.minimum_detectable->size.parameter = parameter;
    c.minimum_detectable->size.value = value;
    c.minimum_detectable->size.unit = unit;
    EXPECT_EQ(detectable_json(c).at("value"), value);
    return detectable_in_words(c, &drive);
  };
  constexpr const char* kNotVisible = "not visible in these data";
  EXPECT_EQ(said("torque_ripple", "amplitude", 2200.0, "N*m"), kNotVisible);
  EXPECT_EQ(said("torque_ripple", "amplitude", 0.022, "N*m"), "amplitude 0.022 N*m");
  EXPECT_EQ(said("torque_ripple", "amplitude", 0.22, "N*m"), kNotVisible) << "rated is 0.2 N*m at the motor";
  EXPECT_EQ(said("gravity", "amplitude", 0.22, "N*m"), "amplitude 0.22 N*m") << "of the output";
  EXPECT_EQ(said("viscous_friction", "coefficient", 0.0011, "N*m*s/rad"), kNotVisible);
  EXPECT_EQ(said("output_inertia", "inertia", 690.0, "kg*m^2"), kNotVisible);
  EXPECT_EQ(said("output_inertia", "inertia", 0.069, "kg*m^2"), "inertia 0.069 kg*m^2");
}

TEST(DiagnosisText, AsksForSlowerReversalsOrFinerSamplesWherePreslidingIsTooShort) {
  Diagnosis d;
  d.unit = "N*m";
  Candidate law;
  law.effect = "dahl_friction";
  estimation::Estimate& travel = law.parameters.emplace_back();
  travel.ref.parameter = catalogue::get(law.effect).index_of("presliding");
  travel.value = 0.01;
  travel.std = 0.01;
  d.candidates.push_back(law);
  d.possible.push_back({{{"dahl_friction", std::nullopt}}, "its travel is too short", std::nullopt, std::nullopt});
  EXPECT_TRUE(
      contains(unwrapped(text_of(d)),
               "To decide, record: slower reversals, or the same at a higher sample rate or with a finer encoder."));
}

}  // namespace
}  // namespace flexspline::output::output_diagnosis_text_test
