#include "host/output/answers/sensitivity.hpp"

#include <nlohmann/json.hpp>

#include "host/output/answers/json.hpp"

namespace flexspline::output {
namespace {

using nlohmann::json;
using sensitivity::ExperimentErrors;
using sensitivity::Response;
using sensitivity::SignalError;
using sensitivity::Variant;

json to_json(const Response& r) {
  return {{"frequency_hz", json_number(r.frequency_hz)},
          {"amplitude_ratio", json_number(r.amplitude_ratio)},
          {"phase_deg", json_number(r.phase_deg)}};
}

json common(const SignalError& s) {
  return {{"signal", s.signal},
          {"load", s.load.empty() ? json(nullptr) : json(s.load)},
          {"unit", s.unit},
          {"samples", s.samples},
          {"rmse", json_number(s.rmse)},
          {"nrmse", json_number(s.nrmse)},
          {"growth", json_number(s.growth)},
          {"amplitude_ratio", json_number(s.response.amplitude_ratio)},
          {"phase_deg", json_number(s.response.phase_deg)}};
}

json to_json(const Variant& v) {
  json overall = json::array(), experiments = json::array();
  for (const SignalError& s : v.overall) {
    json signal = common(s);
    signal["most_in"] = s.worst_experiment.empty() ? json(nullptr) : json(s.worst_experiment);
    overall.push_back(std::move(signal));
  }
  for (const ExperimentErrors& e : v.experiments) {
    json signals = json::array();
    for (const SignalError& s : e.signals) {
      json signal = common(s);
      signal["frequency_hz"] = json_number(s.response.frequency_hz);
      signal["lines"] = json::array();
      for (const Response& line : s.lines) signal["lines"].push_back(to_json(line));
      signals.push_back(std::move(signal));
    }
    experiments.push_back({{"name", e.name},
                           {"role", e.role == data::Role::fit ? "fit" : "holdout"},
                           {"load", e.load},
                           {"signals", std::move(signals)}});
  }
  json answer{{"label", v.label()},
              {"change", v.change ? json(v.change->leaves_out() ? "leave_out" : "scale") : json(nullptr)},
              {"effect", v.change ? json(v.change->effect) : json(nullptr)},
              {"parameter", nullptr},
              {"factor", nullptr},
              {"also_left_out", v.also_left_out},
              {"growth", json_number(v.growth)},
              {"overall", std::move(overall)},
              {"experiments", std::move(experiments)},
              {"note", v.note.empty() ? json(nullptr) : json(v.note)}};
  if (v.change && !v.change->leaves_out()) {
    answer["parameter"] = v.change->parameter;
    answer["factor"] = json_number(v.change->factor);
  }
  return answer;
}

}  // namespace

json sensitivity_json(const sensitivity::Sensitivity& found) {
  json variants = json::array();
  for (const Variant& v : found.variants) variants.push_back(to_json(v));
  return {{"format", "flexspline-sensitivity/1"},
          {"refit", found.refit},
          {"cutoff_hz", json_number(found.pipeline.row_cutoff_hz)},
          {"full", to_json(found.full)},
          {"variants", std::move(variants)},
          {"warnings", found.warnings}};
}

}  // namespace flexspline::output
