// How numbers, texts and units of model files are spelt.
#include "host/physics/model/text.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include "host/physics/model/units.hpp"

namespace flexspline::model::model_text_test {
namespace {

TEST(ModelText, NumbersAreShort) {
  EXPECT_EQ(number_text(0.0, 6), "0");
  EXPECT_EQ(number_text(-0.0, 6), "0");
  EXPECT_EQ(number_text(100.0, 6), "100");
  EXPECT_EQ(number_text(-0.045, 6), "-0.045");
  EXPECT_EQ(number_text(3.63e-4, 6), "3.63e-4");
  EXPECT_EQ(number_text(0.00123456789, 6), "0.00123457");
  EXPECT_EQ(number_text(0.00099999999, 6), "0.001");
  EXPECT_EQ(number_text(3e8, 6), "3e8");
  EXPECT_EQ(number_text(999999.4, 6), "999999");
  EXPECT_EQ(number_text(999999.6, 6), "1e6");
  EXPECT_EQ(number_text(123456.0, 3), "123000");
  EXPECT_EQ(number_text(16.66, 3), "16.7");
  EXPECT_EQ(exact_text(0.1), "0.1");
  EXPECT_EQ(exact_text(1.0 / 3.0), "0.3333333333333333");
  EXPECT_EQ(exact_text(12345678.0), "1.2345678e7");
}

TEST(ModelText, NumbersReadBackToTheirDigits) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const double value = std::bit_cast<double>(static_cast<std::uint64_t>(random()));
    if (!std::isnormal(value)) continue;
    EXPECT_EQ(std::strtod(exact_text(value).c_str(), nullptr), value);
    const double rounded = std::strtod(number_text(value, 6).c_str(), nullptr);
    if (!std::isfinite(rounded)) continue;  // the largest one rounds upwards
    EXPECT_LE(std::abs(rounded / value - 1.0), 5.0001e-6) << value;
  }
}

TEST(ModelText, UnitsAreTheSameWhereTheyMeanTheSame) {
  EXPECT_TRUE(same_unit("Nm", "N*m"));
  EXPECT_TRUE(same_unit("m N", "N m"));
  EXPECT_TRUE(same_unit("kg*m^2", "kgm2"));
  EXPECT_TRUE(same_unit("kg*m^2", "kg m\u00B2"));
  EXPECT_TRUE(same_unit("kg*m^2", "kg*m**2"));
  EXPECT_TRUE(same_unit("1/degC", "1/\u00B0C"));
  EXPECT_TRUE(same_unit("1/degC", "1/K"));
  EXPECT_TRUE(same_unit("1/A^2", "A^-2"));
  EXPECT_TRUE(same_unit("1/A^2", "A\u207B\u00B2"));
  EXPECT_TRUE(same_unit("", "-"));
  EXPECT_TRUE(same_unit("1", "-"));
  EXPECT_TRUE(same_unit("N/N", "-"));
  EXPECT_FALSE(same_unit("s", "ms"));
  EXPECT_FALSE(same_unit("N*m", "N*mm"));
  EXPECT_FALSE(same_unit("N*m", "Nmm"));
  EXPECT_FALSE(same_unit("N*m", "kNm"));
  EXPECT_FALSE(same_unit("N*m", "N*m/rad"));
  EXPECT_FALSE(same_unit("%", "-"));
  EXPECT_FALSE(same_unit("degC", "K"));
  EXPECT_FALSE(same_unit("N*m^", "N*m"));
  EXPECT_FALSE(same_unit("N*", "N"));
  EXPECT_FALSE(is_dimensionless("rad"));
}

}  // namespace
}  // namespace flexspline::model::model_text_test
