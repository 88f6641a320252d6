// Laws with memory along a smooth motion, against the rate form of their equations by Runge and Kutta in time. There
// the step of a law is not exact: a sample misses the turning point, and speed, load and phi change within a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::tests::effects_rate_form_test {
namespace {

using catalogue::Entry;
using catalogue::Real;
using effects::DriveConstants;
using effects::Inputs;
using Values = std::vector<double>;

constexpr double kDuration = 2.0;  // s
constexpr double kTorqueConstant = 0.0543;

double s(double x) {
  return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
}

// A motion of which every derivative is known: the sum of two sines, at zero at the beginning.
struct TwoSines {
  double size, slow, fast;
  double at(double t) const { return size * (std::sin(slow * t) + 0.6 * std::sin(fast * t)); }
  double rate(double t) const { return size * (slow * std::cos(slow * t) + 0.6 * fast * std::cos(fast * t)); }
};
constexpr TwoSines kAngle{0.3, 6.0, 19.0};
constexpr TwoSines kTorsion{1e-3, 6.0, 19.0};
constexpr TwoSines kTorque{20.0, 5.0, 13.0};

Inputs<Real> inputs_at(double t, double sample) {
  Inputs<Real> in;
  in.angle = kAngle.at(t);
  in.velocity = kAngle.rate(t);
  in.speed = std::abs(in.velocity);
  in.direction = s(in.velocity);
  in.torsion = kTorsion.at(t);
  in.torsion_rate = kTorsion.rate(t);
  in.torsion_direction = s(in.torsion_rate);
  in.torque = kTorque.at(t);
  in.torque_magnitude = std::abs(in.torque);
  in.viscous_scale = in.coulomb_scale = 1.0;
  in.elapsed = sample;
  return in;
}

Values torque_of(const Entry& entry, const Values& parameters, double sample) {
  std::vector<Inputs<Real>> inputs;
  const auto samples = static_cast<std::size_t>(std::lround(kDuration / sample));
  for (std::size_t k = 0; k <= samples; ++k) inputs.push_back(inputs_at(static_cast<double>(k) * sample, sample));
  Values torque(inputs.size(), 0.0);
  DriveConstants<double> drive;
  drive.torque_constant = kTorqueConstant;
  entry.real.torque(parameters.data(), drive, entry.info->balance, inputs, torque.data());
  return torque;
}

struct RateForm {
  std::string_view effect;
  Values parameters;
  std::function<double(const Values& p, double z, double t)> rate;    // dz/dt
  std::function<double(const Values& p, double z, double t)> torque;  // of the state
  // Of the largest torque at samples of 1 ms, in which the torsion goes 3 % of the way through a loop; and the order in
  // the length of a sample.
  double tolerance;
  double order;
};

// At each tenth of a millisecond, in steps of 20 us.
Values solved(const RateForm& law) {
  constexpr double kStep = 2e-5;
  const auto steps = static_cast<std::size_t>(std::lround(kDuration / kStep));
  double z = 0.0;
  Values torque;
  for (std::size_t k = 0; k <= steps; ++k) {
    const double t = static_cast<double>(k) * kStep;
    if (k % 5 == 0) torque.push_back(law.torque(law.parameters, z, t));
    const auto rate = [&](double at, double time) { return law.rate(law.parameters, at, time); };
    const double k1 = rate(z, t);
    const double k2 = rate(z + 0.5 * kStep * k1, t + 0.5 * kStep);
    const double k3 = rate(z + 0.5 * kStep * k2, t + 0.5 * kStep);
    const double k4 = rate(z + kStep * k3, t + kStep);
    z += kStep / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return torque;
}

// Largest difference over the largest torque, where there is one value given for `stride` of those expected.
double difference(const Values& given, const Values& expected, std::size_t stride) {
  double worst = 0.0, largest = 0.0;
  for (std::size_t k = 0; k < given.size(); ++k) {
    worst = std::max(worst, std::abs(given[k] - expected[k * stride]));
    largest = std::max(largest, std::abs(expected[k * stride]));
  }
  return worst / largest;
}

double state_itself(const Values&, double z, double) {
  return z;
}

double dahl_rate(double torque, double sigma, double exponent, double z, double v) {
  const double left = 1.0 - z / torque * s(v);
  return sigma * v * std::pow(std::abs(left), exponent) * s(left);
}

double lugre_limit(const Values& p, double w) {
  return p[0] + (p[1] - p[0]) * std::exp(-(w / p[2]) * (w / p[2]));
}
double lugre_rate(const Values& p, double z, double t) {
  const double w = kAngle.rate(t);
  return w - p[3] * std::abs(w) * z / lugre_limit(p, w);
}

std::vector<RateForm> laws() {
  std::vector<RateForm> list;
  list.push_back(
      {"dahl_friction",
       {0.045, 0.05},
       [](const Values& p, double z, double t) { return dahl_rate(p[0], p[0] / p[1], 1.0, z, kAngle.rate(t)); },
       state_itself,
       1e-3,
       2.0});
  // g is that of the end of each step.
  list.push_back({"lugre_friction",
                  {0.045, 0.07, 2.0, 0.9, 1e-4},
                  lugre_rate,
                  [](const Values& p, double z, double t) { return p[3] * z + p[4] * lugre_rate(p, z, t); },
                  5e-3,
                  1.0});
  for (const double exponent : {0.6, 1.0, 1.5, 3.0})
    list.push_back(
        {"dahl_hysteresis",
         {2.0, 5000.0, exponent},
         [](const Values& p, double z, double t) { return dahl_rate(p[0], p[1], p[2], z, kTorsion.rate(t)); },
         state_itself,
         1e-3,
         2.0});
  list.push_back({"modified_dahl_hysteresis",
                  {2.0, 5000.0},
                  [](const Values& p, double z, double t) { return dahl_rate(p[0], p[1], 2.0, z, kTorsion.rate(t)); },
                  state_itself,
                  1e-3,
                  2.0});
  list.push_back({"duhem_hysteresis",
                  {2500.0, 11300.0, 0.3, 6300.0, 1e5, 3e8},
                  [](const Values& p, double z, double t) {
                    const double x = kTorsion.at(t), v = kTorsion.rate(t);
                    const double phi = p[2] + p[3] * x + p[4] * x * x + p[5] * x * x * x;
                    return p[0] * std::abs(v) * (phi - z) + p[1] * v;
                  },
                  state_itself,
                  1e-3,
                  2.0});
  for (const double exponent : {1.0, 1.5, 2.5})
    list.push_back({"bouc_wen_hysteresis",
                    {5000.0, std::pow(2500.0, exponent), 0.4 * std::pow(2500.0, exponent), exponent},
                    [](const Values& p, double z, double t) {
                      const double v = kTorsion.rate(t), size = std::abs(z);
                      return v - p[1] * std::abs(v) * std::pow(size, p[3] - 1.0) * z - p[2] * v * std::pow(size, p[3]);
                    },
                    [](const Values& p, double z, double) { return p[0] * z; },
                    1e-3,
                    2.0});
  list.push_back({"torque_proportional_hysteresis",
                  {0.5, 0.05, 5000.0},
                  [](const Values& p, double z, double t) {
                    return dahl_rate(p[0] + p[1] * std::abs(kTorque.at(t)), p[2], 1.0, z, kTorsion.rate(t));
                  },
                  state_itself,
                  1e-3,
                  2.0});
  return list;
}

TEST(LawsWithMemory, FollowTheirRateFormAndTheMoreSoTheShorterTheSamples) {
  for (const RateForm& law : laws()) {
    SCOPED_TRACE(law.effect);
    const Entry& entry = catalogue::get(law.effect);
    const Values expected = solved(law);
    const double coarse = difference(torque_of(entry, law.parameters, 1e-3), expected, 10);
    const double fine = difference(torque_of(entry, law.parameters, 1e-4), expected, 1);
    EXPECT_LT(coarse, law.tolerance);
    EXPECT_LT(fine, law.tolerance * std::pow(0.1, law.order));
  }
}

// The delay is that of a first-order all-pass, whose phase at f is short by (2 pi f d)^3/12 of the exact one's.
TEST(CurrentDelay, DelaysASmoothCurrentWithinItsStatedPhaseError) {
  const Entry& entry = catalogue::get("current_delay");
  DriveConstants<double> drive;
  drive.torque_constant = kTorqueConstant;
  const double delay = 1e-3, sample = 1e-5;
  for (const double frequency : {20.0, 60.0, 120.0}) {
    const double omega = 2.0 * std::acos(-1.0) * frequency;
    std::vector<Inputs<Real>> inputs(20000);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      inputs[k].elapsed = sample;
      inputs[k].current = 3.0 * std::sin(omega * sample * static_cast<double>(k));
    }
    Values torque(inputs.size(), 0.0);
    entry.real.torque(&delay, drive, catalogue::Balance::motor, inputs, torque.data());
    double worst = 0.0;
    for (std::size_t k = inputs.size() / 2; k < inputs.size(); ++k) {  // the transient of 1 ms has died away
      const double late = 3.0 * std::sin(omega * (sample * static_cast<double>(k) - delay));
      worst = std::max(worst, std::abs(torque[k] - kTorqueConstant * (inputs[k].current - late)));
    }
    const double stated = 3.0 * kTorqueConstant * std::pow(omega * delay, 3) / 12.0;
    EXPECT_LT(worst, 1.05 * stated) << frequency << " Hz";
    EXPECT_GT(worst, 0.8 * stated) << "the error is what it is said to be, and no less";
  }
}

TEST(CurrentDelay, OfASteadyCurrentIsZeroWhateverTheRecordBeginsWith) {
  const Entry& entry = catalogue::get("current_delay");
  const double delay = 1e-3;
  std::vector<Inputs<Real>> inputs(100);
  for (auto& in : inputs) {
    in.elapsed = 1e-3;
    in.current = 2.5;
  }
  Values torque(inputs.size(), 0.0);
  entry.real.torque(&delay, {}, catalogue::Balance::motor, inputs, torque.data());
  for (const double x : torque) EXPECT_EQ(x, 0.0);
  // On a ramp it is the slope times the delay.
  for (std::size_t k = 0; k < inputs.size(); ++k) inputs[k].current = 0.02 * static_cast<double>(k);
  entry.real.torque(&delay, {}, catalogue::Balance::motor, inputs, torque.data());
  EXPECT_NEAR(torque.back(), 20.0 * delay, 1e-12);
}

}  // namespace
}  // namespace flexspline::tests::effects_rate_form_test
