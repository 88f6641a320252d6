// How often the 95 % intervals of a complete model hold the truth, by parameter, over simulated drives whose effects
// have drawn sizes.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "host/engine/estimation/estimate.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "tests/support/campaign_statistics.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::tests {

// What surrounds the drive of a demo: how its sensors and its friction are.
struct World {
  std::string name;
  std::function<void(plant::Drive&)> apply;
};

inline std::vector<World> interval_worlds() {
  return {
      {"demo", [](plant::Drive&) {}},
      {"friction differs by 3 %", [](plant::Drive& d) { d.friction_variation = 0.03; }},
      {"correlated noise", [](plant::Drive& d) { d.sensors.current.correlation = d.sensors.torque.correlation = 0.9; }},
      {"coarse encoders", [](plant::Drive& d) {
         d.sensors.motor_counts /= 8;
         d.sensors.output_counts /= 8;
       }}};
}

struct ParameterCoverage {
  std::size_t inside = 0, all = 0, without = 0;  // `without`: drives where it has no interval
  std::vector<double> errors;                    // relative
  std::vector<double> half_widths;               // relative

  double share() const { return static_cast<double>(inside) / static_cast<double>(std::max<std::size_t>(1, all)); }
};

// By "effect.parameter".
using Coverage = std::map<std::string, ParameterCoverage>;

inline void add(const Coverage& from, Coverage& to) {
  for (const auto& [name, c] : from) {
    ParameterCoverage& sum = to[name];
    sum.inside += c.inside;
    sum.all += c.all;
    sum.without += c.without;
    sum.errors.insert(sum.errors.end(), c.errors.begin(), c.errors.end());
    sum.half_widths.insert(sum.half_widths.end(), c.half_widths.begin(), c.half_widths.end());
  }
}

// Each effect's size is drawn from 0.7 to 1.4 times the usual one.
inline void draw_sizes(plant::Drive& drive, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> log_size(std::log(0.7), std::log(1.4));
  for (plant::Effect& e : drive.effects) {
    const double size = std::exp(log_size(random));
    for (plant::Parameter& p : e.parameters)
      if (p.scaled) p.value *= size;
  }
}

// A model with the drive's effects and no values but those that a user states, and those of grids, on which weights
// could not be compared otherwise.
inline model::Model model_to_identify(const plant::Drive& drive) {
  model::Model model = model_of(drive, true, false);
  const model::Model truth = model_of(drive, true, true);
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const catalogue::Entry& entry = catalogue::get(model.effects[i].type);
    for (std::size_t p = 0; p < entry.parameters.size(); ++p) {
      if (entry.parameters[p].kind != effects::Kind::grid) continue;
      model.effects[i].parameters[p].value = truth.effects[i].parameters[p].value;
      model.effects[i].parameters[p].fixed = true;
    }
  }
  return model;
}

using Identify = std::function<std::vector<estimation::Estimate>(const data::Dataset&, const model::Model&)>;

// `label`: an effect that the drive has in addition to the demo's; empty: none.
inline Coverage interval_coverage(const std::string& label, const World& world, std::uint64_t first_seed,
                                  std::size_t seeds, const Identify& identify) {
  std::vector<Coverage> found(seeds);
  estimation::in_parallel(seeds, [&](std::size_t s) {
    plant::PlantFile demo = plant::demo_plant();
    std::erase_if(demo.experiments, [](const plant::ExperimentPlan& e) { return e.holdout; });
    world.apply(demo.drive);
    if (!label.empty()) plant::with(demo.drive, label);
    // The plant's bristles never stick: its asymmetry is then a constant torque, and what the current's offset is.
    if (label == "dahl_friction" || label == "lugre_friction") plant::without(demo.drive, "coulomb_asymmetry");
    // The library's laws read the measured current, the plant's the true one: with an offset the two differ.
    if (label == "torque_constant_error" || label == "torque_constant_saturation")
      plant::without(demo.drive, "current_offset");
    // More friction than a saturated amplifier overcomes: that drive would not move.
    if (label != "current_saturation") draw_sizes(demo.drive, first_seed + s);
    const data::Dataset dataset =
        dataset_of(demo.drive, plant::record_all(demo.drive, demo.experiments, first_seed + s));
    const model::Model truth = model_of(demo.drive, true, true);
    for (const estimation::Estimate& e : identify(dataset, model_to_identify(demo.drive))) {
      const model::Effect* effect = truth.find(e.id);
      const model::Parameter* parameter = effect ? effect->find(e.parameter) : nullptr;
      if (e.fixed || !parameter || !parameter->value) continue;
      ParameterCoverage& c = found[s][e.effect + "." + e.parameter];
      if (!e.low || !e.high) {
        ++c.without;
        continue;
      }
      const double value = *parameter->value;
      c.inside += *e.low <= value && value <= *e.high;
      ++c.all;
      const double size = value != 0.0 ? std::abs(value) : 1.0;
      c.errors.push_back((e.value - value) / size);
      c.half_widths.push_back(0.5 * (*e.high - *e.low) / size);
    }
  });
  Coverage sum;
  for (const Coverage& one : found) add(one, sum);
  return sum;
}

inline double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(std::max<std::size_t>(1, values.size()));
}

inline double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

inline void print(const std::string& heading, const Coverage& coverage) {
  for (const auto& [name, c] : coverage) {
    const Interval exact = exact_interval(c.inside, c.all);
    const double bias = mean_of(c.errors);
    double square = 0.0;
    for (const double e : c.errors) square += (e - bias) * (e - bias);
    fmt::print(
        "{:24} {:46} {:4} of {:4} ({:5.1f} %; {:5.1f} to {:5.1f}), none {:3} | bias {:8.4f} %, spread {:8.4f} %, half "
        "width {:8.4f} %\n",
        heading, name, c.inside, c.all, 100.0 * c.share(), 100.0 * exact.low, 100.0 * exact.high, c.without,
        100.0 * bias, 100.0 * std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, c.errors.size()))),
        100.0 * median_of(c.half_widths));
  }
}

}  // namespace flexspline::tests
