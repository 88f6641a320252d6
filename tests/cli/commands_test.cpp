// What the commands do to files, roles and limits.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/tool.hpp"
#include "tests/support/mat5.hpp"

namespace flexspline::cli_test::commands_test {
namespace {

fs::path emps_folder() {
  const char* data = std::getenv("FLEXSPLINE_DATA");
  return (data != nullptr ? fs::path(data) : fs::path(FLEXSPLINE_SOURCE_DIR) / ".." / "shared" / "data") / "emps";
}

TEST(New, LeadsFromABareLogToAComparison) {
  const fs::path emps = emps_folder() / "emps_train.csv";
  if (!fs::exists(emps))
    GTEST_SKIP() << "no EMPS data in " << emps << "; set FLEXSPLINE_DATA to the folder that holds emps/";
  const Shell shell;
  const nlohmann::json made = shell.json("flexspline new --from '" + emps.string() + "' --out axis");
  EXPECT_EQ(made["experiments"], 2);
  const std::string toml = shell.file("axis/dataset.toml");
  EXPECT_TRUE(contains(toml, "axis = \"linear\""));
  EXPECT_TRUE(contains(toml, "[columns.motor_torque_nm]"));
  EXPECT_TRUE(contains(toml, "source = \"motor_force_n\""));
  EXPECT_TRUE(contains(toml, "source = \"position_m\""));
  EXPECT_TRUE(contains(toml, "source = \"position_ref_m\""));
  EXPECT_TRUE(contains(toml, "to_s = 12.48\n"));  // two periods of the motion
  EXPECT_FALSE(fs::exists(shell.folder() / "axis/emps_train.csv"));

  const nlohmann::json found = shell.json(
      "flexspline identify axis --model axis/base-model.toml --out axis/fitted.toml --cutoff-hz 100 --mask none");
  for (const nlohmann::json& p : found["parameters"]) {
    if (p["effect"] == "inertia") {
      EXPECT_NEAR(p["value"].get<double>(), 95.1, 1.0);  // Janot, Gautier, Brunot 2019
    }
    if (p["effect"] == "coulomb_friction") {
      EXPECT_NEAR(p["value"].get<double>(), 20.4, 1.0);
    }
  }
  const nlohmann::json compared = shell.json("flexspline compare --model axis/fitted.toml axis");
  EXPECT_EQ(compared["experiments"][1]["role"], "holdout");
}

TEST(New, GuessesColumnsAndUnitsOfAForeignLog) {
  const Shell shell;
  std::string text = "Timestamp [ms];Iq (mA);motorSpeed;motor_pos_deg;Joint Angle [deg];housing_temp_c;status\n";
  for (int k = 0; k < 4000; ++k) {
    const double t = 0.002 * k;
    const double angle = 40.0 * (1.0 - std::cos(3.0 * t)), speed = 120.0 * std::sin(3.0 * t);
    char line[200];
    std::snprintf(line, sizeof line, "%.1f;%.3f;%.5f;%.6f;%.8f;%.2f;ok\n", 2.0 * k,
                  300.0 * std::cos(3.0 * t) + 80.0 * std::sin(3.0 * t), speed * 30.0 / M_PI, angle * 180.0 / M_PI,
                  angle * 1.8 / M_PI, 25.0 + 0.01 * t);
    text += line;
  }
  shell.write("log.csv", text);
  shell.must("flexspline new --from log.csv --out project --torque-constant 0.05");
  const std::string toml = shell.file("project/dataset.toml");
  EXPECT_TRUE(contains(toml, "[columns.time_s]")) << toml;
  EXPECT_TRUE(contains(toml, "source = \"Iq (mA)\"\nunit = \"mA\"")) << toml;
  EXPECT_TRUE(contains(toml, "source = \"motorSpeed\"\nunit = \"rpm\"")) << toml;  // only its values tell
  EXPECT_TRUE(contains(toml, "source = \"motor_pos_deg\"\nunit = \"deg\"")) << toml;
  EXPECT_TRUE(contains(toml, "[columns.output_position_rad]")) << toml;
  EXPECT_TRUE(contains(toml, "[columns.temperature_c]")) << toml;
  EXPECT_TRUE(contains(toml, "gear_ratio = 100")) << toml;  // by the slope of one position over the other
  EXPECT_TRUE(contains(shell.file("project/base-model.toml"), "current_offset"));
  shell.must("flexspline check project");
}

TEST(New, ReadsAMatFileAsItReadsTheSameCsv) {
  const Shell shell;
  std::vector<double> time, current, angle;
  std::string text = "recorder,Iq_in_mA,motorpos\n";
  for (int k = 0; k < 2000; ++k) {
    time.push_back(0.002 * k);
    current.push_back(300.0 * std::cos(3.0 * time.back()));
    angle.push_back(40.0 * (1.0 - std::cos(3.0 * time.back())));
    char line[200];
    std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g\n", time.back(), current.back(), angle.back());
    text += line;
  }
  shell.write("csv/log.csv", text);
  shell.write("mat/log.mat", flexspline::tests::Mat5Text()
                                 .add("recorder", time)
                                 .add("Iq_in_mA", current)
                                 .add("motorpos", angle)
                                 .add("settings", {1.0, 2.0, 3.0})
                                 .text());
  for (const std::string kind : {"csv", "mat"})
    shell.must("flexspline new --from " + kind + " --out from-" + kind +
               " --gear-ratio 100 --torque-constant 0.05 --map time_s=recorder --map motor_position_rad=motorpos");
  const std::string toml = shell.file("from-mat/dataset.toml");
  EXPECT_TRUE(contains(toml, "source = \"Iq_in_mA\"\nunit = \"mA\"")) << toml;
  EXPECT_FALSE(contains(toml, "source = \"settings\"")) << toml;
  EXPECT_EQ(shell.json("flexspline check from-mat")["experiments"][0]["signals"],
            shell.json("flexspline check from-csv")["experiments"][0]["signals"]);
  const Answer absent = shell.run("flexspline new --from mat --out other --map time_s=recoder");
  EXPECT_EQ(absent.code, 2);
  EXPECT_TRUE(contains(absent.err, "the columns are recorder, ")) << absent.err;
}

TEST(New, TakesTheUsersMappingOverItsOwn) {
  const Shell shell;
  std::string text = "time_s,a,b\n";
  for (int k = 0; k < 2000; ++k)
    text += std::to_string(0.001 * k) + "," + std::to_string(std::sin(0.01 * k)) + "," +
            std::to_string(std::cos(0.01 * k)) + "\n";
  shell.write("log.csv", text);
  EXPECT_EQ(shell.run("flexspline new --from log.csv --out project").code, 2);
  shell.must("flexspline new --from log.csv --out project --map current_a=a:mA --map motor_position_rad=b:deg");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "source = \"a\"\nunit = \"mA\""));
}

TEST(Identify, KeepsCommentsAndWritesOnlyWhenAsked) {
  const Shell shell;
  shell.record();
  shell.write("mine.toml", "# my drive\n" + shell.file("demo-out/base-model.toml"));
  const std::string before = shell.file("mine.toml");
  EXPECT_TRUE(contains(shell.must("flexspline identify demo-out --model mine.toml"), "--out"));
  EXPECT_EQ(shell.file("mine.toml"), before);
  shell.must("flexspline identify demo-out --model mine.toml --out fitted.toml");
  EXPECT_TRUE(shell.file("fitted.toml").starts_with("# my drive\n"));
  EXPECT_TRUE(contains(shell.file("fitted.toml"), "unit = \"kg*m^2\""));
}

TEST(Holdout, IsNeverFittedAndAlwaysJudged) {
  const Shell shell;
  shell.record();
  shell.must(
      "flexspline identify demo-out/free-sine-1hz.csv demo-out/free-trapezoid.csv --model demo-out/base-model.toml "
      "--holdout demo-out/free-trapezoid.csv --out fitted.toml --json found.json");
  const auto found = nlohmann::json::parse(shell.file("found.json"));
  for (const nlohmann::json& p : found["parameters"])
    for (const nlohmann::json& e : p["per_experiment"]) EXPECT_EQ(e["name"], "free-sine-1hz");
  const nlohmann::json all = shell.json("flexspline identify demo-out --model demo-out/base-model.toml --out all.toml");
  const nlohmann::json compared = shell.json(
      "flexspline compare --model all.toml demo-out/free-sine-1hz.csv --holdout demo-out/free-trapezoid.csv");
  ASSERT_EQ(compared["experiments"].size(), 2u);
  EXPECT_EQ(compared["experiments"][0]["role"], "fit");
  EXPECT_EQ(compared["experiments"][1]["role"], "holdout");
}

TEST(Compare, ALimitDecidesTheExitCode) {
  const Shell shell;
  shell.record_and_identify();
  const std::string line = "flexspline compare --model fitted.toml demo-out --limit motor_balance=";
  EXPECT_EQ(shell.run(line + "1").code, 0);
  const Answer above = shell.run(line + "1e-9");
  EXPECT_EQ(above.code, 1);
  EXPECT_TRUE(contains(above.err, "motor_balance")) << above.err;
}

TEST(Identify, HeadsOfExperimentsWhoseNamesBeginAlikeDiffer) {
  const Shell shell;
  shell.record();
  shell.must(
      "mkdir two && grep -v '^# experiment' demo-out/free-sine-1hz.csv >two/report-friction-1.csv && "
      "cp two/report-friction-1.csv two/report-friction-2.csv");
  const std::string text = shell.must("flexspline identify two --model demo-out/base-model.toml");
  EXPECT_TRUE(contains(text, "  repo..ction-1  repo..ction-2  ")) << text;
}

TEST(Simulate, ItsFilesAreMeasurementsAgain) {
  const Shell shell;
  shell.record_and_identify();
  shell.must("flexspline simulate --model fitted.toml demo-out --out sim");
  const std::string csv = shell.file("sim/free-sine-1hz.csv");
  EXPECT_TRUE(contains(csv,
                       "time_s,current_a,motor_position_rad,motor_velocity_rad_s,output_position_rad,"
                       "output_velocity_rad_s,torque_nm,temperature_c\n"));
  // A model fitted on its own simulation is itself again.
  const nlohmann::json found = shell.json("flexspline identify sim --model demo-out/base-model.toml");
  const nlohmann::json first = shell.json("flexspline identify demo-out --model demo-out/base-model.toml");
  for (std::size_t k = 0; k < found["parameters"].size(); ++k) {
    if (found["parameters"][k]["id"] != "output_inertia" && found["parameters"][k]["id"] != "inertia") continue;
    const double truth = first["parameters"][k]["value"].get<double>();
    EXPECT_NEAR(found["parameters"][k]["value"].get<double>(), truth, 0.02 * truth);
  }
}

TEST(Simulate, NeverWritesOverMeasurements) {
  const Shell shell;
  shell.record_and_identify();
  const std::string line = "flexspline simulate --model fitted.toml ", run = "demo-out/free-sine-1hz.csv";
  shell.must(line + run + " --out sim");
  const Answer full = shell.run(line + run + " --out sim");
  EXPECT_EQ(full.code, 2);
  EXPECT_TRUE(contains(full.err, "--force")) << full.err;
  shell.must(line + run + " --out sim --force");
  const std::string csv = shell.file("sim/free-sine-1hz.csv"), toml = shell.file("sim/dataset.toml");
  for (const char* data : {"sim", "sim/dataset.toml", "sim/free-sine-1hz.csv"}) {
    const Answer own = shell.run(line + data + " --out ./sim --force");
    EXPECT_EQ(own.code, 2) << data;
    EXPECT_TRUE(contains(own.err, "the folder of the measurements")) << own.err;
  }
  EXPECT_EQ(shell.file("sim/free-sine-1hz.csv"), csv);
  EXPECT_EQ(shell.file("sim/dataset.toml"), toml);
}

TEST(Simulate, WritesTheEffortThatDroveTheModel) {
  const Shell shell;
  std::string csv = "time_s,current_a,motor_torque_nm,motor_position_rad\n";
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.001 * k;
    csv += std::to_string(t) + "," + std::to_string(std::sin(9.0 * t)) + "," + std::to_string(0.1 * std::sin(9.0 * t)) +
           "," + std::to_string(t - 0.1 * std::sin(9.0 * t)) + "\n";
  }
  shell.write("run.csv", csv);
  const std::string model = R"(format = "flexspline-model/1"
name = "without a torque constant"
[drive]
axis = "rotary"
gear_ratio = 100
)";
  const std::string effects = R"([[effect]]
type = "inertia"
parameters = { inertia = { value = 1e-3, unit = "kg*m^2" } }
)";
  shell.write("m.toml", model + effects);
  shell.must("flexspline simulate --model m.toml run.csv --out sim");
  EXPECT_TRUE(contains(shell.file("sim/run.csv"), "time_s,motor_torque_nm,"))
      << shell.file("sim/run.csv").substr(0, 200);
  // With the constant the current drives it, as before.
  shell.write("m.toml", model + "torque_constant_nm_a = 0.1\n" + effects);
  shell.must("flexspline simulate --model m.toml run.csv --out by-current");
  EXPECT_TRUE(contains(shell.file("by-current/run.csv"), "time_s,current_a,motor_position_rad"));
}

TEST(Add, TheNextCommandsTakeTheSameDataPreparedAlike) {
  const Shell shell;
  shell.record();
  shell.must("mkdir held && mv demo-out/free-sine-1hz.csv held/run.csv");
  shell.write("demo-out/dataset.toml", "format = \"flexspline-dataset/1\"\n[drive]\ngear_ratio = 100\n");
  const std::string how = "demo-out --holdout held --cutoff-hz 30 --mask none";
  for (const std::string& command :
       {"identify " + how + " --model demo-out/base-model.toml --out fitted.toml",
        "add viscous_asymmetry --model demo-out/base-model.toml " + how + " --out more.toml"}) {
    const std::string said = shell.must("flexspline " + command);
    EXPECT_TRUE(contains(said, "  flexspline compare --model ")) << said;
    std::size_t hints = 0;
    for (std::size_t at = said.find("\n  flexspline "); at != std::string::npos;
         at = said.find("\n  flexspline ", at + 1)) {
      const std::string hint = said.substr(at, said.find('\n', at + 1) - at);
      EXPECT_TRUE(contains(hint, how)) << hint;
      ++hints;
    }
    EXPECT_GE(hints, 1u);
  }
}

}  // namespace
}  // namespace flexspline::cli_test::commands_test
