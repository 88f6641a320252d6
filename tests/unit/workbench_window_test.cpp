// host/app/workbench: signals within a window of time. No peak is lost, whatever the zoom.
#include "host/app/workbench/window.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "host/app/workbench/history.hpp"

namespace flexspline::workbench::workbench_window_test {
namespace {

// As the page reads a packed signal.
std::vector<double> unpacked(const nlohmann::json& packed) {
  static const std::string kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned> bytes;
  unsigned word = 0, bits = 0;
  for (const char c : packed["codes"].get<std::string>()) {
    if (c == '=') break;
    word = word << 6U | static_cast<unsigned>(kLetters.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(word >> bits & 255U);
  }
  std::vector<double> values;
  for (std::size_t k = 0; k + 1 < bytes.size(); k += 2) {
    const unsigned code = bytes[k] | bytes[k + 1] << 8U;
    values.push_back(code == 65535U ? NAN : packed["offset"].get<double>() + packed["scale"].get<double>() * code);
  }
  EXPECT_EQ(values.size(), packed["count"].get<std::size_t>());
  return values;
}

struct Signal {
  std::vector<double> time, value;
  std::vector<data::Segment> segments;
  explicit Signal(std::size_t samples) : segments{{0, samples}} {
    std::mt19937_64 chance(7);
    std::normal_distribution<double> noise(0.0, 0.1);
    for (std::size_t k = 0; k < samples; ++k) {
      time.push_back(static_cast<double>(k) * 1e-3);
      value.push_back(noise(chance));
    }
  }
};

TEST(WorkbenchWindow, KeepsASinglePeakOfAMillionSamples) {
  Signal s(1'000'000);
  s.value[123'457] = 5.0;
  s.value[765'431] = -4.0;
  const auto answer = window(s.segments, s.time, 0.0, 1000.0, 2000, {{"measured", s.value}});
  const std::vector<double> drawn = unpacked(answer["measured"]);
  EXPECT_LE(drawn.size(), 2002u);
  EXPECT_FALSE(answer["whole"].get<bool>());
  EXPECT_NEAR(*std::max_element(drawn.begin(), drawn.end()), 5.0, 1e-3);
  EXPECT_NEAR(*std::min_element(drawn.begin(), drawn.end()), -4.0, 1e-3);
  // Where they are.
  const std::vector<double> time = unpacked(answer["time"]);
  const auto at = std::max_element(drawn.begin(), drawn.end()) - drawn.begin();
  EXPECT_NEAR(time[static_cast<std::size_t>(at)], 123.457, 1.1);
}

TEST(WorkbenchWindow, KeepsTheExtremesOfEveryBucket) {
  const Signal s(40'000);
  for (const std::size_t points : {64u, 500u, 3000u}) {
    const auto answer = window(s.segments, s.time, 0.0, 40.0, points, {{"measured", s.value}});
    const std::vector<double> drawn = unpacked(answer["measured"]), time = unpacked(answer["time"]);
    ASSERT_EQ(drawn.size(), time.size());
    ASSERT_TRUE(std::is_sorted(time.begin(), time.end()));
    // Each pair of points stands for a bucket: nothing in it lies outside of them.
    for (std::size_t k = 0; k + 1 < drawn.size(); k += 2) {
      const auto first = static_cast<std::size_t>(std::lround(time[k] * 1e3));
      const auto last = static_cast<std::size_t>(std::lround(time[k + 1] * 1e3));
      const auto [low, high] = std::minmax_element(s.value.begin() + static_cast<std::ptrdiff_t>(first),
                                                   s.value.begin() + static_cast<std::ptrdiff_t>(last) + 1);
      EXPECT_NEAR(std::min(drawn[k], drawn[k + 1]), *low, 1e-4);
      EXPECT_NEAR(std::max(drawn[k], drawn[k + 1]), *high, 1e-4);
    }
  }
}

TEST(WorkbenchWindow, ShowsEverySampleWhereTheyFit) {
  const Signal s(10'000);
  const auto answer = window(s.segments, s.time, 2.0, 2.1, 1000, {{"measured", s.value}});
  const std::vector<double> drawn = unpacked(answer["measured"]);
  EXPECT_TRUE(answer["whole"].get<bool>());
  ASSERT_EQ(drawn.size(), 103u);  // and one beyond each end
  for (std::size_t k = 0; k < drawn.size(); ++k) EXPECT_NEAR(drawn[k], s.value[1999 + k], 1e-4);
}

TEST(WorkbenchWindow, PartsSegmentsAndLeavesOutWhatIsNotValid) {
  Signal s(1000);
  s.segments = {{0, 400}, {600, 1000}};
  std::vector<std::uint8_t> valid(1000, 1);
  valid[10] = 0;
  const auto answer = window(s.segments, s.time, 0.0, 1.0, 5000, {{"residual", s.value, valid}});
  const std::vector<double> drawn = unpacked(answer["residual"]);
  EXPECT_TRUE(std::isnan(drawn[10]));
  // The sample that is not valid, and the gap.
  EXPECT_EQ(std::count_if(drawn.begin(), drawn.end(), [](double v) { return std::isnan(v); }), 2);
  EXPECT_EQ(clipped(s.segments, s.time, 0.45, 0.55).size(), 0u);
  EXPECT_EQ(clipped(s.segments, s.time, 0.3, 0.7).size(), 2u);
  EXPECT_EQ(clipped(s.segments, s.time, 5.0, 6.0).size(), 0u);
}

TEST(WorkbenchWindow, JoinsNeighbouringRowsToIntervals) {
  const std::vector<double> times{0.0, 0.1, 0.2, 1.0, 1.1, 5.0};
  const std::vector<std::pair<double, double>> expected{{0.0, 0.2}, {1.0, 1.1}, {5.0, 5.0}};
  EXPECT_EQ(intervals(times, 0.15), expected);
  EXPECT_TRUE(intervals({}, 0.1).empty());
}

TEST(WorkbenchHistory, TakesStepsBackAndForth) {
  History<int> history(1);
  EXPECT_FALSE(history.undo());
  history.take(2);
  history.take(3);
  EXPECT_FALSE(history.redo());
  EXPECT_TRUE(history.undo());
  EXPECT_EQ(history.current(), 2);
  EXPECT_TRUE(history.redo());
  EXPECT_EQ(history.current(), 3);
  history.go(0);
  EXPECT_EQ(history.current(), 1);
  EXPECT_THROW(history.go(3), std::out_of_range);
  EXPECT_EQ(history.size(), 3u);
}

TEST(WorkbenchHistory, ForgetsTheOtherWayWhereANewStepIsTaken) {
  History<int> history(1);
  history.take(2);
  history.take(3);
  history.go(0);
  history.take(4);
  EXPECT_EQ(history.size(), 2u);
  EXPECT_EQ(history.current(), 4);
  EXPECT_FALSE(history.redo());
  EXPECT_EQ(history[0], 1);
}

}  // namespace
}  // namespace flexspline::workbench::workbench_window_test
