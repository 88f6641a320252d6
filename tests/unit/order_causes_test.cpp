// What a ripple's order says of its cause on a drive: each order, several causes of one order, and what is missing.
#include "host/physics/catalogue/order_causes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace flexspline::catalogue::order_causes_test {
namespace {

model::Drive drive_of(double gear_ratio, double pole_pairs = 0.0, double slots = 0.0) {
  model::Drive drive;
  drive.gear_ratio.value = gear_ratio;
  if (pole_pairs > 0.0) drive.pole_pairs.value = pole_pairs;
  if (slots > 0.0) drive.motor_slots.value = slots;
  return drive;
}

std::vector<OrderCause> causes(const char* effect, double order, const model::Drive& drive) {
  return order_causes(get(effect), order, drive);
}

// How many of the causes say this.
std::ptrdiff_t says(const std::vector<OrderCause>& list, std::string_view part) {
  return std::count_if(list.begin(), list.end(),
                       [&](const OrderCause& c) { return c.cause.find(part) != std::string_view::npos; });
}

TEST(OrderCauses, OnceATurnIsAnEccentricEncoderOrShaftWithoutAnyFactOfTheMotor) {
  const auto found = causes("torque_ripple", 1.0, drive_of(100.0));
  EXPECT_EQ(found.size(), 2U);
  EXPECT_EQ(says(found, "encoder is eccentric"), 1);
  EXPECT_EQ(says(found, "shaft is bent"), 1);
  EXPECT_EQ(found[0].from, "1 per motor turn");
}

TEST(OrderCauses, TwiceAndFourTimesATurnAreTheWaveGenerator) {
  for (const char* effect : {"torque_ripple", "load_scaled_ripple", "kinematic_error"})
    for (const double order : {2.0, 4.0}) {
      const auto found = causes(effect, order, drive_of(100.0));
      ASSERT_EQ(found.size(), 1U) << effect << order;
      EXPECT_EQ(says(found, "wave generator"), 1);
      EXPECT_EQ(found[0].from.find(" = "), std::string::npos) << found[0].from;
    }
}

TEST(OrderCauses, ARatioThatNoStrainWaveGearHasNamesNoWaveGenerator) {
  EXPECT_TRUE(causes("torque_ripple", 2.0, drive_of(10.0)).empty());
  EXPECT_TRUE(causes("torque_ripple", 22.0, drive_of(10.0)).empty());
  EXPECT_FALSE(causes("torque_ripple", 1.0, drive_of(10.0)).empty());
}

TEST(OrderCauses, MultiplesOfThePolePairsAreSensorsPhasesAndDeadTime) {
  const model::Drive drive = drive_of(100.0, 7.0);
  const auto once = causes("torque_ripple", 7.0, drive);
  ASSERT_EQ(once.size(), 1U);
  EXPECT_EQ(says(once, "offset"), 1);
  EXPECT_EQ(once[0].from, "1 x pole_pairs = 7");
  const auto twice = causes("torque_ripple", 14.0, drive);
  ASSERT_EQ(twice.size(), 3U);
  EXPECT_EQ(says(twice, "gains of the current sensors differ"), 1);
  EXPECT_EQ(says(twice, "resistance or inductance"), 1);
  EXPECT_EQ(says(twice, "irregular place of the stator"), 1);
  const auto six = causes("torque_ripple", 42.0, drive);
  ASSERT_EQ(six.size(), 2U);
  EXPECT_EQ(says(six, "dead time"), 1);
  EXPECT_EQ(says(six, "back-EMF"), 1);
  EXPECT_EQ(six[0].from, "6 x pole_pairs = 42");
  EXPECT_NE(std::string(six[0].reference).find("Holmes"), std::string::npos);
  for (const double order : {3.0, 5.0, 6.0, 8.0, 13.0, 15.0, 21.0, 41.0, 43.0})
    EXPECT_TRUE(causes("torque_ripple", order, drive).empty()) << order;
}

TEST(OrderCauses, SlotsAndTheLeastCommonMultipleWithThePolesAreCogging) {
  const model::Drive drive = drive_of(100.0, 7.0, 12.0);  // lcm(12, 14) = 84
  EXPECT_EQ(says(causes("torque_ripple", 12.0, drive), "magnets that differ"), 1);
  const auto cogging = causes("torque_ripple", 84.0, drive);
  ASSERT_EQ(cogging.size(), 1U);
  EXPECT_EQ(says(cogging, "teeth between the slots"), 1);
  EXPECT_EQ(cogging[0].from, "least common multiple of motor_slots and 2 x pole_pairs = 84");
  EXPECT_TRUE(causes("torque_ripple", 168.0, drive).empty());
}

TEST(OrderCauses, AllCausesOfOneOrderAreListed) {
  // One pole pair: the motor's orders meet those of the shaft and of the wave generator.
  const model::Drive one = drive_of(100.0, 1.0);
  EXPECT_EQ(causes("torque_ripple", 1.0, one).size(), 3U);
  EXPECT_EQ(says(causes("torque_ripple", 1.0, one), "offset"), 1);
  EXPECT_EQ(causes("torque_ripple", 2.0, one).size(), 4U);
  // Two: 2 is the offset and the wave generator, 4 the gains and the wave generator.
  const model::Drive two = drive_of(100.0, 2.0);
  EXPECT_EQ(says(causes("torque_ripple", 2.0, two), "offset"), 1);
  EXPECT_EQ(says(causes("torque_ripple", 2.0, two), "wave generator"), 1);
  EXPECT_EQ(says(causes("torque_ripple", 4.0, two), "gains"), 1);
  EXPECT_EQ(says(causes("torque_ripple", 4.0, two), "wave generator"), 1);
  // 24 slots and 8 poles: dead time, back-EMF, unequal magnets and cogging.
  EXPECT_EQ(causes("torque_ripple", 24.0, drive_of(100.0, 4.0, 24.0)).size(), 4U);
}

TEST(OrderCauses, TheMeshOfTheTeethIsTwiceTheRatioPlusOrMinusTwo) {
  EXPECT_EQ(says(causes("kinematic_error", 202.0, drive_of(100.0)), "circular spline is fixed"), 1);
  EXPECT_EQ(says(causes("kinematic_error", 198.0, drive_of(100.0)), "flexspline is fixed"), 1);
  EXPECT_TRUE(causes("kinematic_error", 200.0, drive_of(100.0)).empty());
}

TEST(OrderCauses, ARippleThatGrowsWithTheLoadHasOnlyCausesThatDo) {
  const model::Drive drive = drive_of(100.0, 4.0, 24.0);
  EXPECT_TRUE(causes("load_scaled_ripple", 4.0 + 3.0, drive).empty());
  EXPECT_EQ(says(causes("load_scaled_ripple", 24.0, drive), "dead time"), 0);
  EXPECT_EQ(says(causes("load_scaled_ripple", 24.0, drive), "back-EMF"), 1);
  EXPECT_EQ(says(causes("load_scaled_ripple", 8.0, drive), "gains"), 1);
  EXPECT_EQ(says(causes("load_scaled_ripple", 4.0, drive), "offset"), 0);
}

TEST(OrderCauses, AnErrorOfPositionHasNoElectricalCause) {
  const model::Drive drive = drive_of(100.0, 4.0, 24.0);
  for (const double order : {8.0, 24.0}) EXPECT_TRUE(causes("kinematic_error", order, drive).empty()) << order;
}

TEST(OrderCauses, FrictionThatVariesWithTheAngleHasCausesThatRubAndThoseInProportionToTheCurrent) {
  const model::Drive drive = drive_of(100.0, 4.0, 24.0);
  const char* friction = "angle_dependent_friction";
  const auto once = causes(friction, 1.0, drive);
  ASSERT_EQ(once.size(), 1U);
  EXPECT_EQ(says(once, "shaft is bent"), 1);
  EXPECT_EQ(says(causes(friction, 2.0, drive), "wave generator"), 1);
  // Where friction alone asks for the current, a part of it looks like friction.
  EXPECT_EQ(causes(friction, 8.0, drive).size(), 2U);
  EXPECT_EQ(says(causes(friction, 8.0, drive), "gains of the current sensors differ"), 1);
  EXPECT_EQ(causes(friction, 24.0, drive).size(), 1U);
  EXPECT_EQ(says(causes(friction, 24.0, drive), "back-EMF"), 1);
  EXPECT_EQ(says(causes(friction, 4.0, drive), "offset"), 0) << "it does not turn with the direction";
  const auto output = causes(friction, 0.01, drive);
  ASSERT_EQ(output.size(), 1U);
  EXPECT_EQ(output[0].from, "1 per output turn");
  EXPECT_TRUE(causes("torque_ripple", 0.01, drive).empty()) << "a load that turns with the output";
  EXPECT_EQ(orders_of_motor(get(friction), drive), (std::vector<double>{8, 24}));
  EXPECT_NE(order_hint(get(friction), drive_of(100.0)).find("pole_pairs"), std::string::npos);
}

TEST(OrderCauses, AnEffectWithoutAnOrderHasNeitherCausesNorAHint) {
  for (const char* effect : {"viscous_friction", "backlash", "torque_sensor_ripple"}) {
    EXPECT_TRUE(causes(effect, 1.0, drive_of(100.0, 1.0)).empty()) << effect;
    EXPECT_EQ(order_hint(get(effect), drive_of(100.0)), "") << effect;
  }
}

TEST(OrderCauses, SayNothingWhereATurnOfTheMotorIsNotKnown) {
  model::Drive unknown;
  unknown.pole_pairs.value = 4.0;
  // In joint units with a ratio of one, 4 per turn of the joint is not 4 per turn of the motor.
  for (const model::Drive& drive : {unknown, drive_of(1.0)}) {
    for (const double order : {1.0, 2.0, 4.0, 8.0, 24.0})
      EXPECT_TRUE(causes("torque_ripple", order, drive).empty()) << order;
    EXPECT_TRUE(orders_of_motor(get("torque_ripple"), drive).empty());
    EXPECT_NE(order_hint(get("torque_ripple"), drive).find("gear"), std::string::npos);
  }
}

TEST(OrderCauses, WithARatioOfOneAndPolePairsTheMotorHasNoGear) {
  const model::Drive direct = drive_of(1.0, 8.0);
  EXPECT_EQ(orders_of_motor(get("torque_ripple"), direct), (std::vector<double>{8, 16, 48}));
  EXPECT_EQ(says(causes("torque_ripple", 48.0, direct), "dead time"), 1);
  EXPECT_TRUE(causes("torque_ripple", 2.0, direct).empty());
}

TEST(OrderCauses, OnALinearAxisThePitchIsATurnOfTheMotorAndThereIsNoWaveGenerator) {
  model::Drive screw;
  screw.axis = data::Axis::linear;
  screw.pole_pairs.value = 4.0;
  EXPECT_TRUE(causes("torque_ripple", 24.0, screw).empty());
  EXPECT_NE(order_hint(get("torque_ripple"), screw).find("pitch_m"), std::string::npos);
  screw.pitch_m.value = 0.005;
  EXPECT_EQ(says(causes("torque_ripple", 24.0, screw), "dead time"), 1);
  EXPECT_TRUE(causes("torque_ripple", 2.0, screw).empty());
}

TEST(OrderCauses, TheHintNamesTheFactsThatAreMissingAndOnlyThose) {
  const Entry& ripple = get("torque_ripple");
  const std::string both = order_hint(ripple, drive_of(100.0));
  EXPECT_NE(both.find("pole_pairs and motor_slots"), std::string::npos) << both;
  const std::string slots = order_hint(ripple, drive_of(100.0, 7.0));
  EXPECT_EQ(slots.find("pole_pairs"), std::string::npos) << slots;
  EXPECT_NE(slots.find("motor_slots"), std::string::npos) << slots;
  EXPECT_EQ(order_hint(ripple, drive_of(100.0, 7.0, 12.0)), "");
  // Slots make no ripple that grows with the load, and no motor an error of position.
  EXPECT_EQ(order_hint(get("load_scaled_ripple"), drive_of(100.0)).find("motor_slots"), std::string::npos);
  EXPECT_EQ(order_hint(get("kinematic_error"), drive_of(100.0)), "");
}

TEST(OrderCauses, OrdersOfTheMotorAreThoseOfItsPolePairsAndSlots) {
  const Entry& ripple = get("torque_ripple");
  EXPECT_EQ(orders_of_motor(ripple, drive_of(100.0, 7.0, 12.0)), (std::vector<double>{7, 12, 14, 42, 84}));
  EXPECT_EQ(orders_of_motor(ripple, drive_of(100.0, 4.0, 24.0)), (std::vector<double>{4, 8, 24}));
  EXPECT_TRUE(orders_of_motor(ripple, drive_of(100.0)).empty());
  EXPECT_TRUE(orders_of_motor(get("kinematic_error"), drive_of(100.0, 7.0, 12.0)).empty());
}

TEST(OrderCauses, OrdersOfTheOutputAreThoseOfFrictionOnceAndTwiceATurnAsTheyAreWritten) {
  const Entry& friction = get("angle_dependent_friction");
  EXPECT_EQ(orders_of_output(friction, drive_of(120.0)), (std::vector<double>{0.00833333, 0.0166667}));
  EXPECT_EQ(orders_of_output(friction, drive_of(5.0)), (std::vector<double>{0.2, 0.4})) << "any gear has an output";
  const auto twice = causes("angle_dependent_friction", 0.0166667, drive_of(120.0));
  ASSERT_EQ(twice.size(), 1U) << "far below one, orders are close to each other";
  EXPECT_EQ(twice[0].from, "2 per output turn");
  EXPECT_TRUE(orders_of_output(get("torque_ripple"), drive_of(100.0)).empty());
  model::Drive screw;
  screw.axis = data::Axis::linear;
  screw.pitch_m.value = 0.005;
  for (const model::Drive& drive : {drive_of(1.0, 4.0), screw}) EXPECT_TRUE(orders_of_output(friction, drive).empty());
}

TEST(OrderCauses, EveryCauseHasACheckACureAndAReference) {
  std::set<std::string_view> seen;
  const model::Drive drive = drive_of(100.0, 7.0, 12.0);
  for (const double order : {1.0, 2.0, 4.0, 7.0, 12.0, 14.0, 42.0, 84.0, 198.0, 202.0})
    for (const OrderCause& c : causes("torque_ripple", order, drive)) {
      seen.insert(c.cause);
      EXPECT_FALSE(c.reference.empty()) << c.cause;
      for (const std::string_view sentence : {c.check, c.cure}) {
        EXPECT_GT(sentence.size(), 20U) << c.cause;
        EXPECT_TRUE(sentence.ends_with('.')) << sentence;
      }
    }
  EXPECT_EQ(seen.size(), 14U);
}

}  // namespace
}  // namespace flexspline::catalogue::order_causes_test
