// flexspline derivatives: ways to velocity and acceleration, compared on data whose derivatives are known.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::derivatives_test {
namespace {

constexpr double kStep = 2.0 * M_PI / 4000.0, kRate = 4.0 * M_PI, kAmplitude = 5.0;

// A sine of 2 Hz through an encoder of 4000 steps; with a tachometer that is exact.
std::string sine_csv(bool with_tachometer) {
  std::string text = "# load: free\n# current_hold: none\ntime_s,motor_torque_nm,motor_position_rad";
  text += with_tachometer ? ",motor_velocity_rad_s\n" : "\n";
  for (int k = 0; k < 10000; ++k) {
    const double t = 1e-3 * k;
    char line[120];
    std::snprintf(line, sizeof line, "%.3f,%.9f,%.9f", t, -0.1 * std::sin(kRate * t),
                  kStep * std::round(kAmplitude * std::sin(kRate * t) / kStep));
    text += line;
    if (with_tachometer) {
      std::snprintf(line, sizeof line, ",%.9f", kAmplitude * kRate * std::cos(kRate * t));
      text += line;
    }
    text += "\n";
  }
  return text;
}

const nlohmann::json& method(const nlohmann::json& comparison, const std::string& name) {
  for (const nlohmann::json& m : comparison["methods"])
    if (m["method"] == name) return m;
  throw std::runtime_error("no method " + name);
}

TEST(Derivatives, ShowsNoiseLagAndDifferenceOfEachMethodAgainstTheMeasuredVelocity) {
  const Shell shell;
  shell.write("run.csv", sine_csv(true));
  const nlohmann::json found = shell.json("flexspline derivatives run.csv --cutoff-hz 40");
  EXPECT_EQ(found["format"], "flexspline-derivatives/1");
  ASSERT_EQ(found["comparisons"].size(), 1u);
  const nlohmann::json& c = found["comparisons"][0];
  EXPECT_EQ(c["reference"], "motor_velocity_rad_s");
  EXPECT_EQ(c["column"], "motor_position_rad");
  EXPECT_EQ(c["methods"].size(), 17u) << "those of section 1.3.4 and the Kalman smoother";
  EXPECT_NEAR(c["velocity_rms"].get<double>(), kAmplitude * kRate / std::sqrt(2.0), 0.3);
  EXPECT_NEAR(c["position_noise"].get<double>(), kStep / std::sqrt(12.0), 0.1 * kStep);

  const nlohmann::json &smoother = method(c, "kalman-rts"), &filter = method(c, "butterworth-zero-phase"),
                       &h2 = method(c, "h2-bilinear"), &backward = method(c, "backward");
  // Delays by theory: none, none, 2 / w0, half a sample.
  EXPECT_NEAR(smoother["lag_s"].get<double>(), 0.0, 2e-5);
  EXPECT_NEAR(filter["lag_s"].get<double>(), 0.0, 2e-5);
  EXPECT_NEAR(h2["lag_s"].get<double>(), 2.0 / (2.0 * M_PI * 40.0), 5e-4);
  EXPECT_NEAR(backward["lag_s"].get<double>(), 0.5e-3, 5e-5);
  // The noise of a backward difference is sqrt(2) that of the position over the sample time.
  EXPECT_NEAR(backward["velocity_noise"].get<double>(), std::sqrt(2.0) * c["position_noise"].get<double>() / 1e-3,
              1e-3);
  EXPECT_LT(smoother["velocity_difference"].get<double>(), 0.1 * backward["velocity_difference"].get<double>());
  EXPECT_LT(smoother["acceleration_difference"].get<double>(),
            0.02 * backward["acceleration_difference"].get<double>());
  // Without a filter the bilinear rule keeps all noise for ever.
  EXPECT_TRUE(method(c, "bilinear")["velocity_noise"].is_null());
}

TEST(Derivatives, WithoutATachometerTheSmootherIsTheReferenceAndAPictureIsDrawn) {
  const Shell shell;
  shell.write("run.csv", sine_csv(false));
  const nlohmann::json c =
      shell.json("flexspline derivatives run.csv --side motor --picture d.svg --from-s 3 --to-s 4")["comparisons"][0];
  EXPECT_EQ(c["reference"], "kalman-rts");
  EXPECT_EQ(method(c, "kalman-rts")["velocity_difference"], 0.0);
  const std::string svg = shell.file("d.svg");
  EXPECT_EQ(svg.find("<svg"), 0u);
  EXPECT_NE(svg.find("kalman-rts"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  const Answer nothing = shell.run("flexspline derivatives run.csv --side output");
  EXPECT_EQ(nothing.code, 2);
  EXPECT_NE(nothing.err.find("output_position_rad"), std::string::npos) << nothing.err;
  EXPECT_EQ(shell.run("flexspline derivatives run.csv --picture d.svg --from-s 30").code, 2);
  EXPECT_EQ(shell.run("flexspline derivatives run.csv --cutoff-hz 600").code, 2);
  const Answer negative = shell.run("flexspline derivatives run.csv --cutoff-hz -3");
  EXPECT_EQ(negative.code, 2);
  EXPECT_NE(negative.err.find("--cutoff-hz: \"-3\" is not a number above zero"), std::string::npos) << negative.err;
}

// The same parameters by both ways, on data that have them.
TEST(Derivatives, KalmanAsAnOptionOfThePipelineFindsTheSameParameters) {
  const Shell shell;
  shell.must("flexspline-hil record --out drive --hide viscous_asymmetry --seed 5");
  const std::string identify =
      "flexspline identify drive/free-sine-1hz.csv drive/free-sine-2hz-warm.csv drive/free-slow-warm.csv "
      "drive/locked-sine-0.5hz.csv drive/rest.csv --model drive/base-model.toml";
  const nlohmann::json filtered = shell.json(identify);
  const std::string said = shell.must(identify + " --derivatives kalman --json smoothed.json");
  const nlohmann::json smoothed = nlohmann::json::parse(shell.file("smoothed.json"));
  EXPECT_EQ(filtered["derivatives"], "butterworth");
  EXPECT_EQ(smoothed["derivatives"], "kalman");
  ASSERT_EQ(filtered["parameters"].size(), smoothed["parameters"].size());
  for (std::size_t k = 0; k < filtered["parameters"].size(); ++k) {
    const nlohmann::json &a = filtered["parameters"][k], &b = smoothed["parameters"][k];
    if (a["std"].is_null() || b["std"].is_null()) continue;
    const double apart = std::abs(a["value"].get<double>() - b["value"].get<double>());
    EXPECT_LT(apart, 3.0 * std::hypot(a["std"].get<double>(), b["std"].get<double>())) << a["id"] << a["parameter"];
    EXPECT_NE(a["value"], b["value"]) << a["id"];
  }
  EXPECT_NE(said.find("Rauch-Tung-Striebel"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::cli_test::derivatives_test
