#include <nlohmann/json.hpp>

#include "host/output/answers/comparison.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::output {
namespace {

using comparison::BaselineExperiment;
using comparison::BaselineResult;
using comparison::Comparison;
using comparison::ExperimentResult;
using comparison::Region;
using comparison::SignalResult;
using nlohmann::json;

json to_json(const SignalResult& s) {
  return {{"signal", s.signal},
          {"unit", s.unit},
          {"samples", s.samples},
          {"masked", s.masked},
          {"rmse", json_number(s.rmse)},
          {"nrmse", json_number(s.nrmse)},
          {"fit_percent", json_number(s.fit_percent)},
          {"vaf_percent", json_number(s.vaf_percent)},
          {"max_abs", json_number(s.max_abs)},
          {"worst_case_gain", json_number(s.h_infinity.value)},
          {"h_infinity",
           {{"norm", json_number(s.h_infinity.value)},
            {"interval", {json_number(s.h_infinity.low), json_number(s.h_infinity.high)}},
            {"frequency_hz", json_number(s.h_infinity.frequency_hz)},
            {"windows", json_number(s.h_infinity.windows)}}},
          {"noise_floor", json_number(s.noise_floor)},
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
                           {"rmse", json_number(e.rmse)},
                           {"model_rmse", json_number(e.model_rmse)}});
  return {{"asked", b.requested},
          {"black_box", b.black_box},
          {"signal", b.signal},
          {"unit", b.unit},
          {"load", b.load.empty() ? json(nullptr) : json(b.load)},
          {"inputs", b.inputs},
          {"parameters", b.parameters},
          {"sample_s", json_number(b.sample_s)},
          {"samples", b.samples},
          {"rmse", json_number(b.rmse)},
          {"nrmse", json_number(b.nrmse)},
          {"fit_percent", json_number(b.fit_percent)},
          {"rmse_one_step", json_number(b.rmse_one_step)},
          {"rmse_fit", json_number(b.rmse_fit)},
          {"rmse_holdout", json_number(b.rmse_holdout)},
          {"model_rmse", json_number(b.model_rmse)},
          {"model_rmse_holdout", json_number(b.model_rmse_holdout)},
          {"largest_pole", json_number(b.largest_pole)},
          {"stable", b.stable},
          {"experiments", std::move(experiments)}};
}

}  // namespace

json comparison_json(const Comparison& comparison) {
  json experiments = json::array(), regions = json::array(), baselines = json::array();
  for (const ExperimentResult& e : comparison.experiments)
    experiments.push_back(
        {{"name", e.name}, {"role", e.role == data::Role::fit ? "fit" : "holdout"}, {"signals", to_json(e.signals)}});
  for (const Region& r : comparison.regions)
    regions.push_back({{"signal", r.signal},
                       {"unit", r.unit},
                       {"variable", r.variable},
                       {"variable_unit", r.variable_unit},
                       {"low", json_number(r.low)},
                       {"high", json_number(r.high)},
                       {"samples", r.samples},
                       {"bias", json_number(r.bias)},
                       {"rmse", json_number(r.rmse)},
                       {"excess", json_number(r.excess)}});
  for (const BaselineResult& b : comparison.baselines) baselines.push_back(to_json(b));
  return {{"format", "flexspline-compare/1"},
          {"experiments", std::move(experiments)},
          {"overall", to_json(comparison.overall)},
          {"regions", std::move(regions)},
          {"beside", std::move(baselines)},
          {"parameter_trends", json::array()},
          {"cutoff_hz", json_number(comparison.pipeline.row_cutoff_hz)},
          {"warnings", comparison.warnings}};
}

}  // namespace flexspline::output
