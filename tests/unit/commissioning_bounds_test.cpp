// What a host may ask commissioning for: any settings that pass the check run to an end within their time, on a motor
// and on readings that mean nothing, without overflow (which the sanitizers of this build would stop).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/commissioning_rig.hpp"

namespace flexspline::commissioning_rig::commissioning_bounds_test {
namespace {

using commissioning::Settings;

// From `low` to `high`, each power of two as likely as another; now and then the bounds themselves.
std::int32_t anything(std::mt19937_64& random, std::int32_t low, std::int32_t high) {
  const auto kind = random() % 8;
  if (kind == 0) return low;
  if (kind == 1) return high;
  const double from = std::log(std::max(low, 1)), to = std::log(static_cast<double>(high));
  const double drawn = std::exp(from + (to - from) * std::ldexp(static_cast<double>(random() >> 11), -53));
  return std::clamp(static_cast<std::int32_t>(std::min(drawn, 2147483000.0)), low, high);
}
Settings drawn_settings(std::mt19937_64& random, const Bench& b) {
  Settings s = deployment::commissioning_settings(setup_of(b));
  const auto change = [&](std::int32_t& x, std::int32_t low, std::int32_t high) {
    if (random() % 3 == 0) x = anything(random, low, high);
  };
  do {
    s.most_current = s.current + s.current / 2;
    change(s.current, 1 << 20, 1 << 27);
    change(s.most_current, 1 << 20, 1 << 27);
    change(s.most_voltage, 1, 1 << 27);
    change(s.voltage_ramp, 1, 1 << 27);
    change(s.slow_step, 1, 1 << 26);
    change(s.fast_step, 1, 1 << 26);
    change(s.most_shaft_step, 1, 1 << 26);
    change(s.step_ramp, 1, 1 << 21);
    change(s.most_travel, 1, INT32_MAX);
    change(s.stated_pole_pairs, 0, 40);
    change(s.least_bus, 0, INT16_MAX);
  } while (!valid(s));
  s.most_periods = 20'000 + static_cast<std::int32_t>(random() % 60'000);
  return s;
}

struct Finding {
  std::int32_t periods = 0;
  bool counts_fit = true;
};
Finding on_motor(const Bench& b, const Settings& s, std::uint64_t seed) {
  motor::PowerStage stage(b.motor, b.inverter, b.sensors, motor::Fidelity::averaged, b.wiring);
  motor::Shunts shunts(b.sensors, seed);
  motor::Shaft shaft(b.shaft, b.motor.pole_pairs);
  motor::ShaftEncoder encoder(b.encoder);
  commissioning::Commissioning control;
  control.begin(s);
  motor::Triple duties{};
  Finding run;
  while (!control.done()) {
    const motor::Sample sample = stage.run(duties, shaft.electrical());
    shaft.step(sample.torque_nm, stage.period_s());
    const motor::Readings r = shunts.read(sample);
    const auto out = control.update({{r.current[0], r.current[1], r.current[2]}, r.bus, encoder.read(shaft.turns())});
    for (const std::int32_t count : {out.counts.a, out.counts.b, out.counts.c})
      run.counts_fit = run.counts_fit && count >= 0 && count <= s.timer_counts;
    const double all = s.timer_counts;
    duties = {out.counts.a / all, out.counts.b / all, out.counts.c / all};
  }
  run.periods = control.periods();
  return run;
}
// Readings of every kind: of the converter's whole range, small ones, and ones that stay.
Finding on_anything(std::mt19937_64& random, const Settings& s) {
  commissioning::Commissioning control;
  control.begin(s);
  Finding run;
  const std::uint64_t spread = std::uint64_t{1} << (random() % 16);
  std::uint32_t encoder = 0;
  while (!control.done()) {
    const auto reading = [&] {
      return static_cast<std::int32_t>(random() % (2 * spread)) - static_cast<std::int32_t>(spread);
    };
    encoder += static_cast<std::uint32_t>(random() >> (random() % 64));
    const auto bus =
        static_cast<std::int32_t>(s.least_bus + random() % (32768 - static_cast<std::uint64_t>(s.least_bus)));
    const auto out = control.update({{reading(), reading(), reading()}, bus, encoder});
    for (const std::int32_t count : {out.counts.a, out.counts.b, out.counts.c})
      run.counts_fit = run.counts_fit && count >= 0 && count <= s.timer_counts;
  }
  run.periods = control.periods();
  return run;
}

TEST(CommissioningBounds, AnySettingsThatPassTheCheckEndInTimeOnAMotor) {
  std::mt19937_64 random(11);
  int measured = 0;
  for (int k = 0; k < 60; ++k) {
    const Bench b = random_bench(random);
    const Settings s = drawn_settings(random, b);
    const Finding run = on_motor(b, s, random());
    EXPECT_LE(run.periods, s.most_periods + 1) << k;
    EXPECT_TRUE(run.counts_fit) << k;
    measured += run.periods > 10'000 ? 1 : 0;
  }
  EXPECT_GT(measured, 5) << "some get as far as to turn";
}
TEST(CommissioningBounds, AnySettingsThatPassTheCheckEndInTimeOnReadingsThatMeanNothing) {
  std::mt19937_64 random(12);
  for (int k = 0; k < 200; ++k) {
    const Settings s = drawn_settings(random, Bench{});
    const Finding run = on_anything(random, s);
    EXPECT_LE(run.periods, s.most_periods + 1) << k;
    EXPECT_TRUE(run.counts_fit) << k;
  }
}
TEST(CommissioningBounds, SettingsOutsideOfThemAreNotValid) {
  const Settings good = deployment::commissioning_settings(setup_of(Bench{}));
  EXPECT_TRUE(valid(good));
  const auto is_valid = [&](std::int32_t Settings::*member, std::int32_t value) {
    Settings s = good;
    s.*member = value;
    return valid(s);
  };
  for (const auto member :
       {&Settings::current, &Settings::most_current, &Settings::most_voltage, &Settings::voltage_ramp,
        &Settings::slow_step, &Settings::fast_step, &Settings::most_shaft_step, &Settings::step_ramp,
        &Settings::most_travel, &Settings::most_periods, &Settings::least_bus, &Settings::timer_counts}) {
    EXPECT_FALSE(is_valid(member, 0));
    EXPECT_FALSE(is_valid(member, INT32_MAX));
    EXPECT_FALSE(is_valid(member, INT32_MIN));
  }
  EXPECT_FALSE(is_valid(&Settings::stated_pole_pairs, 41));
}

}  // namespace
}  // namespace flexspline::commissioning_rig::commissioning_bounds_test
