// flexspline measure: what it says of a made-up drive, and of data that cannot tell.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdio>
#include <random>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::measure_test {
namespace {

// Odd multisine, 0.5 to 40.5 Hz, through an inertia on a spring (12.4 Hz, damping ratio 0.06) and a torque sensor whose
// reading has a cube; as a logger writes it.
std::string multisine_csv(int periods, bool with_set_point, double cubic, unsigned seed) {
  using namespace std::complex_literals;
  constexpr double kTwoPi = 2.0 * M_PI, kPeriod = 2.0, kSample = 1e-3;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> phase(0.0, kTwoPi);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<std::pair<int, double>> lines;
  for (int k = 1; k <= 81; k += 2)
    if (k % 8 != 3) lines.emplace_back(k, phase(random));
  std::string text = "# load: locked\n# current_hold: none\ntime_s,current_a,motor_position_rad,torque_nm";
  text += with_set_point ? ",current_command_a\n" : "\n";
  const int period = static_cast<int>(kPeriod / kSample);
  for (int n = 0; n < periods * period; ++n) {
    const double t = kSample * (n % period);
    double current = 0.0, position = 0.0;
    for (const auto& [k, angle] : lines) {
      const double w = kTwoPi * k / kPeriod, w0 = kTwoPi * 12.4;
      const std::complex<double> amplitude = std::polar(0.1, angle + w * t);
      current += amplitude.real();
      position += (amplitude * 500.0 / (w0 * w0 - w * w + 2.0i * 0.06 * w0 * w)).real();
    }
    const double torque = 20.0 * (position + cubic * position * position * position) + 0.01 * noise(random);
    char line[200];
    std::snprintf(line, sizeof line, "%.3f,%.7f,%.8f,%.6f", kSample * n, current, position, torque);
    text += line;
    if (with_set_point) {
      std::snprintf(line, sizeof line, ",%.9f", current);
      text += line;
    }
    text += "\n";
  }
  return text;
}

TEST(Measure, FindsResponseResonanceNoiseAndDistortion) {
  const Shell shell;
  shell.write("run.csv", multisine_csv(6, true, 0.5, 1));
  const nlohmann::json found = shell.json("flexspline measure run.csv");
  EXPECT_EQ(found["format"], "flexspline-measure/1");
  expect_fields(found, {"pooled", "experiments", "notes"});
  const nlohmann::json& e = found["experiments"][0];
  expect_fields(e, {"name", "load", "period", "why_no_period", "responses", "noise", "distortion"});
  EXPECT_NEAR(e["period"]["period_s"].get<double>(), 2.0, 1e-9);
  EXPECT_EQ(e["period"]["periods"], 5);
  EXPECT_EQ(e["period"]["found_in"], "current_command_a");

  const nlohmann::json& velocity = found["pooled"][0];
  expect_fields(velocity, {"input", "output", "unit", "load", "average", "resolution_hz", "records", "excited_lines",
                           "trusted_lines", "trusted_from_hz", "trusted_to_hz", "lines", "resonances",
                           "unexplained_extrema", "why_no_resonance"});
  EXPECT_EQ(velocity["output"], "motor_velocity_rad_s");
  EXPECT_EQ(velocity["average"], "periods");
  EXPECT_NEAR(velocity["trusted_to_hz"].get<double>(), 40.5, 1e-6);
  for (const nlohmann::json& line : velocity["lines"])
    expect_fields(line, {"frequency_hz", "amplitude", "phase_deg", "coherence", "band_percent", "trusted"});
  ASSERT_EQ(velocity["resonances"].size(), 1u);
  const nlohmann::json& resonance = velocity["resonances"][0];
  EXPECT_EQ(resonance["kind"], "resonance");
  EXPECT_NEAR(resonance["frequency_hz"].get<double>(), 12.4, 0.124);
  EXPECT_NEAR(resonance["damping"].get<double>(), 0.06, 0.006);

  bool has_torque = false;
  for (const nlohmann::json& n : e["noise"]) {
    expect_fields(n, {"signal", "unit", "noise_rms", "signal_rms", "noise_from", "bands"});
    if (n["signal"] != "torque_nm") continue;
    has_torque = true;
    EXPECT_NEAR(n["noise_rms"].get<double>(), 0.01, 0.001);
  }
  EXPECT_TRUE(has_torque);
  for (const nlohmann::json& d : e["distortion"]) {
    EXPECT_EQ(d["excitation"], "odd_multisine");
    EXPECT_EQ(d["odd"]["significant"], d["output"] == "torque_nm") << d;
    EXPECT_EQ(d["even"]["significant"], false) << d;
  }
}

TEST(Measure, SaysItToPeople) {
  const Shell shell;
  shell.write("run.csv", multisine_csv(6, true, 0.5, 1));
  const std::string text = shell.must("flexspline measure run.csv");
  EXPECT_TRUE(contains(text, "Resonance at 12.4")) << text;
  EXPECT_TRUE(contains(text, "trusted")) << text;
  EXPECT_TRUE(contains(text, "Odd nonlinear distortion at -")) << text;
  EXPECT_FALSE(contains(text, "Even nonlinear distortion")) << text;
}

TEST(Measure, NeedsNoSetPointAndTakesAPeriodThatIsStated) {
  const Shell shell;
  shell.write("run.csv", multisine_csv(4, false, 0.0, 2));
  const nlohmann::json found = shell.json("flexspline measure run.csv");
  EXPECT_NEAR(found["experiments"][0]["period"]["period_s"].get<double>(), 2.0, 1e-9);
  EXPECT_NEAR(found["pooled"][0]["resonances"][0]["frequency_hz"].get<double>(), 12.4, 0.124);
  const nlohmann::json stated = shell.json("flexspline measure run.csv --period-s 4");
  EXPECT_EQ(stated["experiments"][0]["period"]["found_in"], "stated");
  EXPECT_EQ(stated["experiments"][0]["period"]["periods"], 2);
  EXPECT_EQ(shell.run("flexspline measure run.csv --period-s -1").code, 2);
}

TEST(Measure, OfUnsuitableDataSaysWhatToRecord) {
  const Shell shell;
  std::string ramp = "time_s,current_a,motor_position_rad\n";
  for (int k = 0; k < 4000; ++k) {
    char line[100];
    std::snprintf(line, sizeof line, "%.3f,%.5f,%.6f\n", 1e-3 * k, 0.1 + 5e-5 * k, 2e-6 * k * k);
    ramp += line;
  }
  shell.write("ramp.csv", ramp);
  const std::string text = shell.must("flexspline measure ramp.csv");
  EXPECT_TRUE(contains(text, "What these data do not show")) << text;
  EXPECT_TRUE(contains(text, "multisine")) << text;
  EXPECT_TRUE(contains(text, "repeat one period")) << text;
  EXPECT_EQ(shell.json("flexspline measure ramp.csv")["notes"].size(), 2u);
}

TEST(Measure, OfTheTwinsRecordingsKnowsTheNoiseOfItsSensors) {
  const Shell shell;
  shell.record();
  const nlohmann::json found = shell.json("flexspline measure demo-out");
  ASSERT_EQ(found["experiments"].size(), 16u);
  std::size_t periodic = 0, standing = 0;
  for (const nlohmann::json& e : found["experiments"])
    for (const nlohmann::json& n : e["noise"]) {
      // Half a percent of the record's peak, and at least a milliampere: see hil/plant/demo-drive.toml.
      if (n["signal"] != "current_a") continue;
      ++(n["noise_from"] == "periods" ? periodic : standing);
      EXPECT_GT(n["noise_rms"].get<double>(), 0.9e-3);
      EXPECT_LT(n["noise_rms"].get<double>(), 0.03);
    }
  EXPECT_GE(periodic, 10u);
  EXPECT_EQ(standing, 1u);
}

TEST(Measure, RefusesBadInputAsTheOthersDo) {
  const Shell shell;
  const auto refused = [&](const std::string& line, std::initializer_list<const char*> parts) {
    const Answer answer = shell.run(line);
    EXPECT_EQ(answer.code, 2) << line;
    EXPECT_TRUE(answer.out.empty()) << answer.out;
    for (const char* part : parts) EXPECT_TRUE(contains(answer.err, part)) << answer.err;
  };
  refused("flexspline measure nowhere.csv", {"flexspline measure: ", "nowhere.csv", "no such file"});
  shell.write("empty.csv", "");
  refused("flexspline measure empty.csv", {"empty.csv", "; "});
  shell.write("data/data.csv", multisine_csv(2, false, 0.0, 3));
  shell.write("data/dataset.toml",
              "format = \"flexspline-dataset/1\"\n[columns.current_a]\nsource = \"current_a\"\nunit = \"furlong\"\n");
  refused("flexspline measure data", {"dataset.toml:2", "furlong", "mA"});
  refused("flexspline measure", {"DATA"});
}

}  // namespace
}  // namespace flexspline::cli_test::measure_test
