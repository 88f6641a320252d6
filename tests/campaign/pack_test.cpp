// Parameter blocks of many models: all that are admitted are as near to double as promised, and the proof holds.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "host/catalogue/constants.hpp"
#include "host/deployment/bases.hpp"
#include "host/deployment/pack.hpp"
#include "host/deployment/trial.hpp"

namespace flexspline::tests {
namespace {

using deployment::PackError;
using deployment::PackOptions;

constexpr double kBound = 1e-6;  // of rated torque

// A drive somewhat like the report's with three to eight effects, none of which stands in for another, torques from a
// tenth to three times their usual size, shapes from half to twice.
model::Model random_model(std::mt19937& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto log_between = [&](double low, double high) { return std::exp(between(std::log(low), std::log(high))); };
  model::Model m;
  m.name = "random";
  m.drive.gear_ratio.value = between(50.0, 160.0);
  m.drive.torque_constant_nm_a.value = log_between(0.02, 0.2);
  m.drive.rated_current_a.value = log_between(1.0, 10.0);
  m.drive.rated_velocity_rad_s.value = between(100.0, 400.0);
  m.drive.rated_torque_nm.value = between(20.0, 80.0);
  m.drive.temperature_reference_c.value = between(15.0, 40.0);
  std::vector<const catalogue::Entry*> chosen;
  const auto all = catalogue::all();
  const std::size_t count = 3 + random() % 6;
  while (chosen.size() < count) {
    const catalogue::Entry& entry = all[random() % all.size()];
    const bool clashes = std::any_of(chosen.begin(), chosen.end(), [&](const catalogue::Entry* other) {
      return other == &entry || catalogue::names_contain(entry.info->replaces, other->name()) ||
             catalogue::names_contain(other->info->replaces, entry.name());
    });
    if (entry.info->host_only || clashes) continue;
    chosen.push_back(&entry);
    std::vector<double> usual;
    for (const auto& p : entry.parameters) usual.push_back(p.usual);
    std::vector<double> values = catalogue::reduced(entry, usual);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto& p = entry.parameters[i];
      if (values[i] == 0.0)
        values[i] = i > 0 && p.unit.rotary == entry.parameters[i - 1].unit.rotary ? values[i - 1] : 0.1;
      const bool linear = p.kind == catalogue::Kind::linear;
      values[i] *= linear ? log_between(0.1, 3.0) : log_between(0.5, 2.0);
      if (linear && p.low < 0.0 && random() % 2 == 0) values[i] = -values[i];
      values[i] = std::clamp(values[i], p.low, p.high);
    }
    values = catalogue::natural(entry, values);
    model::Effect effect = catalogue::blank_effect(entry, m.drive.axis);
    for (std::size_t i = 0; i < values.size(); ++i) effect.parameters[i].value = values[i];
    m.effects.push_back(std::move(effect));
  }
  return m;
}

std::vector<deployment::EffectValues> values_of(const model::Model& m) {
  std::vector<deployment::EffectValues> effects;
  for (const auto& effect : m.effects) {
    const auto& entry = catalogue::get(effect.type);
    effects.push_back({entry.id, effect.id, catalogue::values_of(effect, entry)});
  }
  return effects;
}

// The error that counts is on other samples than those that pack looked at.
TEST(PackedModels, ThreeHundredAreWithinAMillionthOfRatedTorqueAndOthersRefusedWithAReason) {
  std::mt19937 random(7101);
  PackOptions options;
  options.samples = 4000;
  int admitted = 0, refused = 0, above_bound = 0;
  double worst = 0.0;
  while (admitted < 300 && admitted + refused + above_bound < 3000) {
    options.seed = random();
    const model::Model m = random_model(random);
    try {
      const auto packed = deployment::pack(m, options);
      ++admitted;
      EXPECT_TRUE(deployment::unpack(packed.bytes).coefficients_follow);
      const auto effects = values_of(m);
      const auto drive = deployment::bases_of(m, 1.0 / options.tick_hz, packed.torque_scale);
      const auto other = deployment::compare(effects, drive, deployment::prove(effects, drive), 4000, random());
      const double rated = *m.drive.rated_torque_nm.value;
      worst = std::max({worst, other.worst[0] * drive.torque_base / (rated / drive.gear_ratio),
                        other.worst[1] * drive.output_torque_base / rated,
                        other.worst[2] * drive.output_torque_base / rated});
    } catch (const deployment::BoundError&) {
      ++above_bound;
    } catch (const PackError& error) {
      ++refused;
      const std::string reason = error.what();
      EXPECT_TRUE(reason.find("does not fit") != std::string::npos ||
                  reason.find("the proof fails") != std::string::npos)
          << reason;
    }
  }
  std::printf("%d admitted, %d do not fit, %d above the bound; worst error of those admitted %.2g of rated torque\n",
              admitted, refused, above_bound, worst);
  EXPECT_EQ(admitted, 300);
  EXPECT_LE(above_bound, 6);
  EXPECT_LT(worst, kBound);
}

// The bounds are of intervals; no sample of a million may be beyond them.
TEST(PackedModels, NoneOfAMillionDirectedSamplesLeavesItsProof) {
  std::mt19937 random(7102);
  std::size_t samples = 0;
  while (samples < 1'000'000) {
    const model::Model m = random_model(random);
    const auto effects = values_of(m);
    try {
      const auto drive = deployment::bases_of(m, 1.0 / 16000.0, 1.0);
      const auto bounds = deployment::prove(effects, drive);
      if (!bounds.holds) continue;
      const auto difference = deployment::compare(effects, drive, bounds, 20'000, random());
      samples += 20'000;
      EXPECT_TRUE(difference.within);
      EXPECT_EQ(difference.finding, "");
    } catch (const PackError&) {
    }
  }
}

}  // namespace
}  // namespace flexspline::tests
