// Plans: their file, their set points against the plant's own reading of them, and what is chosen for effects whose
// separation is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "hil/plant/excitation.hpp"
#include "host/engine/planning/design.hpp"
#include "host/engine/planning/rehearsed_motions.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::planning::planning_test {
namespace {

Plan a_plan() {
  Plan plan;
  plan.model = "some drive";
  plan.separate = {"gravity", "linear_stiffness"};
  plan.limits = {2.0, 180.0, 6.28, 60.0, 5.0};
  planning::Run run;
  run.name = "first";
  run.waveform = Waveform::multi_sine;
  run.amplitude = 12.5;
  run.offset = -3.0;
  run.frequency_hz = 0.5;
  run.lines = {{1, 0.25, 1.0}, {3, 0.6123, 0.5}, {7, 0.0, 2.0}};
  run.duration_s = 3.0;
  run.temperature_c = 41.0;
  plan.runs.push_back(run);
  run = {};
  run.name = "second";
  run.mode = Mode::current;
  run.amplitude = 1.5;
  run.frequency_hz = 0.2;
  run.end_frequency_hz = 7.0;
  run.slope_limit = 40.0;
  run.locked = true;
  run.load_torque_nm = -2.0;
  run.instructions = "Lock the output.";
  plan.runs.push_back(run);
  return plan;
}

TEST(Plan, ReadsBackAsItWasWritten) {
  const Plan plan = a_plan();
  const Plan read = parse(text_of(plan), "plan.toml");
  EXPECT_EQ(text_of(read), text_of(plan));
  ASSERT_EQ(read.runs.size(), 2u);
  EXPECT_EQ(read.runs[0].waveform, Waveform::multi_sine);
  ASSERT_EQ(read.runs[0].lines.size(), 3u);
  EXPECT_DOUBLE_EQ(read.runs[0].lines[1].phase_turns, 0.6123);
  EXPECT_EQ(read.runs[1].mode, Mode::current);
  EXPECT_TRUE(read.runs[1].locked);
  EXPECT_DOUBLE_EQ(*read.runs[1].end_frequency_hz, 7.0);
  EXPECT_EQ(read.separate, plan.separate);
}

TEST(Plan, SaysWhereAFileIsWrong) {
  const auto error_of = [](const std::string& text) -> std::string {
    try {
      parse(text, "plan.toml");
    } catch (const PlanError& error) {
      return error.what();
    }
    return "";
  };
  const std::string head = "format = \"flexspline-plan/1\"\n[[run]]\nname = \"a\"\n";
  EXPECT_NE(error_of(head + "waveform = \"sinus\"\n").find("plan.toml:4: [[run]]: waveform = \"sinus\" is unknown"),
            std::string::npos);
  EXPECT_NE(error_of(head + "amplitud = 3.0\n").find("unknown key \"amplitud\""), std::string::npos);
  EXPECT_NE(error_of(head + "waveform = \"multi_sine\"\n").find("needs lines"), std::string::npos);
  EXPECT_NE(error_of("format = \"flexspline-plan/2\"\n").find("format must be"), std::string::npos);
  EXPECT_NE(error_of(head + "duration_s = -1.0\n").find("duration_s"), std::string::npos);
  EXPECT_NE(error_of(head + "duration_s = 1e15\n").find("more than 5e+07 samples"), std::string::npos);
}

// The plant reads plans and makes their waveforms by itself.
TEST(Plan, SetPointsAreThoseOfThePlant) {
  Plan plan = a_plan();
  for (const Waveform waveform :
       {Waveform::sine, Waveform::inverted_sine, Waveform::composite, Waveform::asymmetric_sine, Waveform::square,
        Waveform::saw_tooth, Waveform::triangle, Waveform::zero}) {
    planning::Run run;
    run.name = name_of(waveform);
    run.waveform = waveform;
    run.amplitude = 40.0;
    run.offset = 5.0;
    run.frequency_hz = 0.7;
    run.duration_s = 4.0;
    if (waveform == Waveform::square) run.slope_limit = 2000.0;
    plan.runs.push_back(run);
  }
  const auto file = std::filesystem::temp_directory_path() / "flexspline-planning-test.toml";
  std::ofstream(file) << text_of(plan);
  plant::Drive drive = plant::demo_plant().drive;
  const auto runs = plant::load_plan(file, drive);
  std::filesystem::remove(file);
  ASSERT_EQ(runs.size(), plan.runs.size());
  EXPECT_DOUBLE_EQ(drive.current_limit_a, 2.0);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::vector<double> ours = set_points(plan.runs[i], plan.sample_s), theirs = plant::commands(runs[i], 1e-3);
    ASSERT_EQ(ours.size(), theirs.size());
    // A sample on an edge may fall to either side of it.
    const bool jumps = plan.runs[i].waveform == Waveform::saw_tooth || plan.runs[i].waveform == Waveform::square;
    std::size_t far = 0;
    for (std::size_t k = 0; k < ours.size(); ++k)
      far += std::abs(ours[k] - theirs[k]) > 2e-5 * (plan.runs[i].amplitude + std::abs(plan.runs[i].offset));
    EXPECT_LE(far, jumps ? ours.size() / 50 : 0u) << plan.runs[i].name;
    EXPECT_GT(*std::max_element(ours.begin(), ours.end()), 0.0);
  }
}

model::Model a_drive() {
  model::Model m;
  m.name = "drive";
  m.drive.gear_ratio.value = 100.0;
  m.drive.torque_constant_nm_a.value = 0.0543;
  m.drive.rated_current_a.value = 3.0;
  m.drive.rated_velocity_rad_s.value = 150.0;
  m.drive.rated_torque_nm.value = 40.0;
  for (const char* type : {"inertia", "viscous_friction", "coulomb_friction", "linear_stiffness", "structural_damping",
                           "output_inertia", "output_coulomb_friction"}) {
    const catalogue::Entry& entry = catalogue::get(type);
    model::Effect effect = catalogue::blank_effect(entry, data::Axis::rotary);
    for (std::size_t p = 0; p < effect.parameters.size(); ++p) effect.parameters[p].value = entry.parameters[p].usual;
    m.effects.push_back(std::move(effect));
  }
  return m;
}

PlanRequest request_for(const model::Model& model) {
  PlanRequest q;
  q.model = &model;
  q.setting = setting_of(model, nullptr);
  q.setting.run_s = 4.0;
  q.setting.temperature = false;
  return q;
}

TEST(Planning, AnOffsetOfTheSensorIsToldFromAsymmetryWithTheDriveOff) {
  const model::Model m = a_drive();
  const PlanRequest q = request_for(m);
  const Design d = discriminate(q, "current_offset", "coulomb_asymmetry");
  EXPECT_TRUE(
      std::any_of(d.plan.runs.begin(), d.plan.runs.end(), [](const planning::Run& r) { return r.mode == Mode::off; }));
  EXPECT_GT(d.after->worst(), kDistinguished);
  ASSERT_EQ(d.peaks.size(), d.plan.runs.size());
  for (const Design::Peak& peak : d.peaks) {
    EXPECT_LE(peak.current_a, q.setting.limits.current_a);
    EXPECT_LE(peak.velocity_rad_s, 1.02 * q.setting.limits.velocity_rad_s);
    EXPECT_LE(peak.travel_rad, 1.02 * q.setting.limits.travel_rad);
  }
}

TEST(Planning, WithoutTheDriveOffTheSameTwoAreOneClass) {
  const model::Model m = a_drive();
  PlanRequest q = request_for(m);
  q.setting.off = q.setting.locked = q.setting.external_load = false;
  const Design d = discriminate(q, "current_offset", "coulomb_asymmetry");
  EXPECT_LT(d.after->worst(), kDistinguished);
  EXPECT_TRUE(d.plan.runs.empty());
  ASSERT_FALSE(d.plan.notes.empty());
  EXPECT_NE(d.plan.notes.front().find("No motion within these limits"), std::string::npos);
}

TEST(Planning, StiffnessIsUnknownUntilTheOutputIsLocked) {
  const model::Model m = a_drive();
  const Design d = d_optimal(request_for(m));
  EXPECT_TRUE(std::any_of(d.plan.runs.begin(), d.plan.runs.end(), [](const planning::Run& r) { return r.locked; }));
  for (const Precision& p : d.parameters) {
    ASSERT_TRUE(p.percent_after.has_value()) << p.id;
    EXPECT_LT(*p.percent_after, 20.0) << p.id;
  }
}

data::Experiment a_record(data::Load load, double force = 1.0) {
  data::Experiment e;
  e.load = load;
  e.sample_s = 1e-3;
  for (int k = 0; k < 100; ++k) {
    e.time_s.push_back(1e-3 * k);
    e[data::Column::motor_position].push_back(0.004 * k);
    e[data::Column::motor_velocity].push_back(4.0);
    e[data::Column::motor_torque].push_back(force);
  }
  return e;
}

bool any(const std::vector<Motion>& list, bool (*has)(const planning::Run&)) {
  return std::any_of(list.begin(), list.end(),
                     [&](const Motion& m) { return std::any_of(m.runs.begin(), m.runs.end(), has); });
}

TEST(Planning, WhereAllRecordsHaveALockedOutputNoMotionOfAFreeOneIsProposed) {
  const model::Model m = a_drive();
  data::Dataset dataset;
  dataset.experiments = {a_record(data::Load::locked), a_record(data::Load::locked)};
  MotionSettings setting = setting_of(m, &dataset);
  setting.temperature = true;
  const auto moves = [](const planning::Run& r) { return !r.locked && r.mode != Mode::off; };
  EXPECT_FALSE(any(motions(setting), moves));
  EXPECT_TRUE(any(motions(setting), [](const planning::Run& r) { return r.locked; }));
  dataset.experiments.push_back(a_record(data::Load::free));
  EXPECT_TRUE(any(motions(setting_of(m, &dataset)), moves));
}

TEST(Planning, ALockedOutputThatTheDataShowIsProposedWithoutAGearAsWell) {
  model::Model m = a_drive();
  m.drive.gear_ratio.value = 1.0;
  data::Dataset dataset;
  dataset.experiments = {a_record(data::Load::free)};
  EXPECT_FALSE(setting_of(m, &dataset).locked);
  dataset.experiments.push_back(a_record(data::Load::locked));
  EXPECT_TRUE(setting_of(m, &dataset).locked);
}

TEST(Planning, TwoTemperaturesAreRehearsedOnlyForAModelOrAnEffectThatDependsOnThem) {
  const model::Model m = a_drive();
  PlanRequest q = request_for(m);
  q.setting.run_s = 1.0;
  q.setting.temperature = true;
  const auto warm = [](const RehearsedMotions& rehearsed) {
    return any(rehearsed.motions(), [](const planning::Run& r) { return r.temperature_c.has_value(); });
  };
  EXPECT_FALSE(warm(RehearsedMotions(q)));
  EXPECT_FALSE(warm(RehearsedMotions(q, {"current_offset", "torque_bias"})));
  EXPECT_TRUE(warm(RehearsedMotions(q, {"temperature_viscous", "temperature_coulomb"})));
}

TEST(Planning, AParameterOfMoreThanOnePercentIsNotSaidToBeKnownWell) {
  const model::Model m = a_drive();
  PlanRequest q = request_for(m);
  q.most_motions = 1;
  q.setting.locked = false;
  const Design d = d_optimal(q);
  const auto open = std::find_if(d.parameters.begin(), d.parameters.end(),
                                 [](const Precision& p) { return p.id == "linear_stiffness"; });
  ASSERT_NE(open, d.parameters.end());
  EXPECT_FALSE(open->precise());
  ASSERT_FALSE(d.plan.notes.empty());
  EXPECT_NE(d.plan.notes.front().find("linear_stiffness.stiffness (unknown)"), std::string::npos)
      << d.plan.notes.front();
  EXPECT_FALSE((Precision{"a", "b", "", 1.0, std::nullopt, 110.0}.precise()));
  EXPECT_FALSE((Precision{"a", "b", "", 1.0, 0.5, std::nullopt}.precise()));
  EXPECT_TRUE((Precision{"a", "b", "", 1.0, std::nullopt, 0.5}.precise()));
}

TEST(Planning, TheEffortOfTorquesWithoutATorqueConstantIsNoCurrent) {
  model::Model m = a_drive();
  data::Dataset dataset;
  dataset.experiments = {a_record(data::Load::free, 0.07)};
  // The rated current of 3 A is known, and what it is as a torque.
  EXPECT_TRUE(sensors_of(m, &dataset).current);
  EXPECT_DOUBLE_EQ(setting_of(m, &dataset).limits.current_a, 3.0);
  m.drive.torque_constant_nm_a.value.reset();
  EXPECT_FALSE(sensors_of(m, &dataset).current);
  EXPECT_DOUBLE_EQ(setting_of(m, &dataset).limits.current_a, 0.07);
}

TEST(Planning, TheTravelOfALinearAxisIsThatOfTheData) {
  model::Model m = a_drive();
  m.drive.axis = data::Axis::linear;
  m.drive.gear_ratio.value = 1.0;
  EXPECT_EQ(setting_of(m, nullptr).limits.travel_rad, 0.0);
  data::Dataset dataset;
  dataset.experiments = {a_record(data::Load::free)};
  EXPECT_DOUBLE_EQ(setting_of(m, &dataset).limits.travel_rad, 0.004 * 99);
}

TEST(Planning, ACurrentThatMovesNothingShowsNothing) {
  const model::Model m = a_drive();
  PlanRequest q = request_for(m);
  q.setting.limits.current_a = 0.01;
  q.setting.off = q.setting.locked = q.setting.external_load = false;
  const Design d = discriminate(q, "viscous_asymmetry", "coulomb_asymmetry");
  EXPECT_LT(d.after->worst(), kDistinguished);
  EXPECT_TRUE(d.plan.runs.empty());
}

}  // namespace
}  // namespace flexspline::planning::planning_test
