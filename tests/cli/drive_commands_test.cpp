// The commands that speak with a drive, against a twin behind a socket or a serial line.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::drive_commands_test {
namespace {

using nlohmann::json;

// The demo's drive as a model with values, for the twin to compute with; `scale` of its viscous friction.
std::string model_with(double scale) {
  return "format = \"flexspline-model/1\"\nname = \"by-hand\"\n[drive]\naxis = \"rotary\"\ngear_ratio = 100\n"
         "torque_constant_nm_a = 0.0543\nrated_current_a = 2.0\nrated_velocity_rad_s = 200.0\nrated_torque_nm = 40.0\n"
         "temperature_reference_c = 30.0\n[[effect]]\ntype = \"inertia\"\n[effect.parameters]\n"
         "inertia = { value = 1.04e-4 }\n[[effect]]\ntype = \"viscous_friction\"\n[effect.parameters]\n"
         "coefficient = { value = " +
         std::to_string(3.6e-4 * scale) +
         " }\n[[effect]]\ntype = \"coulomb_friction\"\n[effect.parameters]\ntorque = { value = 0.045 }\n";
}
std::string plan_of(const std::string& runs, const std::string& limits = "", double sample_s = 0.001) {
  return "format = \"flexspline-plan/1\"\nsample_s = " + std::to_string(sample_s) + "\n[limits]\n" + limits + runs;
}
std::string run_of(const std::string& name, const std::string& motion) {
  return "\n[[run]]\nname = \"" + name + "\"\n" + motion + "\n";
}
const std::string kTriangle =
    "mode = \"velocity\"\nwaveform = \"triangle\"\namplitude = 100\nfrequency_hz = 0.25\nduration_s = 4";
const std::string kSine = "mode = \"velocity\"\nwaveform = \"sine\"\namplitude = 50\nfrequency_hz = 1\nduration_s = 4";
const std::string kMultiSine =
    "mode = \"current\"\nwaveform = \"multi_sine\"\namplitude = 1.2\nfrequency_hz = 0.5\nduration_s = 6\n"
    "lines = [[3, 0.1, 1.0], [5, 0.7, 1.0], [9, 0.3, 1.0], [17, 0.9, 1.0], [23, 0.2, 1.0]]";

std::string sha_of(const Shell& shell, const TwinProcess& twin) {
  const json answer = shell.json("flexspline backup --drive " + twin.name() + " --out of-the-drive.block");
  return answer["block"]["sha256"];
}

TEST(Drives, SaysWhatStandsBehindASocketAndWhatCannotBeReached) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0", "--serial", "SN-42"});
  const json answer = shell.json("flexspline drives --also " + twin.name() + " --also tcp:127.0.0.1:1");
  EXPECT_EQ(answer["format"], "flexspline-drives/1");
  ASSERT_EQ(answer["drives"].size(), 2U);
  const json& first = answer["drives"][0];
  EXPECT_EQ(first["serial"], "SN-42");
  EXPECT_EQ(first["tick_hz"], 20'000);
  EXPECT_GT(first["effects"].get<int>(), 40);
  EXPECT_TRUE(first["usable"].get<bool>());
  EXPECT_EQ(first["firmware_key"], "development");
  EXPECT_TRUE(first["fault_reason"].is_null());
  EXPECT_FALSE(answer["drives"][1]["usable"].get<bool>());
  EXPECT_TRUE(contains(answer["drives"][1]["problem"].get<std::string>(), "is the twin running?"));
}

TEST(Twin, SaysWhereItIsAndWhatItCannotDo) {
  const Shell shell;
  EXPECT_TRUE(contains(shell.must("flexspline twin --seconds 0.2 --serial SN-42"), "drive SN-42 at tcp:127.0.0.1:"));
  const json usb = shell.json("flexspline twin --seconds 0.2 --usbip 0");
  EXPECT_EQ(usb["format"], "flexspline-twin/1");
  EXPECT_EQ(usb["drive"], "hid:TWIN");
  EXPECT_GT(usb["usbip_port"].get<int>(), 0);
  for (const char* line : {"--plant missing.toml", "--usbip 70000", "--serial 'a b'", "--seconds 0.1 --json no/folder"})
    EXPECT_EQ(shell.run(std::string("flexspline twin ") + line).code, 2) << line;
}

TEST(Flash, SaysWhatChangesFlashesAndRestoreGoesBack) {
  const Shell shell;
  shell.write("a.toml", model_with(1.0));
  shell.write("b.toml", model_with(1.25));
  const TwinProcess twin({"--serve", "0"});
  const std::string drive = " --drive " + twin.name();
  const std::string made = sha_of(shell, twin);
  const json a = shell.json("flexspline flash --model a.toml" + drive);
  EXPECT_EQ(a["before"]["sha256"], made);
  EXPECT_TRUE(a["flashed"].get<bool>());
  const json b = shell.json("flexspline flash --model b.toml" + drive);
  EXPECT_EQ(b["before"]["sha256"], a["after"]["sha256"]);
  bool told = false;
  for (const json& change : b["changes"]) {
    EXPECT_EQ(change["change"], change["effect"] == "viscous_friction" ? "changed" : "same");
    if (change["effect"] != "viscous_friction") continue;
    EXPECT_EQ(change["parameter"], "coefficient");
    EXPECT_NEAR(change["after"].get<double>() / change["before"].get<double>(), 1.25, 1e-6);
    told = true;
  }
  EXPECT_TRUE(told);
  EXPECT_EQ(sha_of(shell, twin), b["after"]["sha256"]);
  EXPECT_FALSE(shell.json("flexspline flash --model b.toml" + drive)["flashed"].get<bool>()) << "it has it already";
  EXPECT_TRUE(shell.json("flexspline restore" + drive)["restored"].get<bool>());
  EXPECT_EQ(sha_of(shell, twin), a["after"]["sha256"]);
  // A backup is a block like any other.
  shell.must("flexspline backup --previous --out b.block" + drive);
  EXPECT_EQ(shell.json("flexspline flash --block b.block" + drive)["after"]["sha256"], b["after"]["sha256"]);
  shell.must("flexspline unpack b.block");
}

TEST(Flash, AnotherModelLeavesTheSettingsOfTheDriveAsTheyWere) {
  const Shell shell;
  // With the drive's current limit as rated current its overcurrent can be measured.
  std::string model = model_with(1.0);
  model.replace(model.find("rated_current_a = 2.0"), 21, "rated_current_a = 3.5");
  shell.write("a.toml", model);
  const TwinProcess twin({"--serve", "0"});
  shell.must("flexspline backup --out made.block --drive " + twin.name());
  shell.must("flexspline flash --model a.toml --drive " + twin.name());
  shell.must("flexspline backup --out now.block --drive " + twin.name());
  const json made = shell.json("flexspline unpack made.block"), now = shell.json("flexspline unpack now.block");
  std::map<std::string, double> is;
  for (const json& q : now["settings"]) is[q["name"]] = q["value"];
  for (const json& was : made["settings"]) {
    const std::string name = was["name"];
    // These follow from the model, which has no spring.
    if (name == "disturbance_inertia" || name.starts_with("fault_stuck") || name == "feedforward_stiffness" ||
        name == "torsion_rate_limit")
      continue;
    ASSERT_TRUE(is.contains(name)) << name;
    EXPECT_NEAR(is[name], was["value"].get<double>(), 1e-4 * std::abs(was["value"].get<double>())) << name;
  }
}

TEST(Flash, AnotherModelKeepsEverySettingThatTheDriveWasGiven) {
  const Shell shell;
  shell.write("a.toml", model_with(1.0));
  // Its rated values, and so the bases of its block, are others.
  std::string other = model_with(1.2);
  other.replace(other.find("rated_velocity_rad_s = 200.0"), 28, "rated_velocity_rad_s = 230.0");
  shell.write("b.toml", other);
  shell.write("drive.toml",
              "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 16384\ncorner_hz = 120\n"
              "[output_encoder]\ncounts = 262144\ncorner_hz = 40\n[torque_sensor]\nripple_memory_rad = 100\n"
              "largest_ripple_nm = 1.5\nlowest_share = -0.9\n[limits]\nlowest_rad = -3\nhighest_rad = 2.5\n"
              "[faults]\nstuck_torque_nm = 0.07\nstuck_s = 0.2\ncurrent_mismatch_a = 0.7\nmismatch_s = 0.02\n"
              "torque_same_s = 0.03\nstandstill_rad_s = 2\n[feedforward]\noutput_zero_turns = 0.25\n"
              "[disturbance]\ntime_constant_s = 0.03\n[current_sensor]\nhighest_share = 0.95\n"
              "[residual_map]\nstandstill_rad_s = 0.7\nlargest_rad_s = 150\n");
  const TwinProcess twin({"--serve", "0"});
  const std::string drive = " --drive " + twin.name();
  shell.must("flexspline flash --model a.toml --settings drive.toml" + drive);
  shell.must("flexspline backup --out given.block" + drive);
  const std::string said = shell.must("flexspline flash --model b.toml" + drive);
  EXPECT_EQ(said.find("in the active block"), std::string::npos) << said;
  shell.must("flexspline backup --out kept.block" + drive);
  const json was = shell.json("flexspline unpack given.block"), is = shell.json("flexspline unpack kept.block");
  const auto value = [](const json& block, const std::string& name) {
    for (const json& q : block["settings"])
      if (q["name"] == name) return q["value"].get<double>();
    return std::nan("");
  };
  EXPECT_NEAR(value(was, "lowest_position"), -3.0, 1e-6);
  EXPECT_NEAR(value(was, "fault_stuck_torque"), 0.07, 1e-6);
  EXPECT_NEAR(value(was, "ripple_memory"), 100.0, 1e-4);
  EXPECT_NEAR(value(was, "output_zero"), 0.25, 1e-9);
  ASSERT_EQ(was["settings"].size(), is["settings"].size());
  for (const json& q : was["settings"]) {
    const std::string name = q["name"];
    const double before = q["value"];
    EXPECT_NEAR(value(is, name), before, 1e-4 * std::abs(before) + 1e-9) << name;
  }
}

TEST(Flash, RefusesWhatDoesNotFitAndTheDriveKeepsItsBlock) {
  const Shell shell;
  std::string other_gear = model_with(1.0);
  other_gear.replace(other_gear.find("gear_ratio = 100"), 16, "gear_ratio = 50 ");
  shell.write("gear.toml", other_gear);
  shell.write("no.block", "this is no block");
  shell.write("a.toml", model_with(1.0));
  shell.must("flexspline pack --model a.toml --tick-hz 20000 --out model.block");  // without a drive's settings
  const TwinProcess twin({"--serve", "0"});
  const std::string drive = " --drive " + twin.name();
  const std::string made = sha_of(shell, twin);
  for (const auto& [line, expected] : std::vector<std::pair<std::string, std::string>>{
           {"flash --model gear.toml", "a gear of 50"},
           {"flash --block model.block", "settings of the drive"},
           {"flash --block no.block", "no.block: this is not a good parameter block"},
           {"flash --block missing.block", "cannot be read"},
           {"flash", "--model MODEL"},
           {"restore", "no valid block before"},
           {"backup --previous --out x", "no block before"}}) {
    const Answer answer = shell.run("flexspline " + line + drive);
    EXPECT_EQ(answer.code, 2) << line;
    EXPECT_TRUE(contains(answer.err, expected)) << line << ": " << answer.err;
  }
  EXPECT_EQ(sha_of(shell, twin), made);
}

TEST(Flash, OptionsOfAModelAreRefusedWithABlock) {
  const Shell shell;
  for (const char* option : {"--settings missing.toml", "--measured", "--draws 8"}) {
    const Answer answer = shell.run(std::string("flexspline flash --drive twin --block f.block ") + option);
    EXPECT_EQ(answer.code, 2) << option;
    EXPECT_TRUE(contains(answer.err, "--block")) << answer.err;
    EXPECT_TRUE(contains(answer.err, std::string(option).substr(0, 6))) << answer.err;
  }
}

TEST(Flash, ABlockForAnotherDriveIsNotFlashedWithoutAWarning) {
  const Shell shell;
  shell.write("a.toml", model_with(1.0));
  shell.write("drive.toml",
              "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 16384\n[output_encoder]\n"
              "counts = 262144\n[torque_sensor]\n");
  const TwinProcess twin({"--serve", "0"});
  const std::string drive = " --drive " + twin.name();
  const auto warning_for = [&](const std::string& name) {
    shell.must("flexspline pack --model a.toml --drive drive.toml --out x.block --for-drive " + twin.name() +
               " --drive-name " + name);
    const Answer answer = shell.run("flexspline flash --block x.block" + drive);
    EXPECT_EQ(answer.code, 0) << answer.err;
    return contains(answer.err, "was packed for drive \"" + name + "\"");
  };
  EXPECT_TRUE(warning_for("axis-3"));
  EXPECT_FALSE(warning_for("TWIN"));
}

TEST(Flash, WhatWasFlashedOutlastsAPowerCutAndOneInTheMiddleLeavesOldOrNew) {
  const Shell shell;
  shell.write("a.toml", model_with(1.0));
  shell.write("b.toml", model_with(1.25));
  const std::string flash = (shell.folder() / "twin.flash").string();
  std::string a, b;
  {
    const TwinProcess twin({"--serve", "0", "--flash", flash});
    a = shell.json("flexspline flash --model a.toml --drive " + twin.name())["after"]["sha256"];
    shell.must("flexspline backup --out a.block --drive " + twin.name());
    b = shell.json("flexspline flash --model b.toml --drive " + twin.name())["after"]["sha256"];
    shell.must("flexspline backup --out b.block --drive " + twin.name());
  }
  int old_ones = 0, new_ones = 0;
  for (const int cut_ms : {2, 4, 6, 8, 10, 13, 16, 20, 30, 60}) {
    TwinProcess twin({"--serve", "0", "--flash", flash});
    const std::string before = sha_of(shell, twin);
    const std::string wanted = before == a ? "b.block" : "a.block";
    const Answer answer = shell.run("(sleep 0.0" + std::string(cut_ms < 10 ? "0" : "") + std::to_string(cut_ms) +
                                    "; kill -9 " + std::to_string(twin.pid()) + ") & flexspline flash --yes --block " +
                                    wanted + " --drive " + twin.name() + "; code=$?; wait; exit $code");
    twin.cut_power();
    const TwinProcess again({"--serve", "0", "--flash", flash});
    const std::string after = sha_of(shell, again);
    const std::string other = before == a ? b : a;
    ASSERT_TRUE(after == before || after == other) << cut_ms;
    if (answer.code == 0) {
      EXPECT_EQ(after, other);
    }
    if (answer.code != 0) {
      EXPECT_EQ(answer.code, 2);
      // Its port may be another test's twin by then, which wants its own token.
      EXPECT_TRUE(contains(answer.err, "the drive is gone") || contains(answer.err, "does not answer") ||
                  contains(answer.err, "is the twin running") || contains(answer.err, "knows its token"))
          << answer.err;
    }
    (after == before ? old_ones : new_ones) += 1;
    // The next try works.
    EXPECT_EQ(shell.json("flexspline flash --yes --block " + wanted + " --drive " + again.name())["after"]["sha256"],
              other);
  }
  std::printf("power cuts while flashing: %d old, %d new\n", old_ones, new_ones);
}

TEST(Monitor, GivesLinesWithoutATerminalAndSamplesAsJson) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0"});
  const std::string drive = " --seconds 0.6 --rate-hz 20 --drive " + twin.name();
  const std::string out = shell.must("flexspline monitor" + drive);
  EXPECT_TRUE(contains(out, "time_s,mode,fault,velocity [rad/s]")) << out;
  const json answer = shell.json("flexspline monitor --channels current,motor_fraction" + drive);
  EXPECT_GE(answer["samples"].size(), 8U);
  EXPECT_EQ(answer["frames_lost"], 0);
  EXPECT_EQ(answer["channels"][0]["unit"], "A");
  for (const json& s : answer["samples"]) EXPECT_EQ(s["values"].size(), 2U);
  const Answer wrong = shell.run("flexspline monitor --channels curent" + drive);
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(contains(wrong.err, "did you mean current?")) << wrong.err;
}

TEST(Monitor, SaysWhyAThreePhaseStageSwitchedItselfOff) {
  const Shell shell;
  const TwinProcess twin(
      {"--serve", "0", "--fast", "--motor", "three-phase", "--inject", "driver-fault", "--inject-at", "0.2"});
  const std::string monitor = "flexspline monitor --seconds 0.3 --drive " + twin.name();
  EXPECT_TRUE(shell.json(monitor)["fault_reason"].is_null()) << "nothing has happened yet";
  shell.write("plan.toml",
              "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[limits]\nvelocity_rad_s = 150\n[[run]]\n"
              "name = \"sine\"\nmode = \"velocity\"\nwaveform = \"sine\"\namplitude = 20\nfrequency_hz = 1\n"
              "duration_s = 2\n");
  EXPECT_NE(shell.run("flexspline record --plan plan.toml --out recorded --drive " + twin.name()).code, 0);
  const json seen = shell.json(monitor);
  ASSERT_FALSE(seen["samples"].empty());
  EXPECT_EQ(seen["samples"].back()["fault"], "amplifier_fault");
  const std::string reason = shell.json("flexspline drives --also " + twin.name())["drives"].back()["fault_reason"];
  EXPECT_TRUE(contains(reason, "driver")) << reason;
  EXPECT_EQ(seen["fault_reason"], reason);
  EXPECT_TRUE(contains(shell.run(monitor).err, reason));
}

TEST(Record, WhatWasRecordedIdentifiesTheDrive) {
  const Shell shell;
  shell.write("plan.toml",
              plan_of(run_of("triangle", kTriangle) + run_of("sine", kSine) + run_of("multi sine", kMultiSine)));
  shell.must("flexspline-hil record --out truth --seed 3");
  const TwinProcess twin({"--serve", "0", "--fast", "--serial", "SN-1"});
  const json answer = shell.json("flexspline record --plan plan.toml --out recorded --drive " + twin.name());
  ASSERT_EQ(answer["runs"].size(), 3U);
  for (const json& run : answer["runs"]) {
    EXPECT_TRUE(run["complete"].get<bool>());
    EXPECT_EQ(run["frames_lost"], 0);
  }
  const std::string csv = shell.file("recorded/sine.csv");
  EXPECT_TRUE(contains(csv, "# drive_serial: SN-1\n"));
  EXPECT_TRUE(contains(csv, "# block_sha256: " + sha_of(shell, twin)));
  const json found = shell.json("flexspline identify recorded --model truth/base-model.toml");
  const auto value = [&](const std::string& id, const std::string& parameter) {
    for (const json& p : found["parameters"])
      if (p["id"] == id && p["parameter"] == parameter) return p["value"].get<double>();
    ADD_FAILURE() << id;
    return std::nan("");
  };
  // What the demo's plant file says of its drive. The noise of a recording depends on when the host asks for it: the
  // bounds are five standard errors or more.
  EXPECT_NEAR(value("inertia", "inertia"), 1.04e-4, 0.022e-4);
  EXPECT_NEAR(value("viscous_friction", "coefficient"), 3.6e-4, 0.1e-4);
  EXPECT_NEAR(value("coulomb_friction", "torque"), 0.045, 0.001);
}

TEST(Record, ForceDoesNotHideOtherRecordingsOfTheFolder) {
  const Shell shell;
  shell.write("two.toml", plan_of(run_of("a", kSine) + run_of("b", kSine)));
  shell.write("kept/dataset.toml",
              "format = \"flexspline-dataset/1\"\n[[experiment]]\nfile = \"a.csv\"\n[[experiment]]\n"
              "file = \"b.csv\"\n");
  shell.write("plain/mine.csv", "time_s,current_a\n0,0\n");
  const auto refusal = [&](const std::string& arguments) {
    const Answer answer = shell.run("flexspline record --force --plan two.toml --drive tcp:127.0.0.1:1 " + arguments);
    EXPECT_EQ(answer.code, 2);
    return answer.err;
  };
  EXPECT_TRUE(contains(refusal("--runs a --out kept"), "kept: has the measurement b.csv"));
  EXPECT_TRUE(contains(refusal("--out plain"), "plain: has the measurement mine.csv"));
  // All of them again: only the drive is missing.
  EXPECT_FALSE(contains(refusal("--out kept"), "has the measurement"));
}

TEST(Record, OverASerialLineIsTheSame) {
  const Shell shell;
  shell.write("plan.toml", plan_of(run_of("short",
                                          "mode = \"current\"\nwaveform = \"sine\"\namplitude = 1\n"
                                          "frequency_hz = 2\nduration_s = 1")));
  const TwinProcess twin({"--pty", "--fast"});
  ASSERT_TRUE(twin.name().starts_with("serial:/dev/pts/")) << twin.name();
  const json answer = shell.json("flexspline record --plan plan.toml --out recorded --drive " + twin.name());
  EXPECT_TRUE(answer["runs"][0]["complete"].get<bool>());
  EXPECT_GE(answer["runs"][0]["samples"].get<int>(), 1000);
  // The line stays when a host leaves it.
  sha_of(shell, twin);
}

TEST(Record, StopsAtALimitOfThePlanAndAtAFaultAndSaysSo) {
  const Shell shell;
  const std::string limits = "current_a = 2\nvelocity_rad_s = 120\n";
  shell.write("plan.toml", plan_of(run_of("triangle", kTriangle) + run_of("sine", kSine), limits));
  {
    const TwinProcess twin({"--serve", "0", "--fast", "--inject", "current-surge", "--inject-at", "1"});
    const Answer answer = shell.run("flexspline record --plan plan.toml --out one --drive " + twin.name());
    EXPECT_EQ(answer.code, 1);
    EXPECT_TRUE(contains(answer.err, "above the plan's limit of 2 A") || contains(answer.err, "overcurrent"))
        << answer.err;
  }
  const TwinProcess twin({"--serve", "0", "--fast", "--inject", "motor-encoder-stale", "--inject-at", "5"});
  const json answer =
      json::parse(shell.run("flexspline record --plan plan.toml --out two --json - --drive " + twin.name()).out);
  EXPECT_TRUE(contains(answer["ended"].get<std::string>(), "motor_encoder_stale"));
  EXPECT_TRUE(answer["runs"][0]["complete"].get<bool>());
  EXPECT_FALSE(shell.file("two/triangle.csv").empty()) << "what was finished is kept";
  EXPECT_TRUE(shell.file("two/sine.csv").empty());
  const Answer again = shell.run("flexspline record --plan plan.toml --out three --drive " + twin.name());
  EXPECT_EQ(again.code, 2);
  EXPECT_TRUE(contains(again.err, "is in the fault state")) << again.err;
  const json seen = shell.json("flexspline drives --also " + twin.name())["drives"][0];
  EXPECT_EQ(seen["mode"], "fault");
  EXPECT_EQ(seen["fault"], "motor_encoder_stale");
  EXPECT_TRUE(contains(seen["fault_reason"].get<std::string>(), "encoder"));
}

TEST(Record, RefusesAPlanThatTheDriveCannotRunBeforeAnythingMoves) {
  const Shell shell;
  shell.write("fast.toml", plan_of(run_of("triangle", kTriangle), "velocity_rad_s = 50\n"));
  shell.write("locked.toml", plan_of(run_of("l", kSine + "\nload = \"locked\"")));
  shell.write("rate.toml", plan_of(run_of("r", kSine), "", 0.00037));
  shell.write("empty.toml", plan_of(""));
  const TwinProcess twin({"--serve", "0", "--fast"});
  for (const auto& [plan, expected] :
       std::vector<std::pair<std::string, std::string>>{{"fast", "beyond the plan's limit"},
                                                        {"locked", "needs a person"},
                                                        {"rate", "no whole number of its ticks"},
                                                        {"empty", "nothing to record"},
                                                        {"missing", "cannot be read"}}) {
    const Answer answer = shell.run("flexspline record --plan " + plan + ".toml --out out --drive " + twin.name());
    EXPECT_EQ(answer.code, 2) << plan;
    EXPECT_TRUE(contains(answer.err, expected)) << plan << ": " << answer.err;
  }
}

TEST(Record, CtrlCBringsTheDriveToRest) {
  const Shell shell;
  shell.write("plan.toml", plan_of(run_of("triangle", kTriangle)));
  const TwinProcess twin({"--serve", "0"});
  const Answer answer = shell.run("flexspline record --plan plan.toml --out out --drive " + twin.name() +
                                  " & tool=$!; sleep 1; kill -TERM $tool; wait $tool");
  EXPECT_EQ(answer.code, 1);
  EXPECT_TRUE(contains(answer.err, "interrupted; the drive is at rest")) << answer.err;
  const json now = shell.json("flexspline drives --also " + twin.name());
  EXPECT_EQ(now["drives"].back()["mode"], "idle") << "stopped by its host, not by a fault";
}

TEST(Record, ATwinThatIsKilledInTheMiddleIsAClearError) {
  const Shell shell;
  shell.write("plan.toml", plan_of(run_of("triangle", kTriangle)));
  TwinProcess twin({"--serve", "0"});
  const Answer answer = shell.run("(sleep 1; kill -9 " + std::to_string(twin.pid()) +
                                  ") & flexspline record --plan plan.toml --out out --drive " + twin.name());
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "the drive is gone")) << answer.err;
  EXPECT_TRUE(contains(answer.err, "0 of 1 runs are in out")) << answer.err;
}

// With the drive off nothing stops for want of a host, so the host may sleep.
TEST(Record, FramesThatASlowHostMissesAreCountedAndNamedInTheFile) {
  const Shell shell;
  shell.write("plan.toml", plan_of(run_of("off", "mode = \"off\"\nduration_s = 4"), "", 0.00005));
  const TwinProcess twin({"--serve", "0"});
  const Answer answer =
      shell.run("flexspline record --plan plan.toml --out out --json answer.json --drive " + twin.name() +
                " & tool=$!; sleep 0.7; kill -STOP $tool; sleep 2; kill -CONT $tool; wait $tool");
  ASSERT_EQ(answer.code, 0) << answer.err;
  const json run = json::parse(shell.file("answer.json"))["runs"][0];
  EXPECT_GT(run["frames_lost"].get<int>(), 1000);
  EXPECT_EQ(run["frames_lost"], run["frames_dropped_by_drive"]) << "TCP loses nothing, so the drive dropped them";
  EXPECT_TRUE(contains(answer.err, "frames were lost")) << answer.err;
  const std::string csv = shell.file("out/off.csv");
  EXPECT_TRUE(contains(csv, "# frames_lost: " + std::to_string(run["frames_lost"].get<int>()) + "\n"));
  EXPECT_TRUE(contains(csv, "# gap_at_"));
  EXPECT_TRUE(contains(shell.run("flexspline check out").out, "gap")) << "the gap is found in the data as well";
}

}  // namespace
}  // namespace flexspline::cli_test::drive_commands_test
