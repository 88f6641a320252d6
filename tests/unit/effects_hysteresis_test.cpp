// Hysteresis of the gear and of friction: what the laws have in common, where one is another, what they remember.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests::effects_hysteresis_test {
namespace {

using catalogue::Balance;
using catalogue::Entry;
using catalogue::Real;
using effects::DriveConstants;
using effects::Inputs;
using Values = std::vector<double>;

const DriveConstants<double> kDrive;
constexpr double kTorsion = 1e-3;  // rad, of the loops here

double s(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

// Torsion and motor angle go the same way, the angle a hundred times as far.
std::vector<Inputs<Real>> along_path(const Values& torsion, double torque = 0.0) {
  std::vector<Inputs<Real>> inputs;
  for (std::size_t k = 0; k < torsion.size(); ++k) {
    Inputs<Real> in;
    in.torsion = torsion[k];
    in.angle = 100.0 * torsion[k];
    in.direction = k > 0 ? s(torsion[k] - torsion[k - 1]) : 0.0;
    in.velocity = in.direction;
    in.speed = std::abs(in.velocity);
    in.torque = torque;
    in.torque_magnitude = std::abs(torque);
    in.viscous_scale = in.coulomb_scale = 1.0;
    in.elapsed = 1e-3;
    inputs.push_back(in);
  }
  return inputs;
}

Values torque_of(std::string_view effect, const Values& parameters, const std::vector<Inputs<Real>>& inputs) {
  const Entry& entry = catalogue::get(effect);
  Values torque(inputs.size(), 0.0);
  entry.real.torque(parameters.data(), kDrive, entry.info->balance, inputs, torque.data());
  return torque;
}

Values usual_of(std::string_view effect) {
  Values usual;
  for (const auto& info : catalogue::get(effect).parameters) usual.push_back(info.usual);
  return usual;
}

double largest(const Values& values) {
  double size = 0.0;
  for (const double x : values) size = std::max(size, std::abs(x));
  return size;
}

void expect_equal(const Values& a, const Values& b, double share_of_largest) {
  ASSERT_GT(largest(a), 0.0);
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k], b[k], share_of_largest * largest(a)) << "sample " << k;
}

// Straight from corner to corner.
Values through(const Values& corners, int steps) {
  Values path = {corners.front()};
  for (std::size_t c = 1; c < corners.size(); ++c)
    for (int k = 1; k <= steps; ++k) path.push_back(corners[c - 1] + (corners[c] - corners[c - 1]) * k / steps);
  return path;
}

// Loops within loops, with stops and with steps of very different lengths.
Values wild_path() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Values path = {0.0, 0.0, 0.0};
  for (int k = 0; k < 3000; ++k)
    path.push_back(k % 7 == 0
                       ? path.back()
                       : 0.97 * path.back() + std::pow(10.0, 2.0 * unit(random) - 2.0) * unit(random) * kTorsion);
  return path;
}

const std::vector<std::string_view>& gear_laws() {
  static const std::vector<std::string_view> kNames = {"dahl_hysteresis",
                                                       "modified_dahl_hysteresis",
                                                       "duhem_hysteresis",
                                                       "bouc_wen_hysteresis",
                                                       "prandtl_ishlinskii_hysteresis",
                                                       "preisach_hysteresis",
                                                       "torque_proportional_hysteresis"};
  return kNames;
}

// Laws that are one in some setting: the list of what is alike.

TEST(DahlHysteresis, OfExponentOneIsBoucWenOfExponentOneWithoutGamma) {
  const auto inputs = along_path(wild_path());
  // Tc = kz/beta and sigma = kz; both steps are exact.
  expect_equal(torque_of("dahl_hysteresis", {2.0, 5000.0, 1.0}, inputs),
               torque_of("bouc_wen_hysteresis", {5000.0, 2500.0, 0.0, 1.0}, inputs), 1e-12);
}

TEST(DahlHysteresis, OfExponentTwoIsTheModifiedOne) {
  const auto inputs = along_path(wild_path());
  expect_equal(torque_of("dahl_hysteresis", {2.0, 5000.0, 2.0}, inputs),
               torque_of("modified_dahl_hysteresis", {2.0, 5000.0}, inputs), 1e-12);
}

TEST(DahlHysteresis, OfExponentOneIsDuhemThatIsDrawnToZero) {
  const auto inputs = along_path(wild_path());
  // T' = b v - a abs(v) T: sigma = b, Tc = b/a.
  expect_equal(torque_of("dahl_hysteresis", {2.0, 5000.0, 1.0}, inputs),
               torque_of("duhem_hysteresis", {2500.0, 5000.0, 0.0, 0.0, 0.0, 0.0}, inputs), 1e-12);
  const Values spring = torque_of("duhem_hysteresis", {2500.0, 5000.0, 0.0, 6300.0, 0.0, 0.0}, inputs);
  EXPECT_GT(largest(spring), 1.2 * 2.0) << "and with a phi it is not";
}

TEST(DahlHysteresis, IsTheTorqueProportionalOneWhoseBoundDoesNotGrow) {
  const auto inputs = along_path(wild_path(), 30.0);
  const Values fixed = torque_of("dahl_hysteresis", {2.0, 5000.0, 1.0}, inputs);
  expect_equal(fixed, torque_of("torque_proportional_hysteresis", {2.0, 0.0, 5000.0}, inputs), 1e-12);
  // At a constant load the bound is c0 + c1 abs(T).
  expect_equal(fixed, torque_of("torque_proportional_hysteresis", {0.5, 0.05, 5000.0}, inputs), 1e-12);
}

TEST(LugreFriction, WithoutStribeckAndDampingIsDahlFriction) {
  const auto inputs = along_path(wild_path());
  expect_equal(torque_of("dahl_friction", {0.045, 0.05}, inputs),
               torque_of("lugre_friction", {0.045, 0.045, 3.0, 0.045 / 0.05, 0.0}, inputs), 1e-12);
}

// In steady sliding z' is zero: what is left is g(w), whatever the damping.
TEST(LugreFriction, SlidesWithCoulombAndStribeckFriction) {
  for (const double velocity : {-40.0, -2.0, 0.5, 3.0}) {
    std::vector<Inputs<Real>> inputs(400);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      inputs[k].velocity = velocity;
      inputs[k].speed = std::abs(velocity);
      inputs[k].direction = s(velocity);
      inputs[k].angle = velocity * 0.1 * static_cast<double>(k);
      inputs[k].coulomb_scale = 1.0;
    }
    const double expected = s(velocity) * (0.045 + 0.010 * std::exp(-velocity * velocity / 9.0));
    for (const double damping : {0.0, 1e-3})
      EXPECT_NEAR(torque_of("lugre_friction", {0.045, 0.055, 3.0, 0.4, damping}, inputs).back(), expected, 1e-12);
  }
}

// Memory.

TEST(GearHysteresis, IsTheSameWhereverItStandsStillAndHoweverOftenItIsSampled) {
  const Values corners = {0.0, kTorsion, -0.4 * kTorsion, 0.7 * kTorsion, -kTorsion, 0.2 * kTorsion};
  for (const std::string_view law : gear_laws()) {
    SCOPED_TRACE(law);
    const double once = torque_of(law, usual_of(law), along_path(through(corners, 400))).back();
    Values waiting;
    for (const double x : through(corners, 400)) waiting.insert(waiting.end(), 3, x);
    EXPECT_EQ(torque_of(law, usual_of(law), along_path(waiting)).back(), once) << "to the bit";
    // A phi that is taken at the mean of a step depends on its length.
    const bool exact = law != "duhem_hysteresis";
    EXPECT_NEAR(torque_of(law, usual_of(law), along_path(through(corners, 40))).back(), once,
                (exact ? 1e-11 : 1e-3) * std::abs(once) + 1e-12);
  }
}

// After a small loop in between, a law that remembers its turning points goes on as if it had never been.
TEST(GearHysteresis, PreisachAndPrandtlIshlinskiiForgetASmallLoopThatIsClosed) {
  const Values direct = through({0.0, kTorsion, -0.8 * kTorsion, 0.5 * kTorsion, 0.9 * kTorsion}, 200);
  const Values detour = through({0.0, kTorsion, -0.8 * kTorsion, 0.5 * kTorsion, -0.1 * kTorsion, 0.3 * kTorsion,
                                 0.1 * kTorsion, 0.5 * kTorsion, 0.9 * kTorsion},
                                200);
  for (const std::string_view law : {"preisach_hysteresis", "prandtl_ishlinskii_hysteresis"}) {
    const Values a = torque_of(law, usual_of(law), along_path(direct));
    const Values b = torque_of(law, usual_of(law), along_path(detour));
    for (std::size_t k = 0; k < 200; ++k)
      ASSERT_NEAR(a[a.size() - 1 - k], b[b.size() - 1 - k], 1e-12 * largest(a))
          << law << ", " << k << " before the end";
  }
  // Of Dahl's law the small loop is not forgotten: it is how one distinguishes them.
  const Values a = torque_of("dahl_hysteresis", {2.0, 5000.0, 1.0}, along_path(direct));
  const Values b = torque_of("dahl_hysteresis", {2.0, 5000.0, 1.0}, along_path(detour));
  EXPECT_GT(std::abs(a.back() - b.back()), 1e-3);
}

Values preisach_weights(double span, const std::function<double(int j, int k)>& weight) {
  Values parameters = {span};
  for (int j = 1; j <= 9; ++j)
    for (int k = 1; k <= j; ++k) parameters.push_back(weight(j, k));
  return parameters;
}

// The loop between two torsions is the same for plays wherever it lies; that of relays may depend on the place.
TEST(GearHysteresis, PlaysDrawTheSameLoopWhereverItLiesAndRelaysNeedNot) {
  const auto area = [](std::string_view law, const Values& parameters, double middle) {
    const double low = middle - 0.3 * kTorsion, high = middle + 0.3 * kTorsion;
    const Values path = through({0.0, 2.0 * kTorsion, low, high, low}, 300);
    const Values torque = torque_of(law, parameters, along_path(path));
    double sum = 0.0;
    for (std::size_t k = path.size() - 600; k < path.size(); ++k)
      sum += 0.5 * (torque[k] + torque[k - 1]) * (path[k] - path[k - 1]);
    return sum;
  };
  const std::string_view plays = "prandtl_ishlinskii_hysteresis", relays = "preisach_hysteresis";
  const double here = area(plays, usual_of(plays), 0.0);
  EXPECT_GT(here, 1e-6);
  EXPECT_NEAR(area(plays, usual_of(plays), 0.9 * kTorsion), here, 1e-12 * here);
  const Values stiffening = preisach_weights(1.6 * kTorsion, [](int j, int k) { return -0.01 * std::abs(j + k - 10); });
  EXPECT_GT(area(relays, stiffening, 0.9 * kTorsion), 2.0 * area(relays, stiffening, 0.0));
}

TEST(GearHysteresis, LosesEnergyInEveryClosedLoopHoweverSlowly) {
  for (const std::string_view law : gear_laws()) {
    Values parameters = usual_of(law);
    const Values path = through({0.0, kTorsion, -kTorsion, kTorsion, -kTorsion, kTorsion}, 400);
    const Values torque = torque_of(law, parameters, along_path(path));
    double work = 0.0;
    for (std::size_t k = path.size() - 800; k < path.size(); ++k)
      work += 0.5 * (torque[k] + torque[k - 1]) * (path[k] - path[k - 1]);
    EXPECT_GT(work, 0.02 * largest(torque) * kTorsion) << law;
  }
}

// What each law cannot exceed.
double bound_of(std::string_view law, double torque, double torsion) {
  if (law == "torque_proportional_hysteresis") return 0.5 + 0.05 * torque;
  if (law == "duhem_hysteresis") return 11300.0 / 2500.0 + 6300.0 * torsion + 3e8 * std::pow(torsion, 3);
  if (law == "prandtl_ishlinskii_hysteresis") return 3700.0 * torsion;
  if (law == "preisach_hysteresis") {
    const Values usual = usual_of(law);
    return std::accumulate(usual.begin() + 1, usual.end(), 0.0, [](double sum, double w) { return sum + std::abs(w); });
  }
  return 2.0;
}

TEST(GearHysteresis, StaysWithinItsBoundHoweverLargeTheSteps) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0.0, 1.0);
  Values path = {0.0};
  for (int k = 0; k < 3000; ++k) path.push_back(std::pow(10.0, 1.5 * normal(random) - 4.0) * normal(random));
  const double reach = largest(path);
  EXPECT_GT(reach, 0.1) << "a hundred times what a gear survives";
  for (const std::string_view law : gear_laws()) {
    const double bound = bound_of(law, 40.0, reach);
    for (const double x : torque_of(law, usual_of(law), along_path(path, 40.0)))
      ASSERT_LE(std::abs(x), bound * (1.0 + 1e-12)) << law;
  }
  for (const Values& shape :
       {Values{5000.0, 1e9, 5e8, 3.0}, Values{5000.0, 4000.0, -1000.0, 1.0}, Values{5000.0, 2e4, 2e4, 1.3}})
    for (const double x : torque_of("bouc_wen_hysteresis", shape, along_path(path)))
      ASSERT_LE(std::abs(x), 5000.0 * std::pow(shape[1] + shape[2], -1.0 / shape[3]) * (1.0 + 1e-12));
  for (const double exponent : {0.5, 0.8, 1.0, 1.3, 4.0})
    for (const double x : torque_of("dahl_hysteresis", {2.0, 5000.0, exponent}, along_path(path)))
      ASSERT_LE(std::abs(x), 2.0);
  for (const double x : torque_of("lugre_friction", {0.045, 0.13, 3.0, 40.0, 0.0}, along_path(path)))
    ASSERT_LE(std::abs(x), 0.13);
}

// A record begins at rest, and below an exponent of one the limit is reached and not only approached.
TEST(DahlHysteresis, BeginsAtRestAndReachesItsLimitForEveryExponent) {
  const Values path = through({0.0, 0.0, 0.0, kTorsion, 3.0 * kTorsion, 3.0 * kTorsion, 2.9 * kTorsion}, 10);
  for (const double exponent : {0.5, 0.9, 1.0, 1.1, 2.0, 4.0}) {
    const Values torque = torque_of("dahl_hysteresis", {2.0, 5000.0, exponent}, along_path(path));
    for (std::size_t k = 0; k <= 20; ++k) ASSERT_EQ(torque[k], 0.0) << exponent;
    for (std::size_t k = 21; k < path.size(); ++k)
      ASSERT_TRUE(torque[k] > 0.0 && torque[k] <= 2.0) << exponent << " at " << k;
    if (exponent < 1.0) {
      // u^(1-i) falls by (1-i) sigma/Tc a torsion, from one: gone after 0.8 mrad for i = 0.5, and a millionth left at 3
      // mrad for 0.9.
      EXPECT_NEAR(torque[50], 2.0, exponent == 0.5 ? 1e-8 : 1e-5);
    }
    EXPECT_LT(torque.back(), torque[50]) << "and leaves it after a reversal";
  }
}

TEST(GearHysteresis, DoesNotDriftInAHundredThousandLoops) {
  Values loop = through({0.0, kTorsion, -0.6 * kTorsion, 0.0}, 3);
  for (const std::string_view law : gear_laws()) {
    const Values parameters = usual_of(law);
    const auto instance = catalogue::get(law).make(parameters.data(), kDrive);
    const std::vector<Inputs<Real>> inputs = along_path(loop, 10.0);
    const auto torque = [&] {
      effects::Torques<Real> out{};
      instance->evaluate(inputs.front(), out);
      return out.transmission;
    };
    double early = 0.0;
    for (int turn = 0; turn < 100'000; ++turn) {
      for (std::size_t k = 1; k < inputs.size(); ++k) instance->advance(inputs[k], inputs[k - 1]);
      if (turn == 200) early = torque();
    }
    ASSERT_NE(early, 0.0) << law;
    EXPECT_NEAR(torque(), early, 1e-12 * std::abs(early)) << law;
  }
}

// Shapes.

TEST(TorqueProportionalHysteresis, DrawsALoopThatWidensWithTheLoad) {
  const Values path = through({0.0, 5.0 * kTorsion, -5.0 * kTorsion, 5.0 * kTorsion}, 500);
  for (const double load : {0.0, 10.0, 40.0}) {
    const Values torque = torque_of("torque_proportional_hysteresis", {0.5, 0.05, 5000.0}, along_path(path, load));
    EXPECT_NEAR(torque[1000], -(0.5 + 0.05 * load), 1e-2 * (0.5 + 0.05 * load));
    EXPECT_NEAR(torque[1500], 0.5 + 0.05 * load, 1e-2 * (0.5 + 0.05 * load));
  }
}

// The outermost edges end a ninth beyond the span.
TEST(PreisachHysteresis, OfEqualWeightsIsSaturatedBeyondItsSpanAndSymmetric) {
  const Values parameters = preisach_weights(kTorsion, [](int, int) { return 0.02; });
  const double all = 45.0 * 0.02;
  const Values path = through({0.0, 1.12 * kTorsion, -1.12 * kTorsion, 1.12 * kTorsion}, 200);
  const Values torque = torque_of("preisach_hysteresis", parameters, along_path(path));
  EXPECT_NEAR(torque[0], 0.0, 1e-15) << "of a gear that was worked until nothing of its past is left";
  EXPECT_NEAR(torque[200], all, 1e-12);
  EXPECT_NEAR(torque[400], -all, 1e-12);
  for (std::size_t k = 0; k <= 200; ++k)
    ASSERT_NEAR(torque[200 + k], -torque[400 + k], 1e-12) << "going up is going down, turned about the origin";
}

}  // namespace
}  // namespace flexspline::tests::effects_hysteresis_test
