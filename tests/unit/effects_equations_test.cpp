// Every effect of the catalogue against its equation, written out a second time in effects_truths.cpp, and what the
// rest of the project relies on of every effect.
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "tests/unit/effects_truths.hpp"

namespace flexspline::tests::effects_equations_test {
namespace {

// Sizes about the usual one, within bounds; signs that bounds leave open are drawn. In reduced numbers, for which the
// bounds hold.
Values random_reduced(const Entry& entry, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Values usual;
  for (const auto& info : entry.parameters) usual.push_back(info.usual != 0.0 ? info.usual : 0.003);
  Values values = catalogue::reduced(entry, usual);
  for (std::size_t p = 0; p < values.size(); ++p) {
    const auto& info = entry.parameters[p];
    if (info.kind == Kind::given) {
      values[p] = std::vector<double>{1.0, 2.0, 4.0, 12.0, 0.5}[random() % 5];
    } else {
      // A bound is an edge, where a slope has two values; of plays and relays that are wider than the motion nothing
      // shows.
      const double usual_value = values[p];
      values[p] *=
          0.4 + (info.kind == Kind::grid || info.limit == effects::Limit::corner || info.limit == effects::Limit::span
                     ? 0.5
                     : 2.0) *
                    unit(random);
      if (info.low > 0.0 && values[p] <= info.low) values[p] = info.low + 0.3 * std::max(usual_value - info.low, 0.5);
      if (values[p] >= info.high) values[p] = 0.5 * (usual_value + info.high);
      if (info.low < 0.0 && unit(random) < 0.5) values[p] = -values[p];
    }
    values[p] = std::clamp(values[p], info.low, info.high);
  }
  return values;
}

Values random_parameters(const Entry& entry, std::mt19937& random) {
  return catalogue::natural(entry, random_reduced(entry, random));
}

// What the step of a law with memory may differ from its rate form by, over the largest torque. Where the step is
// exact, what is left is the error of Runge and Kutta's; else it is the step's own.
double tolerance_of(const Entry& entry) {
  // Second order in x^2/12 of a travel of up to 0.2 loops a sample, which adds up until the next reversal.
  if (entry.name() == "bouc_wen_hysteresis") return 5e-3;
  // Phi is taken at the mean of both ends: third order, with a bend of some (0.1)^3.
  if (entry.name() == "duhem_hysteresis") return 1e-3;
  // A hundred sharp relays stand for one edge.
  if (entry.name() == "preisach_hysteresis") return 1e-2;
  return entry.has_state ? 1e-7 : 1e-12;
}

double largest(const Values& values) {
  double size = 0.0;
  for (const double x : values) size = std::max(size, std::abs(x));
  return size;
}

class EveryEffect : public testing::TestWithParam<std::string> {
 protected:
  const Entry& entry_ = catalogue::get(GetParam());
  std::mt19937 random_{static_cast<unsigned>(entry_.id)};
};

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const Entry& entry : catalogue::all()) names.emplace_back(entry.name());
  return names;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffect, testing::ValuesIn(effect_names()),
                         [](const auto& effect) { return effect.param; });

TEST_P(EveryEffect, GivesTheTermOfItsEquation) {
  ASSERT_TRUE(truths().contains(GetParam())) << "write the equation of " << GetParam() << " into truths()";
  for (int run = 0; run < 5; ++run) {
    const Record record = random_record(random_);
    const Values parameters = random_parameters(entry_, random_);
    const Values expected = truths().find(GetParam())->second(parameters, record);
    const Values given = response<Real>(entry_, parameters, record);
    ASSERT_GT(largest(expected), 0.0);
    const double tolerance = tolerance_of(entry_) * largest(expected);
    for (std::size_t k = 0; k < record.size(); ++k) ASSERT_NEAR(given[k], expected[k], tolerance) << "sample " << k;
  }
}

TEST_P(EveryEffect, AddsToTheBalancesThatItNamesAndLeavesTheOthersAlone) {
  const Record record = random_record(random_);
  const Values parameters = random_parameters(entry_, random_);
  const std::vector<Inputs<Real>> inputs = inputs_of<Real>(record, si_drive());
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    if (!entry_.adds_torque()) break;
    Values torque(record.size(), 0.25);
    entry_.real.torque(parameters.data(), si_drive(), balance, inputs, torque.data());
    const bool shift = entry_.info->phase == Phase::shift;
    const bool changed = std::any_of(torque.begin(), torque.end(), [](double x) { return x != 0.25; });
    // A shift reaches its own balance through the torsion.
    EXPECT_EQ(changed, entry_.adds_to(balance) && !(shift && balance == entry_.info->balance));
    Values plain(record.size(), 0.25);
    entry_.real.torque_of_plain(parameters.data(), si_drive(), balance, inputs, plain.data());
    EXPECT_EQ(plain, torque);
  }
}

TEST_P(EveryEffect, ChangesNoSignalThatIsNotItsOwn) {
  const Record record = random_record(random_);
  const Values parameters = random_parameters(entry_, random_);
  const std::vector<Inputs<Real>> inputs = inputs_of<Real>(record, si_drive());
  if (entry_.info->phase == Phase::source) {
    ASSERT_EQ(entry_.real.change, nullptr);
    return;
  }
  std::vector<Inputs<Real>> changed = inputs;
  entry_.real.change(parameters.data(), si_drive(), changed);
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (entry_.info->phase == Phase::shift) {
      changed[k].torsion = inputs[k].torsion;
      if (entry_.info->reads & effects::kMotorAngle) changed[k].torsion_rate = inputs[k].torsion_rate;
    } else {
      (entry_.info->modulates == "viscous_friction" ? changed[k].viscous_scale : changed[k].coulomb_scale) = 1.0;
    }
    ASSERT_EQ(std::memcmp(&changed[k], &inputs[k], sizeof(Inputs<Real>)), 0) << "another signal was changed";
  }
}

// What a packer relies on: inputs over their bases give the torque over its base.
TEST_P(EveryEffect, GivesTheSameTorquePerUnit) {
  std::uniform_real_distribution<double> exponent(-1.0, 1.0);
  const auto base = [&] { return std::pow(10.0, exponent(random_)); };
  for (int run = 0; run < 5; ++run) {
    DriveConstants<double> drive = si_drive();
    for (double* b : {&drive.torque_base, &drive.output_torque_base, &drive.velocity_base, &drive.output_velocity_base,
                      &drive.acceleration_base, &drive.output_acceleration_base, &drive.angle_base, &drive.torsion_base,
                      &drive.torsion_rate_base, &drive.temperature_base, &drive.current_base, &drive.time_base})
      *b = base();
    const double result_base = entry_.info->phase == Phase::shift       ? drive.torsion_base
                               : entry_.info->phase == Phase::modulate  ? 1.0
                               : entry_.info->balance == Balance::motor ? drive.torque_base
                                                                        : drive.output_torque_base;
    const Record record = random_record(random_);
    const Values parameters = random_parameters(entry_, random_);
    const Values si = response<Real>(entry_, parameters, record);
    const Values per_unit = response<Real>(entry_, parameters, record, drive);
    const double tolerance = 1e-11 * largest(si);
    for (std::size_t k = 0; k < record.size(); ++k)
      ASSERT_NEAR(per_unit[k] * result_base, si[k], tolerance) << "sample " << k;
    for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
      if (!entry_.adds_torque() || (entry_.info->adds_to & effects::on(balance)) == 0) continue;
      const double torque_base = balance == Balance::motor ? drive.torque_base : drive.output_torque_base;
      Values there(record.size(), 0.0), there_per_unit(record.size(), 0.0);
      entry_.real.torque(parameters.data(), si_drive(), balance, inputs_of<Real>(record, si_drive()), there.data());
      entry_.real.torque(parameters.data(), drive, balance, inputs_of<Real>(record, drive), there_per_unit.data());
      ASSERT_GT(largest(there), 0.0);
      const double tolerance_there = 1e-11 * largest(there);
      for (std::size_t k = 0; k < record.size(); ++k)
        ASSERT_NEAR(there_per_unit[k] * torque_base, there[k], tolerance_there) << "sample " << k;
    }
  }
}

TEST_P(EveryEffect, DualDerivativesAgreeWithFiniteDifferencesForEachParameter) {
  // Dozens of weights are as good as many runs.
  const int runs = entry_.parameters.size() > 10 ? 1 : 3;
  for (int run = 0; run < runs; ++run) {
    const Record record = random_record(random_);
    // Reduced, as a search moves them: else a ratio meets its bound from one side only.
    const Values parameters = random_reduced(entry_, random_);
    const auto answer = [&](const Values& reduced) {
      return response<Real>(entry_, catalogue::natural(entry_, reduced), record);
    };
    const Values value = answer(parameters);
    const double rounding = 1e-14 * largest(value);
    for (std::size_t which = 0; which < parameters.size(); ++which) {
      std::vector<Jet> seeded(parameters.begin(), parameters.end());
      seeded[which].v[0] = 1.0;
      const std::vector<Jet> dual = response<Dual>(entry_, catalogue::natural(entry_, seeded), record);

      const double step = 1e-5 * std::abs(parameters[which]);
      Values above = parameters;
      Values below = parameters;
      above[which] += step;
      below[which] -= step;
      const Values high = answer(above);
      const Values low = answer(below);
      Values difference;
      for (std::size_t k = 0; k < record.size(); ++k) difference.push_back((high[k] - low[k]) / (2.0 * step));
      ASSERT_GT(largest(difference), 0.0) << entry_.parameters[which].name << " has no influence";
      // Of a ripple at 12 times 40 rad the third derivative by the order is large; differences are rounded.
      const double allowed = 5e-5 * largest(difference) + rounding / step;
      std::size_t off = 0;
      for (std::size_t k = 0; k < record.size(); ++k) {
        ASSERT_NEAR(dual[k].a, value[k], rounding);
        if (!(std::abs(dual[k].v[0] - difference[k]) <= allowed)) ++off;
      }
      // A sample may stand on a corner, where a slope has two values.
      ASSERT_LE(off, record.size() / 100) << entry_.parameters[which].name;
    }
  }
}

TEST_P(EveryEffect, IsProportionalToItsLinearParameters) {
  const Record record = random_record(random_);
  const Values parameters = random_reduced(entry_, random_);
  if (entry_.count(Kind::linear) == 0) return;
  const auto answer = [&](const Values& reduced) {
    return response<Real>(entry_, catalogue::natural(entry_, reduced), record);
  };
  const Values all = answer(parameters);
  const double rounding = 1e-12 * largest(all);
  Values sum(record.size(), 0.0);
  for (std::size_t which = 0; which < parameters.size(); ++which) {
    if (entry_.parameters[which].kind != Kind::linear) continue;
    Values one = parameters;  // this linear parameter alone
    for (std::size_t other = 0; other < one.size(); ++other)
      if (other != which && entry_.parameters[other].kind == Kind::linear) one[other] = 0.0;
    Values more = one;
    more[which] *= -3.0;
    const Values single = answer(one);
    const Values triple = answer(more);
    for (std::size_t k = 0; k < record.size(); ++k) {
      ASSERT_NEAR(triple[k], -3.0 * single[k], rounding);
      sum[k] += single[k];
    }
  }
  for (std::size_t k = 0; k < record.size(); ++k) ASSERT_NEAR(sum[k], all[k], rounding);
}

// Sources without memory: those that resist motion whatever the other signals are, and those that need not.
const std::set<std::string, std::less<>> kResist = {
    "viscous_friction",   "coulomb_friction",        "stribeck_gaussian",       "stribeck_hess_soom",
    "power_law_friction", "quadratic_drag",          "load_dependent_friction", "load_dependent_stiction",
    "structural_damping", "output_viscous_friction", "output_coulomb_friction"};
const std::string_view kNeedNotResist =
    "angle_dependent_friction,coulomb_asymmetry,cubic_stiffness,current_offset,current_saturation,gravity,inertia,"
    "linear_stiffness,load_scaled_ripple,output_inertia,piecewise_stiffness,quadratic_stiffness,torque_bias,"
    "torque_constant_error,torque_constant_saturation,torque_offset,torque_ripple,torque_sensor_gain,"
    "torque_sensor_ripple,viscous_asymmetry";

TEST(FrictionEffects, EachLawWithoutMemorySaysWhetherItResistsMotion) {
  std::set<std::string, std::less<>> named = kResist;
  for (const std::string_view name : catalogue::split_names(kNeedNotResist))
    EXPECT_TRUE(named.emplace(name).second) << name << " is listed twice";
  for (const Entry& entry : catalogue::all())
    if (entry.info->phase == catalogue::Phase::source && !entry.has_state &&
        named.erase(std::string(entry.name())) == 0)
      ADD_FAILURE() << entry.name() << ": write it into kResist or kNeedNotResist";
  for (const std::string& name : named) ADD_FAILURE() << name << " is no source without memory";
}

// At rest static friction is the simulator's to solve: no effect may push by a sign that is not there.
TEST(FrictionEffects, ResistMotionAndAreZeroAtRest) {
  std::mt19937 random(9);
  const Record record = random_record(random);
  for (const std::string& name : kResist) {
    const Entry& entry = catalogue::get(name);
    Values parameters;
    for (const auto& info : entry.parameters) parameters.push_back(info.usual);
    const Values torque = response<Real>(entry, parameters, record);
    for (std::size_t k = 0; k < record.size(); ++k) {
      const Instant& x = record[k];
      const double motion = entry.info->balance == Balance::motor          ? x.w
                            : entry.info->balance == Balance::transmission ? x.v
                                                                           : x.wo;
      if (motion == 0.0)
        ASSERT_EQ(torque[k], 0.0) << name;
      else
        ASSERT_GE(torque[k] * motion, 0.0) << name;
    }
  }
}

}  // namespace
}  // namespace flexspline::tests::effects_equations_test
