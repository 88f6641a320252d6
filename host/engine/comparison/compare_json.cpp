#include <cmath>
#include <nlohmann/json.hpp>

#include "host/engine/comparison/compare.hpp"

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
          {"worst_case_gain", number(s.h_infinity.value)},
          {"h_infinity",
           {{"norm", number(s.h_infinity.value)},
            {"interval", {number(s.h_infinity.low), number(s.h_infinity.high)}},
            {"frequency_hz", number(s.h_infinity.frequency_hz)},
            {"windows", number(s.h_infinity.windows)}}},
          {"noise_floor", s.noise_floor ? number(*s.noise_floor) : json(nullptr)},
          {"noise_floor_from", s.noise_floor_from},
          {"collapsed", s.collapsed}};
}

json to_json(const std::vector<SignalResult>& signals) {
  json list = json::array();
  for (const SignalResult& s : signals) list.push_back(to_json(s));
  return list;
}

json to_json(const BaselineResult& b) {
  json experiments = json::array();
  for (const BaselineExperiment& e : b.experiments)
    experiments.push_back({{"name", e.name},
                           {"role", e.role == data::Role::fit ? "fit" : "holdout"},
                           {"rmse", number(e.rmse)},
                           {"model_rmse", number(e.model_rmse)}});
  return {{"asked", b.requested},
          {"black_box", b.black_box},
          {"signal", b.signal},
          {"unit", b.unit},
          {"load", b.load.empty() ? json(nullptr) : json(b.load)},
          {"inputs", b.inputs},
          {"parameters", b.parameters},
          {"sample_s", number(b.sample_s)},
          {"samples", b.samples},
          {"rmse", number(b.rmse)},
          {"nrmse", number(b.nrmse)},
          {"fit_percent", number(b.fit_percent)},
          {"rmse_one_step", number(b.rmse_one_step)},
          {"rmse_fit", number(b.rmse_fit)},
          {"rmse_holdout", number(b.rmse_holdout)},
          {"model_rmse", number(b.model_rmse)},
          {"model_rmse_holdout", number(b.model_rmse_holdout)},
          {"largest_pole", number(b.largest_pole)},
          {"stable", b.stable},
          {"experiments", std::move(experiments)}};
}

}  // namespace

json to_json(const Comparison& comparison) {
  json experiments = json::array(), regions = json::array(), baselines = json::array();
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
  for (const BaselineResult& b : comparison.baselines) baselines.push_back(to_json(b));
  return {{"format", "flexspline-compare/1"},
          {"experiments", std::move(experiments)},
          {"overall", to_json(comparison.overall)},
          {"regions", std::move(regions)},
          {"beside", std::move(baselines)},
          {"parameter_trends", json::array()},
          {"cutoff_hz", number(comparison.pipeline.row_cutoff_hz)},
          {"warnings", comparison.warnings}};
}

}  // namespace flexspline::comparison
