// The whole circle by the commands a user types: record on a drive with an effect that nobody told of, identify,
// compare, diagnose, add, pack, flash, and see the drive follow a motion closer that was never recorded.
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::whole_circle_test {
namespace {

using nlohmann::json;

std::string run_of(const std::string& name, const std::string& motion) {
  return "\n[[run]]\nname = \"" + name + "\"\n" + motion + "\n";
}
std::string plan_of(const std::string& runs) {
  return "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[limits]\nvelocity_rad_s = 150\n" + runs;
}
std::string velocity(const char* waveform, const char* amplitude, const char* hz) {
  return std::string("mode = \"velocity\"\nwaveform = \"") + waveform + "\"\namplitude = " + amplitude +
         "\nfrequency_hz = " + hz + "\nduration_s = 8";
}
std::string locked(const char* waveform, const char* amplitude, const char* hz) {
  return std::string("mode = \"current\"\nload = \"locked\"\nwaveform = \"") + waveform +
         "\"\namplitude = " + amplitude + "\nfrequency_hz = " + hz + "\nduration_s = 6";
}
void replace(std::string& text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  ASSERT_NE(at, std::string::npos) << what << " in\n" << text;
  text.replace(at, text.find('\n', at) - at, by);
}
double value_of(const json& answer, const std::string& effect, const std::string& parameter) {
  for (const json& p : answer["parameters"])
    if (p["effect"] == effect && p["parameter"] == parameter) return p["value"];
  ADD_FAILURE() << "no " << effect << "." << parameter;
  return 0.0;
}

TEST(WholeCircle, FromRecordingsOfADriveWithAHiddenEffectToACloserMotion) {
  const Shell shell;
  const std::string hidden = "stribeck_gaussian";
  shell.write("free.toml", plan_of(run_of("slow", velocity("triangle", "12", "0.25")) +
                                   run_of("sine", velocity("sine", "100", "1")) +
                                   run_of("triangle", velocity("triangle", "60", "0.5")) +
                                   run_of("unseen", velocity("asymmetric_sine", "8", "0.25"))));
  shell.write("locked.toml", plan_of(run_of("locked-sine", locked("sine", "3", "0.5")) +
                                     run_of("locked-triangle", locked("triangle", "2", "0.5")) +
                                     run_of("locked-fast", locked("sine", "3", "4"))));
  const TwinProcess twin({"--serve", "0", "--fast", "--hide", hidden});
  const std::string drive = " --drive " + twin.name();
  {
    // The same drive with its output locked.
    const TwinProcess clamped({"--serve", "0", "--fast", "--locked", "--hide", hidden});
    shell.must("flexspline record --yes --plan locked.toml --out locked --drive " + clamped.name());
  }
  shell.must("flexspline record --plan free.toml --out free" + drive);
  shell.must("flexspline new --from free/slow.csv free/sine.csv free/triangle.csv locked/*.csv --out project");

  // What a user knows and the signals do not say.
  std::string first = shell.file("project/base-model.toml");
  replace(first, "rated_current_a", "rated_current_a = 2.0");
  replace(first, "rated_velocity_rad_s", "rated_velocity_rad_s = 200.0");
  replace(first, "rated_torque_nm", "rated_torque_nm = 40.0");
  shell.write("project/base-model.toml", first);
  const json base = shell.json("flexspline identify project --model project/base-model.toml --out base.toml");
  // Runs begin where the shaft stands, whole turns and all: else there would be a turn of torsion in one of them.
  EXPECT_NEAR(value_of(base, "linear_stiffness", "stiffness"), 6300.0, 0.05 * 6300.0);
  EXPECT_NEAR(value_of(base, "inertia", "inertia"), 1.04e-4, 0.02e-4);
  // What the gear's damping makes of speed is identifiable from the locked runs' two frequencies; else it would be in
  // both models.
  EXPECT_NEAR(value_of(base, "structural_damping", "torque"), 57.0, 0.05 * 57.0);
  EXPECT_NEAR(value_of(base, "structural_damping", "exponent"), 0.5, 0.01);
  shell.must("flexspline compare --model base.toml project");
  const json found = shell.json("flexspline diagnose --model base.toml project --holdout free/unseen.csv");
  EXPECT_EQ(found["verdict"], "missing_effect");
  ASSERT_EQ(found["named"].size(), 1U);
  EXPECT_EQ(found["named"][0]["effect"], hidden);
  const json added =
      shell.json("flexspline add " + hidden + " --model base.toml project --holdout free/unseen.csv --out added.toml");
  EXPECT_LT(added["after"]["rmse_holdout"].get<double>(), 0.6 * added["before"]["rmse_holdout"].get<double>());
  EXPECT_NEAR(value_of(added, hidden, "amplitude_positive"), 0.012, 0.0012);
  shell.must("flexspline pack --model added.toml --encoder-counts 16384 --tick-hz 20000 --out added.block");
  shell.must("flexspline unpack added.block");

  const json flashed = shell.json("flexspline flash --model added.toml" + drive);
  EXPECT_TRUE(flashed["flashed"].get<bool>());
  EXPECT_EQ(shell.json("flexspline backup --out of-the-drive.block" + drive)["block"]["sha256"],
            flashed["after"]["sha256"]);

  // Against the truth, which no encoder sees, on a motion that was not recorded.
  const json loop = shell.json("flexspline hil --scenario slow-reversals --seconds 5 --draws 4 --hide " + hidden +
                               " --base base.toml --model added.toml");
  ASSERT_EQ(loop["runs"].size(), 3U);
  const auto mrad = [&](const char* of) {
    std::string all;
    for (const json& run : loop["runs"]) all += std::to_string(1e3 * run[of].get<double>()) + " ";
    return all;
  };
  const double none = loop["runs"][0]["rms_error_rad"], with_base = loop["runs"][1]["rms_error_rad"],
               with_added = loop["runs"][2]["rms_error_rad"];
  const double base_peak = loop["runs"][1]["peak_error_rad"], added_peak = loop["runs"][2]["peak_error_rad"];
  RecordProperty("hil_rms_mrad", mrad("rms_error_rad"));
  RecordProperty("hil_peak_mrad", mrad("peak_error_rad"));
  EXPECT_LT(with_base, 0.5 * none);
  // Friction that falls with speed shows where the motion turns: in the peak.
  EXPECT_LT(added_peak, 0.3 * base_peak);
  EXPECT_LT(with_added, 0.5 * with_base);
  EXPECT_GT(with_added, 5e-8);
}

}  // namespace
}  // namespace flexspline::cli_test::whole_circle_test
