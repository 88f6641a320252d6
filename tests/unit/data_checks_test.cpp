// host/input/data: every check on a measurement that has what it looks for, and on one that has not.
#include "host/input/data/checks.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "host/input/data/findings.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_checks_test {
namespace {

constexpr double kPi = std::numbers::pi;

Dataset loaded(const std::string& csv, const LoadOptions& options = {}) {
  const TestFolder folder;
  return load({folder.write("run.csv", csv)}, options);
}

std::vector<Finding> errors_in(const std::string& csv) {
  const TestFolder folder;
  return errors_of({folder.write("run.csv", csv)});
}

std::size_t masked(const Experiment& e) {
  return static_cast<std::size_t>(std::count(e.masked.begin(), e.masked.end(), 1));
}

TEST(Checks, FindNothingInAGoodMeasurement) {
  const Dataset data = loaded(good_csv(4000));
  for (const Finding& finding : data.findings) ADD_FAILURE() << finding.text();
  EXPECT_EQ(masked(data.experiments[0]), 0u);
  EXPECT_EQ(data.experiments[0].segments.size(), 1u);
}

TEST(Checks, FindNothingInANoisyMeasurementWithACoarseEncoder) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const double count = 2.0 * kPi / 2048.0;
  const Dataset data =
      loaded(csv_of(even_times(5000),
                    {{"current_a", [&](double t) { return current(t) + 0.02 * normal(random); }},
                     {"motor_position_rad", [&](double t) { return count * std::floor(position(t) / count); }},
                     {"motor_velocity_rad_s", [&](double t) { return velocity(t - 0.003) + 0.3 * normal(random); }}}));
  for (const Finding& finding : data.findings) ADD_FAILURE() << finding.text();
}

struct Mismatch {
  double velocity_factor;
  double position_factor;
  std::string word;  // in the message; empty: no cause can be named
};

TEST(Checks, NameTheUnitOfAVelocityThatIsNotThePositionsDerivative) {
  for (const Mismatch& m :
       {Mismatch{30.0 / kPi, 1.0, "rpm"}, Mismatch{180.0 / kPi, 1.0, "deg/s"},
        Mismatch{1.0, 180.0 / kPi, "position is in degrees"}, Mismatch{1.0, 0.01, "gear ratio 100"},
        Mismatch{-1.0, 1.0, "sign"}, Mismatch{0.5 / kPi, 1.0, "velocity is in turns"}, Mismatch{1.08, 1.0, ""},
        Mismatch{30.0 / kPi, 0.5 / kPi, "rpm and the position in turns"},
        Mismatch{30.0 / kPi, 180.0 / kPi, "rpm and the position in degrees"},
        Mismatch{1.0, 0.5 / kPi, "position is in turns"}, Mismatch{6.0, 1.0, "another one"}, Mismatch{0.93, 1.0, ""}}) {
    const std::vector<Finding> errors =
        errors_in("# gear_ratio: 100\n" +
                  csv_of(even_times(3000),
                         {{"motor_position_rad", [&](double t) { return m.position_factor * position(t); }},
                          {"motor_velocity_rad_s", [&](double t) { return m.velocity_factor * velocity(t); }}}));
    ASSERT_EQ(errors.size(), 1u) << m.word;
    EXPECT_EQ(errors[0].kind, "velocity_position_mismatch");
    EXPECT_EQ(errors[0].column, "motor_velocity_rad_s");
    if (m.word.empty()) {
      EXPECT_EQ(errors[0].what.find(": "), std::string::npos) << errors[0].what;
    } else {
      EXPECT_NE(errors[0].what.find(m.word), std::string::npos) << errors[0].what;
    }
  }
}

TEST(Checks, AcceptAVelocityWithinFivePercentAndAnyThatIsTolerated) {
  const auto csv = [](double factor) {
    return csv_of(even_times(3000), {{"output_position_rad", position},
                                     {"output_velocity_rad_s", [=](double t) { return factor * velocity(t); }}});
  };
  EXPECT_TRUE(of_kind(loaded(csv(1.04)).findings, "velocity_position_mismatch").empty());
  EXPECT_TRUE(of_kind(loaded(csv(0.96)).findings, "velocity_position_mismatch").empty());
  const std::vector<Finding> found =
      of_kind(loaded(csv(2.0), tolerating("velocity_position_mismatch")).findings, "velocity_position_mismatch");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::warning);
}

TEST(Checks, DoNotJudgeAVelocityWhereNothingMoves) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const Dataset data =
      loaded(csv_of(even_times(3000), {{"motor_position_rad", [&](double) { return 1e-4 * normal(random); }},
                                       {"motor_velocity_rad_s", [&](double) { return 0.3 * normal(random); }}}));
  EXPECT_TRUE(of_kind(data.findings, "velocity_position_mismatch").empty());
}

TEST(Checks, AConstantSpeedIsJudgedToo) {
  EXPECT_TRUE(
      loaded(csv_of(even_times(3000), {{"motor_position_rad", [](double t) { return 30.0 * t; }},
                                       {"motor_velocity_rad_s", [](double t) { return 30.0 + std::sin(40 * t); }}}))
          .findings.empty());
  EXPECT_EQ(errors_in(csv_of(even_times(3000), {{"motor_position_rad", [](double t) { return 30.0 * t; }},
                                                {"motor_velocity_rad_s", [](double) { return 286.5; }}}))
                .size(),
            1u);
}

TEST(Checks, MaskAClippedCurrent) {
  const auto clipped = [](double t) { return std::clamp(2.0 * std::sin(5.0 * t), -1.5, 1.5); };
  const Dataset data = loaded(csv_of(even_times(5000), {{"current_a", clipped}, {"motor_position_rad", position}}));
  const std::vector<Finding> found = of_kind(data.findings, "clipping");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::warning);
  EXPECT_EQ(found[0].column, "current_a");
  const Experiment& e = data.experiments[0];
  for (std::size_t k = 0; k < e.size(); ++k) ASSERT_EQ(e.masked[k] != 0, std::abs(e[Column::current][k]) == 1.5) << k;
}

TEST(Checks, DoNotTakeAStatedHeldCommandForClipping) {
  const auto clipped = [](double t) { return std::clamp(2.0 * std::sin(5.0 * t), -1.5, 1.5); };
  const std::string csv = csv_of(even_times(5000), {{"current_a", clipped}, {"motor_position_rad", position}});
  EXPECT_TRUE(of_kind(loaded("# current_hold: zoh\n" + csv).findings, "clipping").empty());
  EXPECT_EQ(of_kind(loaded("# current_hold: none\n" + csv).findings, "clipping").size(), 1u);
}

TEST(Checks, DoNotTakeLevelsForClipping) {
  const auto square = [](double t) { return std::sin(5.0 * t) > 0.0 ? 1.5 : -1.5; };
  const auto coarse = [](double t) { return 0.1 * std::round(10.0 * current(t)); };
  const auto pulses = [](double t) { return std::fmod(t, 1.0) < 0.1 ? 2.0 : 0.0; };
  for (const Signal& signal : {Signal(square), Signal(coarse), Signal(pulses)})
    EXPECT_TRUE(
        of_kind(loaded(csv_of(even_times(5000), {{"current_a", signal}, {"motor_position_rad", position}})).findings,
                "clipping")
            .empty());
}

// Moves for two seconds, rests for two, moves on.
double with_rest(double t) {
  return position(t < 2.0 ? t : t < 4.0 ? 2.0 : t - 2.0);
}

TEST(Checks, MaskLongStandstillBetweenMotions) {
  const Dataset data = loaded(csv_of(even_times(8000), {{"current_a", current}, {"motor_position_rad", with_rest}}));
  const std::vector<Finding> found = of_kind(data.findings, "standstill");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::warning);
  EXPECT_NE(found[0].what.find("25 %"), std::string::npos) << found[0].what;
  const Experiment& e = data.experiments[0];
  EXPECT_NEAR(static_cast<double>(masked(e)), 2000.0, 200.0);
  for (std::size_t k = 0; k < e.size(); ++k)
    ASSERT_TRUE(e.masked[k] == 0 || (e.time_s[k] > 1.89 && e.time_s[k] < 4.11)) << e.time_s[k];
}

TEST(Checks, DoNotMaskStandstillUnderALockedLoad) {
  const Dataset data = loaded("# load: locked\n" + csv_of(even_times(8000), {{"motor_position_rad", with_rest}}));
  ASSERT_EQ(of_kind(data.findings, "standstill").size(), 1u);
  EXPECT_EQ(of_kind(data.findings, "standstill")[0].severity, Severity::note);
  EXPECT_EQ(masked(data.experiments[0]), 0u);
}

TEST(Checks, DoNotMaskARecordThatIsAtRestAsAWhole) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const Signal& rest : {Signal([](double) { return 0.25; }), Signal([&](double) { return 1e-3 * normal(random); }),
                             Signal([&](double) { return normal(random) > 2.5 ? 0.003 : 0.0; })}) {
    const Dataset data = loaded(csv_of(even_times(5000), {{"current_a", current}, {"motor_position_rad", rest}}));
    ASSERT_EQ(of_kind(data.findings, "standstill").size(), 1u);
    EXPECT_EQ(of_kind(data.findings, "standstill")[0].severity, Severity::note);
    EXPECT_EQ(masked(data.experiments[0]), 0u);
  }
}

TEST(Checks, DoNotTakeACreepingMotionForStandstill) {
  const double count = 2.0 * kPi / 1024.0;
  const auto creep = [&](double t) {
    return count * std::floor((t < 3.0 ? 0.05 * t : 0.15 + position(t - 3.0)) / count);
  };
  const Dataset data = loaded(csv_of(even_times(6000), {{"current_a", current}, {"motor_position_rad", creep}}));
  EXPECT_TRUE(of_kind(data.findings, "standstill").empty());
}

TEST(Checks, SayThatAColumnIsConstant) {
  const Dataset data = loaded(csv_of(even_times(2000), {{"current_a", [](double) { return 0.0; }},
                                                        {"motor_position_rad", position},
                                                        {"load_torque_nm", [](double) { return 5.0; }}}));
  const std::vector<Finding> found = of_kind(data.findings, "constant_column");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].column, "current_a");
  EXPECT_EQ(found[0].severity, Severity::warning);
  EXPECT_EQ(found[1].column, "load_torque_nm");
  EXPECT_EQ(found[1].severity, Severity::note);
}

struct Implausible {
  std::string column;
  double size;
  std::string axis;
  std::string likely;
};

TEST(Checks, SayWhichUnitIsLikelyWhereTheRangeCannotBeRight) {
  for (const Implausible& i :
       {Implausible{"current_a", 1500.0, "rotary", "mA"}, Implausible{"motor_velocity_rad_s", 4000.0, "rotary", "rpm"},
        Implausible{"output_velocity_rad_s", 90.0, "rotary", "deg/s"},
        Implausible{"motor_torque_nm", 400.0, "rotary", "mN*m"}, Implausible{"torque_nm", 3e4, "rotary", "mN*m"},
        Implausible{"temperature_c", 310.0, "rotary", "K"}, Implausible{"motor_position_rad", 250.0, "linear", "mm"},
        Implausible{"motor_velocity_rad_s", 100.0, "linear", "mm/s"}}) {
    const Dataset data = loaded(
        "# axis: " + i.axis + "\n" +
        csv_of(even_times(2000), {{i.column, [&](double t) { return i.size * (1.0 + 0.1 * std::sin(9.0 * t)); }}}));
    const std::vector<Finding> found = of_kind(data.findings, "unit");
    ASSERT_EQ(found.size(), 1u) << i.column;
    EXPECT_EQ(found[0].severity, Severity::warning);
    EXPECT_EQ(found[0].column, i.column);
    EXPECT_NE(found[0].what.find("likely " + i.likely), std::string::npos) << found[0].what;
    EXPECT_NE(found[0].remedy.find("unit = \"" + i.likely + "\""), std::string::npos);
  }
}

TEST(Checks, RecogniseEncoderCountsAndMilliseconds) {
  const Dataset counts = loaded(
      csv_of(even_times(2000), {{"motor_position_rad", [](double t) { return std::round(4000.0 * position(t)); }}}));
  ASSERT_EQ(of_kind(counts.findings, "unit").size(), 1u);
  EXPECT_NE(of_kind(counts.findings, "unit")[0].what.find("counts"), std::string::npos);
  const Dataset slow = loaded(csv_of(even_times(2000, 1.0), {{"current_a", current}}));
  ASSERT_EQ(of_kind(slow.findings, "unit").size(), 1u);
  EXPECT_NE(of_kind(slow.findings, "unit")[0].what.find("ms"), std::string::npos);
}

TEST(Checks, CompareOutputAndMotorByTheGearRatio) {
  const auto csv = [](double factor) {
    return "# gear_ratio: 100\n" +
           csv_of(even_times(3000), {{"motor_position_rad", [](double t) { return 50.0 * position(t); }},
                                     {"output_position_rad", [=](double t) { return factor * 0.5 * position(t); }}});
  };
  EXPECT_TRUE(of_kind(loaded(csv(0.95)).findings, "gear_ratio").empty());
  for (const auto& [factor, word] :
       {std::pair<double, std::string>{-1.0, "sign"}, {57.2958, "degrees"}, {100.0, "same side"}}) {
    const std::vector<Finding> found = of_kind(loaded(csv(factor)).findings, "gear_ratio");
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NE(found[0].what.find(word), std::string::npos) << found[0].what;
  }
}

TEST(Checks, AWrappedPositionIsAnErrorAndToleratedItsTurnsAreAdded) {
  const auto straight = [](double t) { return 9.0 * std::sin(3.0 * t); };
  const auto wrapped = [&](double t) { return std::remainder(straight(t), 2.0 * kPi); };
  const std::string csv = csv_of(even_times(3000), {{"motor_position_rad", wrapped}, {"current_a", current}});
  const std::vector<Finding> errors = errors_in(csv);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "wrapped_position");
  const Dataset data = loaded(csv, tolerating("wrapped_position"));
  const Experiment& e = data.experiments[0];
  for (std::size_t k = 0; k < e.size(); ++k)
    ASSERT_NEAR(e[Column::motor_position][k], straight(e.time_s[k]), 1e-6) << k;
}

// At 200 Hz it moves 0.75 rad a sample, in the last case 2.5.
TEST(Checks, AWrappedPositionIsFoundAtAnySpeedBelowHalfATurnASample) {
  const std::vector<std::function<double(double)>> motions = {
      [](double t) { return 150.0 * t; }, [](double t) { return 300.0 * std::sin(0.5 * t); },
      [](double t) { return -2.0 * 40.0 * t * t; }, [](double t) { return 500.0 * t + std::sin(20.0 * t); }};
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const auto wrapped = [&](double t) { return std::remainder(motions[m](t), 2.0 * kPi); };
    const std::vector<double> times = even_times(m == 2 ? 600 : 3000, 0.005);
    const std::string csv = csv_of(times, {{"motor_position_rad", wrapped}, {"current_a", current}});
    const std::vector<Finding> errors = errors_in(csv);
    ASSERT_EQ(errors.size(), 1u) << m;
    EXPECT_EQ(errors[0].kind, "wrapped_position");
    EXPECT_EQ(errors[0].what.find("cannot be known") != std::string::npos, m >= 2) << errors[0].what;
    const Dataset data = loaded(csv, tolerating("wrapped_position"));
    const Experiment& e = data.experiments[0];
    for (std::size_t k = 0; k < e.size(); ++k)
      ASSERT_NEAR(e[Column::motor_position][k] - e[Column::motor_position][0],
                  motions[m](e.time_s[k]) - motions[m](e.time_s[0]), 1e-5)
          << m << " " << k;
  }
}

TEST(Checks, AMissingColumnIsNamedWithWhatToMap) {
  const Dataset data = loaded(csv_of(even_times(100), {{"current_a", current}, {"speed", velocity}}));
  const std::vector<std::vector<Column>> needs = {{Column::current, Column::motor_torque},
                                                  {Column::motor_position, Column::motor_velocity}};
  try {
    require(data, needs, "identify");
    FAIL() << "nothing was thrown";
  } catch (const DataError& error) {
    ASSERT_EQ(error.findings().size(), 1u);
    const Finding& finding = error.findings()[0];
    EXPECT_EQ(finding.kind, "missing_column");
    EXPECT_NE(finding.what.find("motor_position_rad or motor_velocity_rad_s"), std::string::npos);
    EXPECT_NE(finding.remedy.find("speed"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("identify needs"), std::string::npos);
  }
  EXPECT_NO_THROW(require(data, std::vector<std::vector<Column>>{{Column::current}}, "check"));
}

TEST(Tolerate, UnknownKindsAndThoseThatCannotBeToleratedAreErrors) {
  const TestFolder folder;
  const std::filesystem::path file = folder.write("run.csv", good_csv(100));
  std::vector<Finding> errors = errors_of({file}, tolerating("jiter"));
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "tolerate");
  EXPECT_NE(errors[0].what.find("\"jitter\""), std::string::npos);
  EXPECT_NE(errors[0].remedy.find("not_finite"), std::string::npos);
  errors = errors_of({file}, tolerating("text_in_number"));
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].what.find("cannot be tolerated"), std::string::npos);
  EXPECT_NO_THROW(load({file}, tolerating("gap")));
}

TEST(Tolerate, EveryKindIsInTheDocument) {
  std::ifstream document(std::filesystem::path(FLEXSPLINE_SOURCE_DIR) / "host/input/data/FINDINGS.md");
  const std::string text((std::istreambuf_iterator<char>(document)), std::istreambuf_iterator<char>());
  for (const KindInfo& kind : known_kinds())
    EXPECT_NE(text.find("- `" + std::string(kind.name) + "`: "), std::string::npos) << kind.name;
}

TEST(IncrementRatio, IsTheSlopeAndKnowsWhenNothingMoves) {
  std::vector<double> x;
  std::vector<double> y;
  for (int k = 0; k < 1000; ++k) {
    x.push_back(std::sin(0.01 * k));
    y.push_back(-3.5 * std::sin(0.01 * k) + 7.0);
  }
  const std::vector<Segment> segments = {{0, 400}, {400, 1000}};
  EXPECT_NEAR(increment_ratio(y, x, segments).factor, -3.5, 1e-9);
  EXPECT_TRUE(increment_ratio(y, x, segments).meaningful);
  EXPECT_FALSE(increment_ratio(y, std::vector<double>(1000, 2.0), segments).meaningful);
}

}  // namespace
}  // namespace flexspline::data::data_checks_test
