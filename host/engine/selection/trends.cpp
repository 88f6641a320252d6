#include "host/engine/selection/trends.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection {
namespace {

struct Covariate {
  const char* name;
  bool is_scale;  // compared by its logarithm
  std::vector<std::optional<double>> by_record;
};

std::vector<Covariate> covariates_of(const estimation::PreparedData& prepared) {
  std::vector<Covariate> covariates{{"speed", true, {}},          {"frequency", true, {}},
                                    {"acceleration", true, {}},   {"temperature", false, {}},
                                    {"order in time", false, {}}, {"torque", true, {}}};
  double order = 0.0;
  for (const estimation::Record& r : prepared.records) {
    double speed = 0.0, acceleration = 0.0, temperature = 0.0, torque = 0.0;
    r.inputs.all().each_block([&](std::size_t, auto stretch) {
      for (const auto& in : stretch) {
        speed += in.velocity * in.velocity;
        acceleration += in.acceleration * in.acceleration;
        temperature += in.temperature;
        torque += in.torque_magnitude;
      }
    });
    const auto n = static_cast<double>(r.inputs.size());
    const bool moves = !r.at_rest && speed > 0.0;
    const auto known = [&](bool is, double value) { return is && moves ? std::optional(value) : std::nullopt; };
    covariates[0].by_record.push_back(known(true, std::sqrt(speed / n)));
    covariates[1].by_record.push_back(known(true, moves ? std::sqrt(acceleration / speed) : 0.0));
    covariates[2].by_record.push_back(known(true, std::sqrt(acceleration / n)));
    covariates[3].by_record.push_back(known(r.has_temperature, temperature / n));
    covariates[4].by_record.push_back(known(true, order++));
    covariates[5].by_record.push_back(known(!r.torque.empty() && torque > 0.0, torque / n));
  }
  return covariates;
}

// Slope of y over x with its two-sided p-value; nothing without spread in x.
struct Line {
  double slope, p_value;
};
std::optional<Line> fit_line(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  const double mean_x = std::accumulate(x.begin(), x.end(), 0.0) / n,
               mean_y = std::accumulate(y.begin(), y.end(), 0.0) / n;
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xx += (x[k] - mean_x) * (x[k] - mean_x);
    xy += (x[k] - mean_x) * (y[k] - mean_y);
    yy += (y[k] - mean_y) * (y[k] - mean_y);
  }
  if (!(xx > 1e-12 * (1.0 + mean_x * mean_x)) || x.size() < 3) return std::nullopt;
  const double slope = xy / xx;
  const double variance = std::max(yy - slope * xy, 1e-12 * yy) / (n - 2.0) / xx;
  if (!(variance > 0.0)) return std::nullopt;
  return Line{slope, 2.0 * numbers::student_t_above(n - 2.0, std::abs(slope) / std::sqrt(variance))};
}

}  // namespace

std::vector<Trend> parameter_trends(const estimation::Identification& identified) {
  const auto& records = identified.prepared.records;
  const std::vector<Covariate> covariates = covariates_of(identified.prepared);
  std::vector<Trend> trends;
  for (const estimation::Estimate& e : identified.estimates) {
    // Corrected for the tests of this parameter alone: more parameters in the model must not hide a trend.
    double tried = 0.0;
    const auto first = static_cast<std::ptrdiff_t>(trends.size());
    if (identified.terms[e.ref.term].entry->parameters[e.ref.parameter].low != 0.0)
      continue;  // offsets have no relative change
    for (const Covariate& covariate : covariates) {
      std::vector<double> x, y;
      for (const estimation::ExperimentValue& v : e.per_experiment) {
        if (!v.value || *v.value <= 0.0) continue;
        const auto at = std::find_if(records.begin(), records.end(), [&v](const auto& r) { return r.name == v.name; });
        if (at == records.end()) continue;
        const auto& covariate_value = covariate.by_record[static_cast<std::size_t>(at - records.begin())];
        if (!covariate_value) continue;
        x.push_back(covariate.is_scale ? std::log(*covariate_value) : *covariate_value);
        y.push_back(std::log(*v.value));
      }
      if (x.size() < kPolicy.fewest_of_trend) continue;
      const auto line = fit_line(x, y);
      if (!line) continue;
      tried += 1.0;
      const auto [low, high] = std::minmax_element(x.begin(), x.end());
      if (std::abs(line->slope) * (*high - *low) < kPolicy.trend_size) continue;
      trends.push_back({e.id, e.parameter, covariate.name, line->slope, line->p_value});
    }
    std::for_each(trends.begin() + first, trends.end(),
                  [&](Trend& t) { t.p_value = std::min(1.0, t.p_value * tried); });
  }
  std::erase_if(trends, [](const Trend& t) { return t.p_value > kPolicy.trend_p_value; });
  std::sort(trends.begin(), trends.end(), [](const Trend& a, const Trend& b) { return a.p_value < b.p_value; });
  return trends;
}

double rms_speed(const estimation::Record& record) {
  double squares = 0.0;
  record.inputs.all().each_block([&](std::size_t, auto stretch) {
    for (const auto& in : stretch) squares += in.velocity * in.velocity;
  });
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, record.inputs.size())));
}

std::vector<Drift> drifts(const CrossValidatedFit& fit) {
  std::vector<Drift> list;
  const double tau = fit.autocorrelation_time;
  const auto deviance = [&](const SmallVector& std) {
    const RandomEffects effects = estimation::random_effects_at(fit.errors, std, tau, 0.0);
    return std::accumulate(effects.deviance.begin(), effects.deviance.end(), 0.0);
  };
  for (std::size_t g = 0; g < fit.groups.size(); ++g) {
    SmallVector none = fit.random_effects.std;
    double& own = none[static_cast<Eigen::Index>(g)];
    const double std = std::exchange(own, 0.0);
    if (std >= kPolicy.least_drift && deviance(none) - deviance(fit.random_effects.std) > kPolicy.drift_deviance)
      list.push_back({fit.groups[g].name, 100.0 * std});
  }
  return list;
}

}  // namespace flexspline::selection
