// Commissioning of two hundred random motors, and of each fault on many of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/support/campaign_size.hpp"
#include "tests/support/closed_loop_runs.hpp"
#include "tests/support/commissioning_faults.hpp"

namespace flexspline::commissioning_rig::commissioning_test {
namespace {

struct Errors {
  double resistance = 0.0, inductance_d = 0.0, inductance_q = 0.0, flux = 0.0, offset_degrees = 0.0, gain = 0.0;
};
// Currents are known up to what the gains of all sensors have in common; so are the figures that are made of them.
Errors errors_of(const Bench& b, const Outcome& o) {
  const double g = common_gain(b), off = o.found.offset_turns - true_offset_turns(b);
  Errors e;
  e.resistance = o.found.resistance_ohm * g / (b.motor.resistance_ohm + b.inverter.on_resistance_ohm) - 1.0;
  e.inductance_d = o.found.inductance_d_h * g / b.motor.inductance_d_h - 1.0;
  e.inductance_q = o.found.inductance_q_h * g / b.motor.inductance_q_h - 1.0;
  e.flux = o.found.flux_vs / b.motor.flux_vs - 1.0;
  e.offset_degrees = (off - std::round(off)) * 360.0;
  for (std::size_t x = 0; x < 3; ++x)
    e.gain = std::max(e.gain, std::abs(o.found.gain[x] * b.sensors.gain[x] / g - 1.0));
  return e;
}
std::vector<Bench> random_benches(std::size_t motors, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Bench> benches;
  for (std::size_t k = 0; k < motors; ++k) benches.push_back(random_bench(random));
  return benches;
}
void check_motors(const char* what, std::size_t motors, motor::Fidelity fidelity, std::uint64_t seed) {
  const std::vector<Bench> benches = random_benches(motors, seed);
  std::vector<Outcome> outcomes(motors);
  tests::on_all_cores(motors,
                      [&](std::size_t k) { outcomes[k] = commission(benches[k], setup_of(benches[k]), fidelity); });
  Errors worst;
  double longest = 0.0, current = 0.0, travel = 0.0;
  for (std::size_t k = 0; k < motors; ++k) {
    const Bench& b = benches[k];
    const Outcome& o = outcomes[k];
    EXPECT_EQ(name_of(o.result.fault), "none") << k;
    const Errors e = errors_of(b, o);
    EXPECT_LE(std::abs(e.resistance), 0.03) << k;
    EXPECT_LE(std::abs(e.inductance_d), 0.05) << k;
    EXPECT_LE(std::abs(e.inductance_q), 0.05) << k;
    EXPECT_LE(std::abs(e.flux), 0.02) << k;
    EXPECT_EQ(o.found.pole_pairs, b.motor.pole_pairs) << k;
    EXPECT_EQ(o.found.reversed, (b.wiring.motor_phase[1] == 2) != b.encoder.reversed) << k;
    EXPECT_LE(std::abs(e.offset_degrees), 3.0) << k;
    const auto more = [](double& x, double y) { x = std::max(x, std::abs(y)); };
    more(worst.resistance, e.resistance);
    more(worst.inductance_d, e.inductance_d);
    more(worst.inductance_q, e.inductance_q);
    more(worst.flux, e.flux);
    more(worst.offset_degrees, e.offset_degrees);
    more(worst.gain, e.gain);
    longest = std::max(longest, o.time_s);
    current = std::max(current, o.most_current_a);
    travel = std::max(travel, o.travel_turns);
  }
  std::printf(
      "%s, %zu motors: at most R %.2f %%, Ld %.2f %%, Lq %.2f %%, flux %.2f %%, angle %.2f degrees electrical, "
      "gains %.3f %%; up to %.1f s, %.1f A of a test of 10 A, %.1f turns\n",
      what, motors, 100.0 * worst.resistance, 100.0 * worst.inductance_d, 100.0 * worst.inductance_q,
      100.0 * worst.flux, worst.offset_degrees, 100.0 * worst.gain, longest, current, travel);
}

TEST(Commissioning, RandomMotorsAreMeasuredAndNoFaultIsSeen) {
  check_motors("averaged", tests::in_campaign<std::size_t>(30, 200), motor::Fidelity::averaged, 5);
}
TEST(Commissioning, OnTheSwitchedPowerStageItMeasuresTheSame) {
  check_motors("switched", tests::in_campaign<std::size_t>(1, 20), motor::Fidelity::switched, 21);
  check_motors("switched", tests::in_campaign<std::size_t>(1, 40), motor::Fidelity::switched, 8021);
}

// A rotor with harmonics of the magnet's flux jumps from one place to the next while a current turns slowly. That is no
// slipping encoder; the motor is measured, less exactly where it may stand at either side of a place.
TEST(Commissioning, HarmonicsOfTheMagnetsFluxAreNoFault) {
  const std::size_t motors = tests::in_campaign<std::size_t>(10, 200);
  std::vector<Bench> benches = random_benches(motors, 337);
  for (std::size_t k = 0; k < motors; ++k) {
    benches[k].motor.harmonic_5 = k % 2 == 0 ? 0.06 : -0.06;
    benches[k].motor.harmonic_7 = 0.01;
  }
  std::vector<Outcome> outcomes(motors);
  tests::on_all_cores(motors, [&](std::size_t k) { outcomes[k] = commission(benches[k], setup_of(benches[k])); });
  std::size_t faults = 0, wide = 0;
  for (std::size_t k = 0; k < motors; ++k) {
    const Outcome& o = outcomes[k];
    if (o.result.fault != Fault::none) {
      // A fast motor that jumps induces a current beyond the limit of the test.
      EXPECT_EQ(name_of(o.result.fault), "overcurrent") << k;
      ++faults;
      continue;
    }
    EXPECT_EQ(o.found.pole_pairs, benches[k].motor.pole_pairs) << k;
    EXPECT_EQ(o.found.reversed, (benches[k].wiring.motor_phase[1] == 2) != benches[k].encoder.reversed) << k;
    const Errors e = errors_of(benches[k], o);
    if (std::abs(e.resistance) > 0.03 || std::abs(e.inductance_d) > 0.05 || std::abs(e.inductance_q) > 0.05 ||
        std::abs(e.flux) > 0.02)
      ++wide;
  }
  std::printf("6 %% of a fifth harmonic, %zu motors: %zu end with overcurrent, %zu outside of the bounds\n", motors,
              faults, wide);
  EXPECT_LE(50 * faults, motors);
  EXPECT_LE(50 * wide, motors);
}

TEST(Commissioning, EveryFaultIsNamedAndNoneMistaken) {
  std::vector<FaultCase> cases;
  const int each = tests::in_campaign(4, 50);
  for (const Fault fault : kBenchFaults) {
    std::mt19937_64 random(100 + static_cast<std::uint64_t>(fault));
    for (int k = 0; k < each; ++k) cases.push_back(random_fault(fault, random));
  }
  std::vector<Outcome> outcomes(cases.size());
  tests::on_all_cores(cases.size(), [&](std::size_t k) { outcomes[k] = commission(cases[k].bench, cases[k].setup); });
  int named = 0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const auto& r = outcomes[k].result;
    EXPECT_EQ(name_of(r.fault), name_of(cases[k].fault)) << k;
    if (cases[k].phase != 0) {
      EXPECT_EQ(r.phase, cases[k].phase) << k << " " << name_of(r.fault);
    }
    if (r.fault == cases[k].fault) ++named;
  }
  std::printf("%d of %zu faults named\n", named, cases.size());
}

}  // namespace
}  // namespace flexspline::commissioning_rig::commissioning_test
