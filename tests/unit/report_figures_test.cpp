// The report's figures as `flexspline-hil report` draws them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "hil/plant/excitation.hpp"
#include "hil/thesis_figures/figures.hpp"
#include "hil/thesis_figures/twin_runs.hpp"

namespace flexspline::thesis_figures::report_figures_test {
namespace {

constexpr std::uint64_t kSeed = 7001;

const Figure& figure(int number) {
  for (const Figure& f : figures())
    if (f.number == number) return f;
  throw std::invalid_argument("no such figure");
}

TEST(Figures, AllSixtyAreListedOnceAndEachIsMadeOrSaysWhyNot) {
  std::set<int> numbers;
  for (const Figure& f : figures()) {
    EXPECT_TRUE(numbers.insert(f.number).second) << f.number;
    EXPECT_NE(f.make == nullptr, f.why_not.empty()) << f.number;
  }
  EXPECT_EQ(numbers.size(), 60u);
  EXPECT_EQ(*numbers.begin(), 1);
  EXPECT_EQ(*numbers.rbegin(), 60);
}

TEST(Figures, TheCompositeIsEquation60) {
  const auto y = [](double t) { return std::cos(t) + 0.5 * std::sin(2.0 * t) + std::sin(3.0 * t); };
  const double scale = plant::waveform(plant::Waveform::composite, 0.0) / y(0.0);
  for (const double phase : {0.1, 0.37, 0.8})
    EXPECT_NEAR(plant::waveform(plant::Waveform::composite, phase), scale * y(2.0 * M_PI * phase), 1e-9) << phase;
}

// Figures 9 to 11: the threshold of 1e-8 changes sign at each shortest step, that of 1e-4 and the layer never do.
TEST(Figures, OnlyTheSmallThresholdChatters) {
  const auto changes = [](int number) {
    const Drawn drawn = figure(number).make(kSeed);
    const std::vector<double>& v = drawn.panels.at(1).curves.at(0).y;
    int count = 0;
    for (std::size_t k = 1; k < v.size(); ++k) count += v[k] * v[k - 1] < 0.0;
    return count;
  };
  EXPECT_GT(changes(9), 8000);
  EXPECT_EQ(changes(10), 0);
  EXPECT_EQ(changes(11), 0);
}

// Figure 45, and 46: with the twin's own averages the report's blocks follow it, without a friction they do not.
TEST(Figures, TheReportsBlocksFollowTheTwinAndWithoutAFrictionTheyDoNot) {
  const plant::Record record = twin_record(free_sine(65.0, 1.0), kSeed);
  const report::DriveSystemParts full = nominal_parts();
  report::DriveSystemParts without = full;
  without.motor.friction.positive.viscous = without.motor.friction.negative.viscous = 0.0;
  const auto velocity = zero_phase(record.motor_velocity_rad_s, kCutoffHz, kHz);
  const auto error = [&](const report::DriveSystemParts& parts) {
    return error_percent(velocity, zero_phase(input_velocity(simulate(parts, record)), kCutoffHz, kHz));
  };
  EXPECT_LT(error(full), 1.0);
  EXPECT_GT(error(without), 30.0);
}

TEST(Figures, TheFilterForwardAndBackwardHalvesASineAtItsCutOffWithoutAShift) {
  std::vector<double> y(8000), slow(8000);
  for (std::size_t k = 0; k < y.size(); ++k) {
    y[k] = std::sin(2.0 * M_PI * 20.0 * 1e-3 * static_cast<double>(k));
    slow[k] = std::sin(2.0 * M_PI * 2.0 * 1e-3 * static_cast<double>(k));
  }
  const auto filtered = zero_phase(y, 20.0, 1000.0), same = zero_phase(slow, 20.0, 1000.0);
  for (std::size_t k = 3000; k < 5000; ++k) {
    EXPECT_NEAR(filtered[k], 0.5 * y[k], 1e-3);
    EXPECT_NEAR(same[k], slow[k], 1e-3);
  }
}

TEST(FigureFiles, ASvgHasEachCurveAndEscapesItsTexts) {
  const std::vector<Panel> panels{
      {"a < b",
       "time, s",
       "y",
       {{"one", {0.0, 1.0}, {0.0, 2.0}, Stroke::solid}, {"two", {0.0, 1.0}, {1.0, std::nan("")}, Stroke::dotted}}}};
  const std::string text = svg("t", panels);
  std::size_t lines = 0;
  for (std::size_t at = text.find("<polyline"); at != std::string::npos; at = text.find("<polyline", at + 1)) ++lines;
  EXPECT_EQ(lines, 2u);
  EXPECT_NE(text.find("a &lt; b"), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_NE(csv(panels).find("\"a < b\",\"one\",1,2"), std::string::npos);
  EXPECT_THROW(svg("t", {{"empty", "", "", {}}}), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::thesis_figures::report_figures_test
