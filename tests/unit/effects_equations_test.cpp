// Every effect of the catalogue against its equation, written out a second time here with <cmath> in SI units.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "host/catalogue/catalogue.hpp"

namespace flexspline::tests {
namespace {

using catalogue::Balance;
using catalogue::Dual;
using catalogue::Entry;
using catalogue::Kind;
using catalogue::Phase;
using catalogue::Real;
using effects::DriveConstants;
using effects::Inputs;
using numbers::Jet;

constexpr std::size_t kSamples = 400;
constexpr double kGearRatio = 100.0;
constexpr double kTorqueConstant = 0.0543;
constexpr double kRatedVelocity = 180.0;
constexpr double kReferenceTemperature = 25.0;

// What a sensor would say of one instant, SI, names as in the catalogue of effects.
struct Instant {
  double w, q, a, qo, wo, ao, dq, v, T, i, temp;
};
using Record = std::vector<Instant>;

double s(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

// A path of the motor with stops and reversals; other signals vary on their own so that no two terms look alike.
Record random_record(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Record record;
  double angle = 40.0 * unit(random);
  for (std::size_t k = 0; k < kSamples; ++k) {
    const bool rest = k % 11 == 0;
    const bool slow = k % 3 == 0;
    const double velocity = rest ? 0.0 : (slow ? 6.0 : 200.0) * unit(random);
    angle += 1e-3 * velocity;
    const double output_velocity = k % 7 == 0 ? 0.0 : 2.0 * unit(random);
    record.push_back({velocity, angle, 2000.0 * unit(random), 3.0 * unit(random), output_velocity, 20.0 * unit(random),
                      1e-3 * unit(random), k % 5 == 0 ? 0.0 : 0.1 * unit(random), 40.0 * unit(random),
                      3.0 * unit(random), 30.0 + 25.0 * unit(random)});
  }
  return record;
}

DriveConstants<double> si_drive() {
  DriveConstants<double> drive;
  drive.gear_ratio = kGearRatio;
  drive.torque_constant = kTorqueConstant;
  drive.rated_velocity = kRatedVelocity;
  drive.reference_temperature = kReferenceTemperature;
  return drive;
}

template <class N>
DriveConstants<typename N::Parameter> in_numbers(const DriveConstants<double>& d) {
  using P = typename N::Parameter;
  return {P(d.gear_ratio),           P(d.torque_constant),   P(d.rated_velocity),           P(d.reference_temperature),
          P(d.turn_angle_scale),     P(d.torque_base),       P(d.output_torque_base),       P(d.velocity_base),
          P(d.output_velocity_base), P(d.acceleration_base), P(d.output_acceleration_base), P(d.angle_base),
          P(d.torsion_base),         P(d.torsion_rate_base), P(d.temperature_base)};
}

template <class N>
std::vector<Inputs<N>> inputs_of(const Record& record, const DriveConstants<double>& d) {
  using V = typename N::Value;
  std::vector<Inputs<N>> inputs;
  for (const Instant& x : record) {
    Inputs<N> in;
    in.angle = V(x.q / d.angle_base);
    in.velocity = V(x.w / d.velocity_base);
    in.speed = V(std::abs(x.w) / d.velocity_base);
    in.direction = V(s(x.w));
    in.acceleration = V(x.a / d.acceleration_base);
    in.output_angle = V(x.qo);
    in.output_velocity = V(x.wo / d.output_velocity_base);
    in.output_direction = V(s(x.wo));
    in.output_acceleration = V(x.ao / d.output_acceleration_base);
    in.torsion = V(x.dq / d.torsion_base);
    in.torsion_rate = V(x.v / d.torsion_rate_base);
    in.torsion_direction = V(s(x.v));
    in.torque = V(x.T / d.output_torque_base);
    in.torque_magnitude = V(std::abs(x.T) / d.output_torque_base);
    in.current = V(x.i);
    in.temperature = V(x.temp / d.temperature_base);
    in.viscous_scale = V(1.0);
    in.coulomb_scale = V(1.0);
    inputs.push_back(in);
  }
  return inputs;
}

template <class N>
const catalogue::Along<N>& along(const Entry& entry) {
  if constexpr (std::is_same_v<N, Dual>)
    return entry.dual;
  else
    return entry.real;
}

// What an effect does along a record: its torque, or for a shift the torsion after it, or for a modulation the factor.
template <class N>
std::vector<typename N::Value> response(const Entry& entry, const std::vector<typename N::Parameter>& parameters,
                                        const Record& record, const DriveConstants<double>& drive = si_drive()) {
  std::vector<Inputs<N>> inputs = inputs_of<N>(record, drive);
  std::vector<typename N::Value> result(record.size(), typename N::Value(0.0));
  if (entry.info->phase == Phase::source) {
    along<N>(entry).torque(parameters.data(), in_numbers<N>(drive), entry.info->balance, inputs, result.data());
  } else {
    along<N>(entry).change(parameters.data(), in_numbers<N>(drive), inputs);
    for (std::size_t k = 0; k < inputs.size(); ++k)
      result[k] = entry.info->phase == Phase::shift ? inputs[k].torsion : inputs[k].viscous_scale;
  }
  return result;
}

using Values = std::vector<double>;
using Truth = std::function<Values(const Values& p, const Record& record)>;

Truth each(std::function<double(const Values& p, const Instant& x)> term) {
  return [term](const Values& p, const Record& record) {
    Values result;
    for (const Instant& x : record) result.push_back(term(p, x));
    return result;
  };
}

// z' = w (1 - s(w) sigma z / Ts) by Runge and Kutta over the travel, in many steps a sample.
Values dahl_truth(const Values& p, const Record& record) {
  const double torque = p[0];
  const double sigma = p[0] / p[1];
  double z = 0.0;
  Values result;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const double travel = k == 0 ? 0.0 : record[k].q - record[k - 1].q;
    const int steps = 20 + static_cast<int>(40.0 * std::abs(travel) / p[1]);
    const double h = travel / steps;
    const auto slope = [&](double at) { return 1.0 - s(travel) * sigma * at / torque; };
    for (int n = 0; n < steps; ++n) {
      const double k1 = slope(z);
      const double k2 = slope(z + 0.5 * h * k1);
      const double k3 = slope(z + 0.5 * h * k2);
      const double k4 = slope(z + h * k3);
      z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    result.push_back(sigma * z);
  }
  return result;
}

const std::map<std::string, Truth, std::less<>>& truths() {
  static const std::map<std::string, Truth, std::less<>> table = {
      {"inertia", each([](const Values& p, const Instant& x) { return p[0] * x.a; })},
      {"viscous_friction", each([](const Values& p, const Instant& x) { return p[0] * x.w; })},
      {"coulomb_friction", each([](const Values& p, const Instant& x) { return p[0] * s(x.w); })},
      {"viscous_asymmetry", each([](const Values& p, const Instant& x) { return p[0] * std::abs(x.w); })},
      {"coulomb_asymmetry", each([](const Values& p, const Instant& x) { return x.w != 0.0 ? p[0] : 0.0; })},
      {"stribeck_gaussian", each([](const Values& p, const Instant& x) {
         const double amplitude = x.w > 0.0 ? p[0] : p[1];
         return s(x.w) * amplitude * std::exp(-(x.w / p[2]) * (x.w / p[2]));
       })},
      {"power_law_friction", each([](const Values& p, const Instant& x) {
         return p[0] * std::pow(std::abs(x.w / kRatedVelocity), p[1]) * s(x.w);
       })},
      {"load_dependent_friction",
       each([](const Values& p, const Instant& x) { return p[0] * std::abs(x.T) / kGearRatio * s(x.w); })},
      // The factor on viscous friction; the term itself has a test of its own below.
      {"temperature_viscous",
       each([](const Values& p, const Instant& x) { return std::exp(-p[0] * (x.temp - kReferenceTemperature)); })},
      {"dahl_friction", dahl_truth},
      {"torque_ripple", each([](const Values& p, const Instant& x) {
         return p[1] * std::cos(p[0] * x.q) + p[2] * std::sin(p[0] * x.q);
       })},
      {"current_offset", each([](const Values& p, const Instant&) { return kTorqueConstant * p[0]; })},
      {"torque_bias", each([](const Values& p, const Instant&) { return p[0]; })},
      {"linear_stiffness", each([](const Values& p, const Instant& x) { return p[0] * x.dq; })},
      {"structural_damping",
       each([](const Values& p, const Instant& x) { return p[0] * std::pow(std::abs(x.v), p[1]) * s(x.v); })},
      // The torsion that is left for the spring.
      {"backlash",
       each([](const Values& p, const Instant& x) { return std::abs(x.dq) <= p[0] ? 0.0 : x.dq - s(x.dq) * p[0]; })},
      {"output_inertia", each([](const Values& p, const Instant& x) { return p[0] * x.ao; })},
      {"output_viscous_friction", each([](const Values& p, const Instant& x) { return p[0] * x.wo; })},
      {"output_coulomb_friction", each([](const Values& p, const Instant& x) { return p[0] * s(x.wo); })},
      {"gravity", each([](const Values& p, const Instant& x) {
         return std::hypot(p[0], p[1]) * std::sin(x.qo + std::atan2(p[0], p[1]));
       })},
  };
  return table;
}

// Sizes about the usual one, within bounds; signs that bounds leave open are drawn.
Values random_parameters(const Entry& entry, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Values values;
  for (const auto& info : entry.parameters) {
    double value = info.usual != 0.0 ? info.usual : 0.003;
    if (info.kind == Kind::given) {
      value = std::vector<double>{1.0, 2.0, 4.0, 12.0, 0.5}[random() % 5];
    } else {
      value *= 0.4 + 2.0 * unit(random);
      if (info.low < 0.0 && unit(random) < 0.5) value = -value;
    }
    values.push_back(std::clamp(value, info.low, info.high));
  }
  return values;
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
    const double tolerance = (entry_.has_state ? 1e-7 : 1e-12) * largest(expected);  // Runge-Kutta; rounding
    for (std::size_t k = 0; k < record.size(); ++k) ASSERT_NEAR(given[k], expected[k], tolerance) << "sample " << k;
  }
}

TEST_P(EveryEffect, AddsToItsOwnBalanceAndLeavesTheOthersAlone) {
  const Record record = random_record(random_);
  const Values parameters = random_parameters(entry_, random_);
  const std::vector<Inputs<Real>> inputs = inputs_of<Real>(record, si_drive());
  if (entry_.info->phase == Phase::source) {
    ASSERT_EQ(entry_.real.change, nullptr);
    const Values alone = response<Real>(entry_, parameters, record);
    for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
      Values torque(record.size(), 0.25);
      entry_.real.torque(parameters.data(), si_drive(), balance, inputs, torque.data());
      for (std::size_t k = 0; k < record.size(); ++k)
        ASSERT_DOUBLE_EQ(torque[k], 0.25 + (balance == entry_.info->balance ? alone[k] : 0.0));
    }
  } else {
    ASSERT_EQ(entry_.real.torque, nullptr);
    std::vector<Inputs<Real>> changed = inputs;
    entry_.real.change(parameters.data(), si_drive(), changed);
    for (std::size_t k = 0; k < record.size(); ++k) {
      changed[k].torsion = entry_.info->phase == Phase::shift ? inputs[k].torsion : changed[k].torsion;
      changed[k].viscous_scale = entry_.info->phase == Phase::modulate ? 1.0 : changed[k].viscous_scale;
      ASSERT_EQ(std::memcmp(&changed[k], &inputs[k], sizeof(Inputs<Real>)), 0) << "another signal was changed";
    }
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
                      &drive.torsion_rate_base, &drive.temperature_base})
      *b = base();
    drive.turn_angle_scale = drive.angle_base;  // radians of motor turn per unit of motor position
    const double result_base = entry_.info->phase == Phase::shift       ? drive.torsion_base
                               : entry_.info->phase == Phase::modulate  ? 1.0
                               : entry_.info->balance == Balance::motor ? drive.torque_base
                                                                        : drive.output_torque_base;
    const Record record = random_record(random_);
    const Values parameters = random_parameters(entry_, random_);
    const Values si = response<Real>(entry_, parameters, record);
    const Values per_unit = response<Real>(entry_, parameters, record, drive);
    for (std::size_t k = 0; k < record.size(); ++k)
      ASSERT_NEAR(per_unit[k] * result_base, si[k], 1e-11 * largest(si)) << "sample " << k;
  }
}

TEST_P(EveryEffect, DualDerivativesAgreeWithFiniteDifferencesForEachParameter) {
  for (int run = 0; run < 3; ++run) {
    const Record record = random_record(random_);
    const Values parameters = random_parameters(entry_, random_);
    const Values value = response<Real>(entry_, parameters, record);
    for (std::size_t which = 0; which < parameters.size(); ++which) {
      std::vector<Jet> seeded(parameters.begin(), parameters.end());
      seeded[which].v[0] = 1.0;
      const std::vector<Jet> dual = response<Dual>(entry_, seeded, record);

      const double step = 1e-5 * std::abs(parameters[which]);
      Values above = parameters;
      Values below = parameters;
      above[which] += step;
      below[which] -= step;
      const Values high = response<Real>(entry_, above, record);
      const Values low = response<Real>(entry_, below, record);
      Values difference;
      for (std::size_t k = 0; k < record.size(); ++k) difference.push_back((high[k] - low[k]) / (2.0 * step));
      ASSERT_GT(largest(difference), 0.0) << entry_.parameters[which].name << " has no influence";
      for (std::size_t k = 0; k < record.size(); ++k) {
        ASSERT_NEAR(dual[k].a, value[k], 1e-14 * largest(value));
        // Of a ripple at 12 times 40 rad the third derivative by the order is large.
        ASSERT_NEAR(dual[k].v[0], difference[k], 1e-5 * largest(difference))
            << entry_.parameters[which].name << ", sample " << k;
      }
    }
  }
}

TEST_P(EveryEffect, IsProportionalToItsLinearParameters) {
  const Record record = random_record(random_);
  const Values parameters = random_parameters(entry_, random_);
  if (entry_.count(Kind::linear) == 0) {
    EXPECT_NE(entry_.info->phase, Phase::source) << "a source has at least one linear parameter";
    return;
  }
  const Values all = response<Real>(entry_, parameters, record);
  Values sum(record.size(), 0.0);
  for (std::size_t which = 0; which < parameters.size(); ++which) {
    if (entry_.parameters[which].kind != Kind::linear) continue;
    Values one = parameters;  // this linear parameter alone
    for (std::size_t other = 0; other < one.size(); ++other)
      if (other != which && entry_.parameters[other].kind == Kind::linear) one[other] = 0.0;
    Values more = one;
    more[which] *= -3.0;
    const Values single = response<Real>(entry_, one, record);
    const Values triple = response<Real>(entry_, more, record);
    for (std::size_t k = 0; k < record.size(); ++k) {
      ASSERT_NEAR(triple[k], -3.0 * single[k], 1e-12 * largest(all));
      sum[k] += single[k];
    }
  }
  for (std::size_t k = 0; k < record.size(); ++k) ASSERT_NEAR(sum[k], all[k], 1e-12 * largest(all));
}

// At rest static friction is the simulator's to solve: no effect may push by a sign that is not there.
TEST(FrictionEffects, ResistMotionAndAreNoughtAtRest) {
  std::mt19937 random(9);
  const Record record = random_record(random);
  for (const char* name :
       {"viscous_friction", "coulomb_friction", "stribeck_gaussian", "power_law_friction", "load_dependent_friction",
        "structural_damping", "output_viscous_friction", "output_coulomb_friction"}) {
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
}  // namespace flexspline::tests
