// What the drawn curve of an effect shows, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/output/answers/effect_curve.hpp"

namespace flexspline::output::effect_curve_test {
namespace {

EffectCurve curve_of(const char* name) {
  return effect_curve(catalogue::get(name));
}

double usual(const char* effect, const char* parameter) {
  const catalogue::Entry& entry = catalogue::get(effect);
  return entry.parameters[entry.index_of(parameter)].usual;
}

double largest(const std::vector<double>& values) {
  double size = 0.0;
  for (const double v : values)
    if (std::isfinite(v)) size = std::max(size, std::abs(v));
  return size;
}

TEST(EffectCurve, ViscousFrictionIsALineOverVelocity) {
  const EffectCurve curve = curve_of("viscous_friction");
  EXPECT_EQ(curve.x_label, "motor velocity (rad/s)");
  EXPECT_EQ(curve.y_label, "torque on the motor (N*m)");
  for (std::size_t k = 0; k < curve.x.size(); ++k)
    if (std::isfinite(curve.y[k])) {
      EXPECT_NEAR(curve.y[k], usual("viscous_friction", "coefficient") * curve.x[k], 1e-12);
    }
}

TEST(EffectCurve, CoulombFrictionIsAStepWithAGapAtStandstill) {
  const EffectCurve curve = curve_of("coulomb_friction");
  const double torque = usual("coulomb_friction", "torque");
  std::size_t gaps = 0;
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    if (!std::isfinite(curve.y[k])) {
      ++gaps;
      EXPECT_NEAR(curve.x[k], 0.0, 1e-9);
      continue;
    }
    EXPECT_DOUBLE_EQ(curve.y[k], curve.x[k] > 0.0 ? torque : -torque);
  }
  EXPECT_EQ(gaps, 1u);
}

TEST(EffectCurve, StribeckFrictionIsDrawnWhereItShows) {
  const EffectCurve curve = curve_of("stribeck_gaussian");
  const double velocity = usual("stribeck_gaussian", "velocity");
  EXPECT_NEAR(largest(curve.x), 5.0 * velocity, 1e-9);
  for (std::size_t k = 0; k < curve.x.size(); ++k)
    if (curve.x[k] > 0.0 && std::isfinite(curve.y[k])) {
      const double bell = std::exp(-std::pow(curve.x[k] / velocity, 2));
      EXPECT_NEAR(curve.y[k], usual("stribeck_gaussian", "amplitude_positive") * bell, 1e-12);
    }
}

TEST(EffectCurve, InertiaIsALineOverAcceleration) {
  const EffectCurve curve = curve_of("inertia");
  EXPECT_EQ(curve.x_label, "motor acceleration (rad/s^2)");
  EXPECT_NEAR(curve.y.back(), usual("inertia", "inertia") * curve.x.back(), 1e-12);
}

TEST(EffectCurve, RippleIsAWaveOverOneTurn) {
  const EffectCurve curve = curve_of("torque_ripple");
  EXPECT_EQ(curve.x_label, "motor angle (rad)");
  EXPECT_NEAR(curve.x.back(), 2.0 * M_PI, 1e-12);
  for (std::size_t k = 0; k < curve.x.size(); ++k)
    EXPECT_NEAR(curve.y[k], usual("torque_ripple", "cosine") * std::cos(usual("torque_ripple", "order") * curve.x[k]),
                1e-12);
}

// Torque under the upper branch less that under the lower one: energy that is lost in a cycle.
double area(const EffectCurve& curve) {
  double sum = 0.0;
  for (std::size_t k = 1; k < curve.x.size(); ++k)
    sum += 0.5 * (curve.y[k] + curve.y[k - 1]) * (curve.x[k] - curve.x[k - 1]);
  return sum;
}

TEST(EffectCurve, AHysteresisLoopClosesAndHasAWidth) {
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (!entry.name().ends_with("_hysteresis")) continue;
    const EffectCurve curve = effect_curve(entry);
    EXPECT_EQ(curve.x_label, "torsion (rad)") << entry.name();
    ASSERT_GT(curve.x.size(), 100u);
    const double size = largest(curve.y);
    EXPECT_NEAR(curve.x.front(), curve.x.back(), 1e-9 * largest(curve.x)) << entry.name();
    EXPECT_NEAR(curve.y.front(), curve.y.back(), 1e-3 * size) << entry.name();
    EXPECT_GT(std::abs(area(curve)), 1e-2 * size * largest(curve.x)) << entry.name();
  }
}

TEST(EffectCurve, DahlFrictionReachesItsTorqueAndLosesFourTimesItOverALongStroke) {
  const EffectCurve curve = curve_of("dahl_friction");
  const double torque = usual("dahl_friction", "torque"), presliding = usual("dahl_friction", "presliding");
  EXPECT_EQ(curve.x_label, "motor angle (rad)");
  // Over a stroke of ten presliding angles the state is all but at its end: 1 - 2 exp(-10).
  EXPECT_NEAR(largest(curve.y), torque, 2e-4 * torque);
  // A full cycle at Coulomb level, less what the two reversals save: 2 log 2 presliding angles each, at twice the
  // torque (Dahl's law integrated from -1 to 1).
  const double stroke = 2.0 * largest(curve.x);
  EXPECT_NEAR(area(curve), 2.0 * torque * (stroke - 2.0 * presliding), 0.02 * 2.0 * torque * stroke);
}

TEST(EffectCurve, AShiftIsDrawnByWhatItDoesToALinearStiffness) {
  const EffectCurve backlash = curve_of("backlash");
  const double half = usual("backlash", "half_width"), stiffness = usual("linear_stiffness", "stiffness");
  EXPECT_FALSE(backlash.caption.empty());
  for (std::size_t k = 0; k < backlash.x.size(); ++k) {
    const double beyond = std::max(0.0, std::abs(backlash.x[k]) - half);
    EXPECT_NEAR(backlash.y[k], stiffness * std::copysign(beyond, backlash.x[k]), 1e-9);
  }
  // Over the motor's angle only the change is drawn; the stiffness would hide it.
  const EffectCurve kinematic = curve_of("kinematic_error");
  EXPECT_EQ(kinematic.x_label, "motor angle (rad)");
  EXPECT_NEAR(kinematic.y.front(), stiffness * usual("kinematic_error", "cosine"), 1e-9);
}

TEST(EffectCurve, AModulationIsDrawnByWhatItModulates) {
  const EffectCurve curve = curve_of("temperature_viscous");
  EXPECT_EQ(curve.x_label, "temperature (degC)");
  const double b = usual("temperature_viscous", "coefficient");
  EXPECT_NEAR(curve.y.front() / curve.y.back(), std::exp(b * (curve.x.back() - curve.x.front())), 1e-9);
}

TEST(EffectCurve, EveryEffectOfTheCatalogueHasOne) {
  for (const catalogue::Entry& entry : catalogue::all()) {
    const EffectCurve curve = effect_curve(entry);
    EXPECT_EQ(curve.x.size(), curve.y.size()) << entry.name();
    EXPECT_GT(largest(curve.y), 0.0) << entry.name();
    for (const double x : curve.x) EXPECT_TRUE(std::isfinite(x)) << entry.name();
    EXPECT_FALSE(curve_text(curve, true).empty()) << entry.name();
    const nlohmann::json json = curve_json(curve);
    EXPECT_EQ(json["x"].size(), json["y"].size());
    EXPECT_EQ(json["x_label"], curve.x_label);
  }
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return lines;
}

TEST(CurveText, DrawsARisingLineFromLowerLeftToUpperRight) {
  const EffectCurve line{{0.0, 1.0}, {-1.0, 1.0}, "x", "y", ""};
  const std::vector<std::string> lines = lines_of(curve_text(line, false, 20, 5));
  ASSERT_EQ(lines.size(), 1u + 5u + 2u);
  // The head, five rows, the axis and its labels.
  EXPECT_EQ(lines[0], "  y");
  std::size_t before = 0;
  for (std::size_t r = 5; r >= 1; --r) {
    const std::size_t first = lines[r].find_first_of(".':", lines[r].find('|'));
    ASSERT_NE(first, std::string::npos) << lines[r];
    EXPECT_GT(first, before);
    before = first;
  }
  EXPECT_TRUE(lines[1].starts_with("   1 |")) << lines[1];
  EXPECT_TRUE(lines[3].starts_with("   0 |")) << lines[3];
  EXPECT_TRUE(lines[5].starts_with("  -1 |")) << lines[5];
}

TEST(CurveText, IsPlainAsciiWhereThatIsAsked) {
  for (const catalogue::Entry& entry : catalogue::all())
    for (const char c : curve_text(effect_curve(entry), false)) EXPECT_LT(static_cast<unsigned char>(c), 0x80U);
}

TEST(CurveText, BrailleCellsAreOfTheirBlock) {
  const std::string text = curve_text(curve_of("coulomb_friction"), true);
  std::size_t cells = 0;
  for (std::size_t k = 0; k + 2 < text.size(); ++k)
    if (static_cast<unsigned char>(text[k]) == 0xE2U) {
      const auto second = static_cast<unsigned char>(text[k + 1]);
      cells += second >= 0xA0U && second <= 0xA3U ? 1 : 0;  // U+2800 to U+28FF
    }
  EXPECT_EQ(cells, 60u);  // half a line above, half a line below
}

}  // namespace
}  // namespace flexspline::output::effect_curve_test
