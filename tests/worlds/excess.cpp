#include "tests/worlds/excess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace flexspline::worlds {
namespace {

constexpr double kCoarse_s = 1.0 / 4000.0;
constexpr std::size_t kEvery = 8;  // steps
constexpr double kMoving = 0.01;   // of the peak speed: slower samples are left out
constexpr std::size_t kMostColumns = 10;

using Regressors = std::array<double, kMostColumns>;

// Cholesky of the scaled normal equations, with a touch of ridge: columns may be alike in a record of one direction.
// `last`: where the coefficient of the last column goes.
double rms_after_fit(const std::vector<Regressors>& samples, const std::vector<double>& target, std::size_t columns,
                     double* last) {
  std::array<std::array<double, kMostColumns>, kMostColumns> a{};
  Regressors b{}, scale{};
  double total = 0.0;
  for (const Regressors& r : samples)
    for (std::size_t i = 0; i < columns; ++i) scale[i] += r[i] * r[i];
  for (std::size_t i = 0; i < columns; ++i) scale[i] = scale[i] > 0.0 ? 1.0 / std::sqrt(scale[i]) : 0.0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    total += target[k] * target[k];
    for (std::size_t i = 0; i < columns; ++i) {
      b[i] += samples[k][i] * scale[i] * target[k];
      for (std::size_t j = 0; j <= i; ++j) a[i][j] += samples[k][i] * scale[i] * samples[k][j] * scale[j];
    }
  }
  double explained = 0.0;
  for (std::size_t i = 0; i < columns; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(std::max(sum, 0.0) + 1e-12) : sum / a[j][j];
    }
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
    explained += b[i] * b[i];
  }
  if (last) *last = b[columns - 1] / a[columns - 1][columns - 1] * scale[columns - 1];
  return samples.empty() ? 0.0 : std::sqrt(std::max(0.0, total - explained) / static_cast<double>(samples.size()));
}

double share(double with, double without) {
  return with > 0.0 ? std::max(0.0, 1.0 - without * without / (with * with)) : 0.0;
}

// Columns of a hidden effect at step k; `direction` is the sign of the velocity or the presliding state.
std::size_t put_columns(const Twin& twin, const HiddenEffect& hidden, const Motion& m, std::size_t k, double w,
                        double direction, Regressors& sample, std::size_t at) {
  const Joint& p = twin.joint;
  const std::string& e = hidden.effect;
  const double load = m.load_torque[k] / p.gear_ratio;
  if (e == "stribeck_gaussian") {
    sample[at++] = direction * std::exp(-(w / p.stribeck_velocity) * (w / p.stribeck_velocity));
  } else if (e == "viscous_asymmetry") {
    sample[at++] = std::abs(w);
  } else if (e == "coulomb_asymmetry") {
    sample[at++] = std::abs(direction);
  } else if (e == "power_law_friction") {
    sample[at++] = std::copysign(std::pow(std::abs(w) / p.power_velocity, p.power_exponent), w);
  } else if (e == "quadratic_drag") {
    sample[at++] = w * std::abs(w);
  } else if (e == "load_dependent_friction") {
    sample[at++] = direction * std::abs(load);
  } else if (e == "torque_ripple") {
    sample[at++] = std::cos(hidden.order * m.angle[k]);
    sample[at++] = std::sin(hidden.order * m.angle[k]);
  } else if (e == "gravity") {
    sample[at++] = std::cos(m.output_angle[k]);
    sample[at++] = std::sin(m.output_angle[k]);
  } else if (e == "current_offset") {
    sample[at++] = 1.0;
  } else if (e == "torque_constant_saturation") {
    sample[at++] = m.current[k] * m.current[k] * m.current[k];
  } else if (e == "torque_sensor_gain") {
    sample[at++] = load;
  } else if (e == "temperature_viscous") {
    sample[at++] = w * m.temperature[k];
  } else {
    sample[at++] = direction * m.temperature[k];
  }
  return at;
}

double squared(double x) {
  return x * x;
}

Fitted all_hidden(const Twin& twin, const HiddenEffect* but = nullptr) {
  Fitted fitted{true, {}};
  for (const HiddenEffect& h : twin.hidden)
    if (&h != but) fitted.hidden.push_back(&h);
  return fitted;
}

struct Hidden {
  double total, share, behind_presliding;
};

Hidden hidden_share(const Twin& twin, const std::vector<Motion>& motions, const HiddenEffect& h) {
  const double base = squared(error_after_fit(twin, motions, {}));
  const double all = squared(error_after_fit(twin, motions, all_hidden(twin)));
  const double without = squared(error_after_fit(twin, motions, all_hidden(twin, &h)));
  return {base, base > 0.0 ? (without - all) / base : 0.0, without > 0.0 ? 1.0 - all / without : 0.0};
}

// Presliding so long that it leaves an effect of plausible size no share is shortened: both have to be in one joint.
void shorten_presliding(Twin& twin) {
  for (const HiddenEffect& h : twin.hidden) {
    const bool at_its_most = h.size > 0.99 * largest_size(twin, h);
    if (at_its_most && h.share < 0.7 * h.wanted_share) {
      twin.joint.presliding_length *= 0.3;
      return;
    }
  }
}

// The largest current of all records as they are recorded, the held out one among them; infinite where one runs away.
double largest_current(const Twin& twin) {
  double peak = 0.0;
  const auto take = [&](const Record& r) {
    for (const double i : simulate(twin.joint, r.conditions, twin.controller, r.trajectory, kCoarse_s).current)
      peak = std::isfinite(i) ? std::max(peak, std::abs(i)) : INFINITY;
  };
  for (const Record& r : twin.fit) take(r);
  take(twin.holdout);
  return peak;
}

// Torque k (i - s i^3) falls again beyond its turning point, and a controller runs away there: no drive is operated so.
void keep_below_turning_point(Twin& twin) {
  constexpr double kMost = 0.8;  // of the turning point
  for (HiddenEffect& h : twin.hidden) {
    if (h.effect != "torque_constant_saturation") continue;
    for (int round = 0; round < 20; ++round) {
      const double peak = largest_current(twin);
      if (peak < kMost * std::sqrt(1.0 / (3.0 * twin.joint.saturation))) break;
      h.size *= 0.5;
      set_size(twin, h, h.size);
    }
  }
}

// The squared error that an effect makes goes with the square of its size; that of the rest stays.
void scale_hidden(Twin& twin) {
  for (HiddenEffect& h : twin.hidden) {
    const Hidden now = hidden_share(twin, without_noise(twin), h);
    h.share = now.share;
    const double made = std::max(1e-4, now.share) * now.total, rest = std::max(0.02, 1.0 - now.share) * now.total;
    const double factor = std::sqrt(rest * h.wanted_share / (1.0 - h.wanted_share) / made);
    h.size = std::min(h.size * std::clamp(factor, 0.02, 8.0), largest_size(twin, h));
    set_size(twin, h, h.size);
    // Before the next effect is judged by the motion, and after one that may need more current.
    keep_below_turning_point(twin);
  }
}

struct Alternative {
  const char* effect;
  bool offered;       // by the signals that there are
  bool resists_only;  // a negative coefficient means something else
};

// Names that explain nearly all that a hidden effect explains on these motions, with the sign that physics allows them.
void accept_confounded(Twin& twin, const std::vector<Motion>& motions) {
  constexpr double kNearlyAll = 0.97;
  const bool offset = !twin.offset_in_base, loaded = twin.sensors.torque_column || twin.gravity_in_base;
  const bool current = twin.units != Units::joint, warm = twin.sensors.temperature_column;
  const std::array<Alternative, 12> alternatives = {
      {{"viscous_asymmetry", true, false},
       {"coulomb_asymmetry", offset, false},
       {"current_offset", offset && current, false},
       {"stribeck_gaussian", true, true},
       {"power_law_friction", true, true},
       {"quadratic_drag", true, true},
       {"load_dependent_friction", loaded, true},
       {"gravity", !twin.gravity_in_base && !twin.sensors.torque_column, false},
       {"torque_constant_saturation", current, true},
       {"torque_sensor_gain", twin.sensors.torque_column, false},
       {"temperature_viscous", warm, true},
       {"temperature_coulomb", warm, true}}};
  for (HiddenEffect& h : twin.hidden) {
    const double all = squared(error_after_fit(twin, motions, all_hidden(twin)));
    const double without = squared(error_after_fit(twin, motions, all_hidden(twin, &h)));
    for (const Alternative& a : alternatives) {
      if (!a.offered || std::find(h.accepted.begin(), h.accepted.end(), a.effect) != h.accepted.end()) continue;
      HiddenEffect other;
      other.effect = a.effect;
      double best = without;
      // Nonlinear parameters on a coarse grid.
      for (const double part : {0.04, 0.08, 0.15}) {
        Twin changed = twin;
        if (h.effect != "stribeck_gaussian") changed.joint.stribeck_velocity = part * twin.joint.power_velocity;
        if (h.effect != "power_law_friction") changed.joint.power_exponent = 0.2 + 3.0 * part;
        Fitted fitted = all_hidden(twin, &h);
        fitted.hidden.push_back(&other);
        double coefficient = 0.0;
        const double error = squared(error_after_fit(changed, motions, fitted, &coefficient));
        if (!a.resists_only || coefficient > 0.0) best = std::min(best, error);
        if (other.effect != "stribeck_gaussian" && other.effect != "power_law_friction") break;
      }
      if (without - best > kNearlyAll * (without - all)) h.accepted.push_back(a.effect);
    }
  }
}

}  // namespace

std::vector<Motion> without_noise(const Twin& twin) {
  std::vector<Motion> motions;
  for (const Record& r : twin.fit) {
    RecordConditions clean = r.conditions;
    clean.coloured_friction = 0.0;
    clean.pulses_s.clear();
    motions.push_back(simulate(twin.joint, clean, twin.controller, r.trajectory, kCoarse_s));
  }
  return motions;
}

double error_after_fit(const Twin& twin, const std::vector<Motion>& motions, const Fitted& fitted, double* last) {
  const Joint& p = twin.joint;
  std::vector<Regressors> samples;
  std::vector<double> target;
  double peak = 0.0;
  for (const Motion& m : motions)
    for (const double w : m.velocity) peak = std::max(peak, std::abs(w));
  std::size_t columns = 3;
  for (const Motion& m : motions) {
    // What the encoder sees: with an elastic load and an encoder at the joint it is the load.
    const bool joint_side = twin.units != Units::motor && p.elastic;
    const auto lead = static_cast<std::size_t>(-m.start_s / m.step_s);
    for (std::size_t k = lead + 1; k + 2 < m.size(); k += kEvery) {
      double w = m.velocity[k + 1], a = m.acceleration[k];
      if (joint_side) {
        w = p.gear_ratio * (m.output_angle[k + 1] - m.output_angle[k]) / m.step_s;
        a = p.gear_ratio * (m.output_angle[k + 1] - 2.0 * m.output_angle[k] + m.output_angle[k - 1]) /
            (m.step_s * m.step_s);
      }
      if (std::abs(w) < kMoving * peak) continue;
      const double direction = fitted.presliding ? m.direction[k] : w > 0.0 ? 1.0 : -1.0;
      Regressors sample{a, w, direction};
      std::size_t at = 3;
      if (twin.offset_in_base) sample[at++] = 1.0;
      if (twin.gravity_in_base) {
        sample[at++] = std::cos(m.output_angle[k]);
        sample[at++] = std::sin(m.output_angle[k]);
      }
      for (const HiddenEffect* h : fitted.hidden) at = put_columns(twin, *h, m, k, w, direction, sample, at);
      columns = at;
      samples.push_back(sample);
      double y = p.torque_constant * (m.current[k] + twin.sensors.current_offset);
      if (twin.sensors.torque_column) y -= twin.sensors.torque_gain * m.load_torque[k] / p.gear_ratio;
      target.push_back(y);
    }
  }
  return rms_after_fit(samples, target, columns, last);
}

Shares fit_sizes(Twin& twin) {
  Joint& j = twin.joint;
  const SecondStructure second = j.second;
  const auto base_error = [](const Twin& t) { return error_after_fit(t, without_noise(t), {}); };
  for (HiddenEffect& h : twin.hidden) {
    h.size = 0.3 * largest_size(twin, h);
    set_size(twin, h, h.size);
  }
  keep_below_turning_point(twin);
  for (int round = 0; round < 3; ++round) {
    if (round > 0) shorten_presliding(twin);
    scale_hidden(twin);
    keep_below_turning_point(twin);
    if (second == SecondStructure::none) continue;
    if (round == 0) j.second_size = 0.15 * j.coulomb;
    const double with = squared(base_error(twin));
    j.second = SecondStructure::none;
    const double without = squared(base_error(twin));
    j.second = second;
    const double wanted = without * twin.second_share_wanted / (1.0 - twin.second_share_wanted);
    if (with > without) j.second_size *= std::clamp(std::sqrt(wanted / (with - without)), 0.05, 4.0);
    j.second_size = std::min(j.second_size, 0.5 * j.coulomb);
  }

  const std::vector<Motion> motions = without_noise(twin);
  Shares shares;
  shares.error = error_after_fit(twin, motions, {});
  if (!std::isfinite(shares.error))
    throw std::runtime_error(fmt::format("seed {}: the controller ran away", twin.seed));
  for (HiddenEffect& h : twin.hidden) {
    const Hidden now = hidden_share(twin, motions, h);
    h.share = now.share;
    h.share_behind_presliding = now.behind_presliding;
  }
  accept_confounded(twin, motions);
  Fitted without_presliding = all_hidden(twin);
  without_presliding.presliding = false;
  const double complete = squared(error_after_fit(twin, motions, all_hidden(twin)));
  shares.presliding =
      std::max(0.0, squared(error_after_fit(twin, motions, without_presliding)) - complete) / squared(shares.error);
  if (second != SecondStructure::none) {
    Twin other = twin;
    other.joint.second = SecondStructure::none;
    shares.second = share(shares.error, base_error(other));
  }
  if (twin.friction_difference > 0.0) {
    Twin other = twin;
    for (Record& r : other.fit) r.conditions.friction_forward = r.conditions.friction_backward = 1.0;
    shares.directions = share(shares.error, base_error(other));
  }
  if (twin.joint.elastic) {
    Twin other = twin;
    other.joint.elastic.reset();
    shares.elastic = share(shares.error, base_error(other));
  }
  return shares;
}

}  // namespace flexspline::worlds
