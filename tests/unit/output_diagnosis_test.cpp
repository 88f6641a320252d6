// What a reader of a diagnosis is told of effects that the data neither show nor rule out.
#include "host/output/answers/diagnosis.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/engine/selection/add_until_complete.hpp"
#include "host/output/answers/diagnosis_sentences.hpp"

namespace flexspline::output::output_diagnosis_test {
namespace {

selection::Diagnosis with_possible_effects() {
  selection::Diagnosis d;
  d.unit = "N*m";
  d.possible.push_back({{{"dahl_friction", std::nullopt}}, "60 are needed", 0.512, 0.81});
  d.possible.push_back({{{"torque_ripple", 2.0}, {"load_scaled_ripple", 2.0}}, "too few", std::nullopt, std::nullopt});
  return d;
}

TEST(DiagnosisAnswer, SaysOfWhatTheDataCannotTellWhyAndWhatToRecord) {
  ::testing::internal::CaptureStdout();
  {
    Console console("diagnose", false);
    print_diagnosis(console, with_possible_effects(), "");
    std::fflush(stdout);
  }
  std::string text = ::testing::internal::GetCapturedStdout();
  for (std::size_t at = 0; (at = text.find("\n  ", at)) != std::string::npos;) text.replace(at, 3, " ");  // unwrapped
  EXPECT_NE(
      text.find(
          "These data do not decide whether dahl_friction is missing: chosen in 51 of 100 subsamples; 60 are needed. "
          "To decide, record: small slow motion that reverses often."),
      std::string::npos)
      << text;
  EXPECT_NE(
      text.find(
          "These data do not decide whether torque_ripple (2 per turn) or load_scaled_ripple (2 per turn) is missing; "
          "too few. To decide, record: "),
      std::string::npos)
      << text;
}

TEST(DiagnosisAnswer, SaysWhereTheNoiseIsKnownAndWhatTheErrorsLeaveOut) {
  selection::Diagnosis d;
  d.unit = "N*m";
  d.base_rmse = 0.002;
  d.base_rmse_cv = 0.003;
  d.balance = estimation::Balance::motor;
  d.noise_of_some = {{"sine"}, 0.001, 0.0005, "periods"};
  d.reversals_left_out = true;
  d.delay_advice = "The effort lags.";
  d.untried_advice = "Effects of the current were not tried.";
  ::testing::internal::CaptureStdout();
  {
    Console console("diagnose", false);
    print_diagnosis(console, d, "");
    std::fflush(stdout);
  }
  std::string text = ::testing::internal::GetCapturedStdout();
  for (std::size_t at = 0; (at = text.find("\n  ", at)) != std::string::npos;) text.replace(at, 3, " ");
  EXPECT_NE(text.find("error 0.002 N*m, 0.003 N*m in cross-validation, both without reversals and without the "
                      "delay of the effort; the noise is known in sine only: 0.0005 N*m (from periods), where the "
                      "error is 2 times that"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("Effects of the current were not tried."), std::string::npos) << text;
  EXPECT_EQ(diagnosis_json(d).at("untried_advice"), "Effects of the current were not tried.");
  EXPECT_EQ(diagnosis_json(d).at("base").at("noise_of_some").at("experiments"), nlohmann::json({"sine"}));
}

TEST(DiagnosisAnswer, DoesNotSayThatNothingIsMissingWhereSomethingIsPossible) {
  selection::Diagnosis d;
  d.verdict = selection::Verdict::at_noise_floor;
  EXPECT_EQ(verdict_in_words(d), "Nothing is missing: the model's error is the noise of the measurement.");
  d.possible = with_possible_effects().possible;
  EXPECT_EQ(verdict_in_words(d).find("Nothing is missing"), std::string::npos);
}

TEST(DiagnosisAnswer, DoesNotSayThatTheNoiseIsUnknownWhereItIsKnown) {
  selection::Diagnosis d;
  d.verdict = selection::Verdict::nothing_significant;
  d.base_rmse = 0.024;
  d.target_rms = 0.1;
  EXPECT_NE(verdict_in_words(d).find("It leaves 24 % of the motor balance's measured side; how much of that is noise "
                                     "is not known."),
            std::string::npos);
  d.noise_floor = 1e-3;
  EXPECT_NE(verdict_in_words(d).find("Its error is 24 times the noise"), std::string::npos);
  EXPECT_EQ(verdict_in_words(d).find("not known"), std::string::npos);
  d.possible = with_possible_effects().possible;
  EXPECT_EQ(verdict_in_words(d).find("not known"), std::string::npos);
}

// Of each round only the first name is added to the model.
TEST(DiagnosisAnswer, OfSeveralRoundsNamesWhatWasAddedAndIsKept) {
  selection::Diagnosis first, last;
  first.verdict = selection::Verdict::missing_effect;
  first.named = {{"gravity", std::nullopt}, {"torque_ripple", 2.0}};
  const nlohmann::json named = rounds_json({first, last}, {{"gravity", std::nullopt}}).at("named");
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0].at("effect"), "gravity");
}

TEST(DiagnosisAnswer, DoesNotNameTheOnlyEffectWhereItWasRemovedAgain) {
  selection::Diagnosis first, last;
  first.verdict = selection::Verdict::missing_effect;
  first.named = {{"gravity", std::nullopt}};
  last.verdict = selection::Verdict::at_noise_floor;
  const nlohmann::json answer = rounds_json({first, last}, {});
  EXPECT_TRUE(answer.at("named").empty()) << answer.at("named");
  EXPECT_EQ(answer.at("verdict"), "at_noise_floor");
  EXPECT_EQ(rounds_json({first}, {}).at("named").size(), 1u);
}

TEST(DiagnosisAnswer, NamesAnEffectOnceThatWasRemovedAndAddedAgain) {
  const selection::NamedEffect gravity{"gravity", std::nullopt}, ripple{"torque_ripple", 2.0};
  selection::StepwiseSelection done;
  done.rounds.resize(4);
  done.note_added(gravity);
  done.note_added(ripple);
  EXPECT_FALSE(done.note_removed("gravity"));
  EXPECT_EQ(done.removed, std::vector<std::string>{"gravity"});
  done.note_added(gravity);
  EXPECT_TRUE(done.removed.empty()) << "it is in the model";
  const nlohmann::json named = rounds_json(done.rounds, done.kept).at("named");
  ASSERT_EQ(named.size(), 2u);
  EXPECT_EQ(named[0].at("effect"), "torque_ripple");
  EXPECT_EQ(named[1].at("effect"), "gravity");
  EXPECT_TRUE(done.note_removed("gravity")) << "a second time, which ends the search";
  EXPECT_EQ(done.removed, std::vector<std::string>{"gravity"});
  EXPECT_EQ(rounds_json(done.rounds, done.kept).at("named").size(), 1u);
}

TEST(DiagnosisAnswer, HasPossibleEffectsInItsJson) {
  const nlohmann::json possible = diagnosis_json(with_possible_effects()).at("possible");
  ASSERT_EQ(possible.size(), 2u);
  EXPECT_EQ(possible[0].at("effects"), nlohmann::json::parse(R"([{"effect": "dahl_friction", "order": null}])"));
  EXPECT_EQ(possible[0].at("frequency"), 0.512);
  EXPECT_EQ(possible[0].at("held_out_ratio"), 0.81);
  EXPECT_EQ(possible[0].at("why_not"), "60 are needed");
  EXPECT_EQ(possible[1].at("effects").size(), 2u);
  EXPECT_TRUE(possible[1].at("frequency").is_null());
}

}  // namespace
}  // namespace flexspline::output::output_diagnosis_test
