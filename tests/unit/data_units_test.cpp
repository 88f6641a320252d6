// host/input/data: units of logs.
#include "host/input/data/units.hpp"

#include <gtest/gtest.h>

namespace flexspline::data::data_units_test {
namespace {

double in_si(std::string_view unit, double value) {
  const std::optional<Unit> u = unit_from_text(unit);
  EXPECT_TRUE(u.has_value()) << unit;
  return u ? u->factor * value + u->offset : 0.0;
}

TEST(Units, ConvertToSiByWhatIsKnownOfThem) {
  EXPECT_NEAR(in_si("rpm", 9.549296585513721), 1.0, 1e-12);
  EXPECT_NEAR(in_si("deg", 57.29577951308232), 1.0, 1e-12);
  EXPECT_NEAR(in_si("deg/s", 360.0), in_si("rev/s", 1.0), 1e-12);
  EXPECT_NEAR(in_si("arcmin", 60.0 * 180.0), 3.141592653589793, 1e-12);
  EXPECT_NEAR(in_si("mA", 1500.0), 1.5, 1e-12);
  EXPECT_NEAR(in_si("ms", 2.0), 0.002, 1e-15);
  EXPECT_NEAR(in_si("us", 2.0), 2e-6, 1e-18);
  EXPECT_NEAR(in_si("mN*m", 250.0), 0.25, 1e-12);
  EXPECT_NEAR(in_si("N*cm", 250.0), 2.5, 1e-12);
  EXPECT_NEAR(in_si("kN", 1.5), 1500.0, 1e-9);
  EXPECT_NEAR(in_si("mm", 12.0), 0.012, 1e-12);
  EXPECT_NEAR(in_si("um", 12.0), 12e-6, 1e-15);
  EXPECT_NEAR(in_si("degF", 212.0), 100.0, 1e-9);
  EXPECT_NEAR(in_si("degF", -40.0), -40.0, 1e-9);
  EXPECT_NEAR(in_si("K", 300.0), 26.85, 1e-9);
  EXPECT_NEAR(in_si("lbf*ft", 1.0), 1.3558179483314004, 1e-12);
  EXPECT_NEAR(in_si("ozf*in", 1.0), 0.00706155, 1e-8);
}

TEST(Units, SpellingsOfTheSameUnitAgree) {
  for (const std::string_view text : {"N*m", "Nm", "N m", "N\xC2\xB7m"}) EXPECT_DOUBLE_EQ(in_si(text, 3.0), 3.0);
  for (const std::string_view text : {"deg/s", "\xC2\xB0/s", "dps"})
    EXPECT_NEAR(in_si(text, 180.0), 3.141592653589793, 1e-12);
  EXPECT_DOUBLE_EQ(in_si("\xC2\xB5s", 1.0), 1e-6);
}

TEST(Units, WhatIsNoUnitIsNone) {
  for (const std::string_view text : {"", "furlong", "Mn*m", "%", "V"}) EXPECT_FALSE(unit_from_text(text)) << text;
}

TEST(Units, ANumberBeforeAUnitIsItsSize) {
  EXPECT_NEAR(in_si("0.125 N*m", 80.0), 10.0, 1e-12) << "80 % of 12.5 N m";
  EXPECT_NEAR(in_si("0.01deg", 18000.0), 3.141592653589793, 1e-12);
  EXPECT_NEAR(in_si("1e-4 rad", 5.0), 5e-4, 1e-18);
  // Counts get their size from the encoder, and zero of a scaled temperature is not known.
  for (const std::string_view text : {"2 counts", "0.1 degF", "0 rad", "-1 rad", "12", "0.125 %", "nan rad"})
    EXPECT_FALSE(unit_from_text(text)) << text;
}

TEST(Units, OfColumnsFollowTheAxis) {
  EXPECT_EQ(unit_of(Column::motor_position, Axis::rotary), "rad");
  EXPECT_EQ(unit_of(Column::motor_position, Axis::linear), "m");
  EXPECT_EQ(unit_of(Column::output_velocity, Axis::rotary), "rad/s");
  EXPECT_EQ(unit_of(Column::velocity_command, Axis::linear), "m/s");
  EXPECT_EQ(unit_of(Column::torque, Axis::rotary), "N*m");
  EXPECT_EQ(unit_of(Column::motor_torque, Axis::linear), "N");
  EXPECT_EQ(unit_of(Column::current, Axis::linear), "A");
  EXPECT_EQ(unit_of(Column::temperature, Axis::rotary), "degC");
}

TEST(Units, ListedOnesAreKnownAndOfTheirQuantity) {
  for (const Quantity quantity :
       {Quantity::time, Quantity::current, Quantity::angle, Quantity::angular_velocity, Quantity::torque,
        Quantity::length, Quantity::velocity, Quantity::force, Quantity::temperature}) {
    const std::string list = known_units(quantity);
    EXPECT_TRUE(list.starts_with(si_unit(quantity)));
    std::size_t begin = 0;
    while (begin < list.size()) {
      const std::size_t end = std::min(list.find(", ", begin), list.size());
      const std::optional<Unit> unit = unit_from_text(list.substr(begin, end - begin));
      ASSERT_TRUE(unit.has_value()) << list.substr(begin, end - begin);
      EXPECT_TRUE(unit->quantity == quantity || unit->quantity == Quantity::counts ||
                  unit->quantity == Quantity::counts_rate);
      begin = end + 2;
    }
  }
}

}  // namespace
}  // namespace flexspline::data::data_units_test
