// Sets of rhs-100 as data in memory, identified all together or, as the report does it, each experiment alone. The twin
// and the tool know nothing of each other; here they meet.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "hil/rhs100/experiments.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::tests {

inline constexpr std::uint64_t kJudgingSeed = 7001;

inline data::Experiment experiment_of(const rhs100::Set& set, std::size_t at, std::uint64_t seed) {
  using data::Column;
  const plant::Drive& drive = set.experiments.at(at).drive;
  plant::Record r = rhs100::record(set, at, seed);
  data::Experiment e;
  e.name = r.name;
  e.role = r.holdout ? data::Role::holdout : data::Role::fit;
  e.load = r.locked ? data::Load::locked : data::Load::free;
  e.current_hold = data::CurrentHold::zoh;
  e.current_hold_stated = true;
  e.sample_s = drive.sample_s;
  e.time_s = std::move(r.time_s);
  const auto put = [&](Column column, std::vector<double> values, double noise) {
    e[column] = std::move(values);
    e.noise_std[static_cast<std::size_t>(column)] = noise;
  };
  put(Column::current, std::move(r.current_a), r.current_noise_std);
  put(Column::motor_velocity, std::move(r.motor_velocity_rad_s), r.tachometer_noise_std);
  if (set.sensors == rhs100::Sensors::drive) {
    put(Column::motor_position, std::move(r.motor_position_rad), r.motor_position_noise_std);
    put(Column::output_position, std::move(r.output_position_rad), r.output_position_noise_std);
    put(Column::torque, std::move(r.torque_nm), r.torque_noise_std);
    e.encoder_counts = drive.sensors.motor_counts;
    e.output_encoder_counts = drive.sensors.output_counts;
    e.motor_position_zero = e.output_position_zero = data::PositionZero::absolute;
  }
  if (set.load_torque_nm) e[Column::load_torque].assign(e.time_s.size(), *set.load_torque_nm);
  e.segments = {{0, e.time_s.size()}};
  e.masked.assign(e.time_s.size(), 0);
  return e;
}

inline data::Dataset dataset_of(const rhs100::Set& set, std::uint64_t seed = kJudgingSeed) {
  data::Dataset dataset;
  dataset.drive.axis = data::Axis::rotary;
  dataset.drive.gear_ratio = set.gear_ratio;
  for (std::size_t k = 0; k < set.experiments.size(); ++k) dataset.experiments.push_back(experiment_of(set, k, seed));
  return dataset;
}

// The experiments that `wanted` names or, for what begins with a dash, whose names hold that: "-1-" is all sines.
inline data::Dataset only(const data::Dataset& dataset, std::string_view wanted) {
  data::Dataset some = dataset;
  std::erase_if(some.experiments, [&](const data::Experiment& e) {
    return wanted.starts_with('-') ? e.name.find(wanted) == std::string::npos : e.name != wanted;
  });
  return some;
}

inline model::Model model_of(const std::string& toml) {
  return model::parse(toml, "base-model.toml", catalogue::known_effects()).model;
}
inline model::Model base_model(const rhs100::Set& set) {
  return model_of(set.base_model);
}

inline void add(model::Model& model, std::string_view effect) {
  model.effects.push_back(catalogue::blank_effect(catalogue::get(effect), data::Axis::rotary));
}
inline void fix(model::Model& model, std::string_view effect, std::string_view parameter, double value) {
  model::Effect* e = model.find(effect);
  model::Parameter* p = e ? e->find(parameter) : nullptr;
  if (!p) throw std::invalid_argument("the model has no " + std::string(effect) + "." + std::string(parameter));
  p->value = value;
  p->fixed = true;
}

inline const estimation::Estimate& estimate(const estimation::Identification& found, std::string_view effect,
                                            std::string_view parameter) {
  for (const estimation::Estimate& e : found.estimates)
    if (e.effect == effect && e.parameter == parameter) return e;
  throw std::invalid_argument("nothing was estimated for " + std::string(effect) + "." + std::string(parameter));
}

inline double derived(const estimation::Identification& found, std::string_view name) {
  for (const estimation::Derived& d : found.derived)
    if (d.name == name) return d.value;
  throw std::invalid_argument("nothing was derived for " + std::string(name));
}

// A value by experiment, in the order of the set.
using Column = std::vector<double>;

inline double mean(const Column& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}
// Standard deviation over average in percent: over n - 1, as the tool and tables 7 and 8, or over n, as tables 3 to 6.
inline double spread_percent(const Column& values, bool over_n = false) {
  const double average = mean(values);
  double squares = 0.0;
  for (const double v : values) squares += (v - average) * (v - average);
  return 100.0 * std::sqrt(squares / static_cast<double>(values.size() - (over_n ? 0 : 1))) / std::abs(average);
}
inline double root_mean_square(const Column& values) {
  double squares = 0.0;
  for (const double v : values) squares += v * v;
  return std::sqrt(squares / static_cast<double>(values.size()));
}
// The largest relative distance of two columns, in percent.
inline double worst_percent(const Column& ours, const Column& theirs) {
  double worst = 0.0;
  for (std::size_t k = 0; k < ours.size(); ++k) worst = std::max(worst, 100.0 * std::abs(ours[k] / theirs[k] - 1.0));
  return worst;
}

// The slope of ln y over ln x, the t value of it, and what it leaves of the spread of y, in percent.
struct Power {
  double exponent = 0.0;
  double t = 0.0;
  double rest_percent = 0.0;
};
inline Power power_of(const Column& x, const Column& y) {
  const auto n = static_cast<double>(x.size());
  double mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0, rest = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mx += std::log(x[k]) / n;
    my += std::log(y[k]) / n;
  }
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (std::log(x[k]) - mx) * (std::log(x[k]) - mx);
    xy += (std::log(x[k]) - mx) * (std::log(y[k]) - my);
  }
  const double slope = xy / xx;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double r = std::log(y[k]) - my - slope * (std::log(x[k]) - mx);
    rest += r * r;
  }
  const double deviation = std::sqrt(rest / (n - 2.0));
  return {slope, slope / (deviation / std::sqrt(xx)), 100.0 * deviation};
}

}  // namespace flexspline::tests
