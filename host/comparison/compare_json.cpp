#include <cmath>
#include <nlohmann/json.hpp>

#include "host/comparison/compare.hpp"

namespace flexspline::comparison {
namespace {

using nlohmann::json;

json number(double x) {
  return std::isfinite(x) ? json(x) : json(nullptr);
}

json to_json(const SignalResult& s) {
  return {{"signal", s.signal},
          {"unit", s.unit},
          {"samples", s.samples},
          {"masked", s.masked},
          {"rmse", number(s.rmse)},
          {"nrmse", number(s.nrmse)},
          {"fit_percent", number(s.fit_percent)},
          {"vaf_percent", number(s.vaf_percent)},
          {"max_abs", number(s.max_abs)},
          {"worst_case_gain", number(s.worst_case_gain)},
          {"noise_floor", s.noise_floor ? number(*s.noise_floor) : json(nullptr)},
          {"noise_floor_from", s.noise_floor_from},
          {"collapsed", s.collapsed}};
}

json to_json(const std::vector<SignalResult>& signals) {
  json list = json::array();
  for (const SignalResult& s : signals) list.push_back(to_json(s));
  return list;
}

}  // namespace

json to_json(const Comparison& comparison) {
  json experiments = json::array(), regions = json::array();
  for (const ExperimentResult& e : comparison.experiments)
    experiments.push_back(
        {{"name", e.name}, {"role", e.role == data::Role::fit ? "fit" : "holdout"}, {"signals", to_json(e.signals)}});
  for (const Region& r : comparison.regions)
    regions.push_back({{"signal", r.signal},
                       {"unit", r.unit},
                       {"variable", r.variable},
                       {"variable_unit", r.variable_unit},
                       {"low", number(r.low)},
                       {"high", number(r.high)},
                       {"samples", r.samples},
                       {"bias", number(r.bias)},
                       {"rmse", number(r.rmse)},
                       {"excess", number(r.excess)}});
  return {{"format", "flexspline-compare/1"},       {"experiments", std::move(experiments)},
          {"overall", to_json(comparison.overall)}, {"regions", std::move(regions)},
          {"parameter_trends", json::array()},      {"cutoff_hz", number(comparison.pipeline.row_cutoff_hz)},
          {"warnings", comparison.warnings}};
}

}  // namespace flexspline::comparison
