// Black boxes as a user writes them, and orders chosen on data left out.
#include "host/engine/blackbox/specification.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace flexspline::blackbox::blackbox_specification_test {
namespace {

std::string refusal_of(const std::string& text) {
  try {
    parse_specification(text);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

// Noise enters the equation, as ARX supposes.
Record second_order(std::size_t n, std::uint64_t seed, double noise, int nk = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  constexpr std::size_t kBefore = 50;  // until the start is forgotten
  std::vector<double> u(kBefore + n), y(kBefore + n, 0.0);
  for (double& x : u) x = normal(random);
  for (std::size_t k = 4; k < y.size(); ++k) {
    const std::size_t at = k - static_cast<std::size_t>(nk);
    y[k] = 1.5 * y[k - 1] - 0.7 * y[k - 2] + u[at] + 0.5 * u[at - 1] + noise * normal(random);
  }
  Record r;
  r.experiment = seed;
  r.output.assign(y.begin() + kBefore, y.end());
  r.inputs.emplace_back(u.begin() + kBefore, u.end());
  return r;
}

TEST(BlackBoxSpecification, IsReadAndWrittenBack) {
  EXPECT_EQ(parse_specification("fir:20").orders, (Orders{0, 20, 1, true}));
  EXPECT_EQ(parse_specification("fir:20,3").orders, (Orders{0, 20, 3, true}));
  EXPECT_EQ(parse_specification("arx:4,3,2").orders, (Orders{4, 3, 2, true}));
  EXPECT_EQ(parse_specification("arx:4,3").orders, (Orders{4, 3, 1, true}));
  EXPECT_EQ(parse_specification("arx:auto").family, Family::arx);
  EXPECT_FALSE(parse_specification("fir:auto").orders.has_value());
  for (const char* text : {"fir:20", "fir:20,3", "arx:4,3,2"}) {
    EXPECT_EQ(text_of(*parse_specification(text).orders), text);
    EXPECT_EQ(parse_specification(text).text, text);
  }
}

TEST(BlackBoxSpecification, WhatIsWrongIsQuotedWithWhatIsExpected) {
  for (const char* text : {"", "fir", "fir:", "fir:0", "fir:x", "fir:2.5", "fir:1,2,3", "fir:201", "fir:5,0", "arx:4",
                           "arx:0,4,1", "arx:4,0,1", "arx:4,4,1,1", "arx:4,,1", "arma:2,2", "arx:4,4,-1", "fir:20 "}) {
    const std::string why = refusal_of(text);
    EXPECT_TRUE(why.starts_with(std::string(text) + " is not a black box: ")) << text << ": " << why;
    EXPECT_NE(why.find("arx:4,4,1"), std::string::npos) << why;
  }
  EXPECT_NE(refusal_of("arma:2,2").find("\"arma\" is neither fir nor arx"), std::string::npos);
  EXPECT_NE(refusal_of("fir:2.5").find("\"2.5\" is not a whole number"), std::string::npos);
  EXPECT_NE(refusal_of("arx:4,0,1").find("NB is 0, not within 1..200"), std::string::npos);
}

TEST(OrderSelection, FindsTheOrdersOfASystemAndItsDelay) {
  for (const int nk : {1, 3}) {
    const std::vector<Record> records = {second_order(600, 1, 0.02, nk), second_order(600, 2, 0.02, nk),
                                         second_order(600, 3, 0.02, nk)};
    EXPECT_EQ(choose_orders(records, Family::arx), (Orders{2, 2, nk, true})) << nk;
  }
}

TEST(OrderSelection, OneRecordIsCutIntoThirds) {
  EXPECT_EQ(choose_orders({second_order(1500, 4, 0.02)}, Family::arx), (Orders{2, 2, 1, true}));
}

TEST(OrderSelection, AFirGrowsUntilTheResponseHasDiedAway) {
  // The envelope falls by sqrt(0.7) a sample: to a hundredth after 26.
  const Orders chosen = choose_orders({second_order(1500, 5, 0.05), second_order(1500, 6, 0.05)}, Family::fir);
  EXPECT_GE(chosen.nb, 16);
  EXPECT_LE(chosen.nb, 48);
}

TEST(OrderSelection, AModelThatIsOnlyLongerPredictsNoBetter) {
  const std::vector<Record> records = {second_order(200, 7, 1.0), second_order(200, 8, 1.0)};
  EXPECT_GT(held_out_rms(records, {0, 128, 1, true}), 1.1 * held_out_rms(records, {0, 16, 1, true}));
  EXPECT_TRUE(std::isinf(held_out_rms(records, {0, 190, 1, true})));  // fewer samples than parameters
}

TEST(OrderSelection, SaysSoWhereThereIsTooLittle) {
  EXPECT_THROW(choose_orders({}, Family::fir), std::invalid_argument);
  EXPECT_THROW(choose_orders({second_order(6, 9, 0.0)}, Family::arx), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::blackbox::blackbox_specification_test
