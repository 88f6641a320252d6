#include "host/engine/estimation/estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "host/engine/estimation/instruments.hpp"
#include "host/engine/estimation/intervals.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/output_error.hpp"
#include "host/engine/estimation/partition.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::estimation {
namespace {

constexpr std::array<std::pair<std::string_view, Method>, 6> kMethods = {{
    {"", Method::automatic},
    {"ls", Method::ls},
    {"nls", Method::nls},
    {"partitioned", Method::partitioned},
    {"iv", Method::instruments},
    {"oe", Method::output_error},
}};
constexpr std::array<std::pair<std::string_view, Intervals>, 3> kIntervals = {{
    {"standard", Intervals::standard},
    {"profile", Intervals::profile},
    {"bootstrap", Intervals::bootstrap},
}};

// A homogeneous balance (report 3.6): where the torque constant is free too, any multiple of a solution is a solution.
void warn_of_scale(Identification& identification) {
  for (const Estimate& e : identification.estimates) {
    const auto& info = *identification.terms[e.ref.term].entry->info;
    if (e.identifiable || e.fixed || (info.reads & effects::kTorqueScale) == 0) continue;
    if (e.excitation.value_or(1.0) >= kUndetermined) continue;  // noise or a bound hide the scale, and assemble says so
    identification.warnings.push_back(fmt::format(
        "nothing fixes the scale of the torques, so {}.{} is not identifiable: supply one parameter that you know "
        "another way, such as --supply inertia.inertia=VALUE",
        e.id, e.parameter));
  }
}

}  // namespace

void supply(model::Model& model, const SuppliedValue& supplied) {
  model::Effect* effect = model.find(supplied.id);
  if (!effect)
    throw std::invalid_argument(fmt::format("{}.{} is supplied, but the model has no effect {}: it has {}", supplied.id,
                                            supplied.parameter, supplied.id, [&] {
                                              std::string names;
                                              for (const model::Effect& e : model.effects)
                                                names += (names.empty() ? "" : ", ") + e.id;
                                              return names;
                                            }()));
  model::Parameter* parameter = effect->find(supplied.parameter);
  if (!parameter) {
    std::string names;
    for (const auto& info : catalogue::entry_of(*effect).parameters)
      names += (names.empty() ? "" : ", ") + std::string(info.name);
    throw std::invalid_argument(
        fmt::format("{} has no parameter {}: it has {}", supplied.id, supplied.parameter, names));
  }
  parameter->value = supplied.value;
  parameter->fixed = true;
  for (const auto& info : catalogue::entry_of(*effect).parameters)
    if (info.name == supplied.parameter) parameter->unit = std::string(catalogue::unit_on(info.unit, model.drive.axis));
}

Method method_from_name(std::string_view name) {
  for (const auto& [known, method] : kMethods)
    if (known == name) return method;
  throw std::invalid_argument(fmt::format("there is no method {}: it is ls, nls, partitioned, iv or oe", name));
}

std::string_view name_of(Method method) {
  return std::find_if(kMethods.begin(), kMethods.end(), [&](const auto& m) { return m.second == method; })->first;
}

Intervals intervals_from_name(std::string_view name) {
  for (const auto& [known, intervals] : kIntervals)
    if (known == name) return intervals;
  throw std::invalid_argument(fmt::format("there are no intervals {}: it is standard, profile or bootstrap", name));
}

Method method_for(const model::Model& model) {
  for (const Term& term : terms_of(model))
    for (std::size_t p = 0; p < term.values.size(); ++p)
      if (term.free_nonlinear(p)) return Method::nls;
  return Method::ls;
}

std::unique_ptr<Identification> estimate(const data::Dataset& dataset, const model::Model& model,
                                         const PipelineOptions& pipeline, const Options& options) {
  const Method needed = method_for(model);
  const Method method = options.method == Method::automatic ? needed : options.method;
  if (method == Method::ls && needed == Method::nls)
    throw std::invalid_argument(
        "the model has nonlinear parameters, which linear least squares cannot estimate; give --method nls, or state "
        "them with fixed = true");
  std::unique_ptr<Identification> result;
  if (method == Method::partitioned) {
    result = partitioned(dataset, model, pipeline);
  } else {
    result = build_balances(dataset, model, pipeline);
    fit(*result);
    if (method != Method::ls && options.starts > 1) {
      options.progress("searching from several starts");
      search_from_several_starts(*result, options.starts, options.seed);
    }
    if (method == Method::instruments) {
      options.progress("simulating the instruments");
      refit_with_instruments(*result);
    }
    if (method == Method::output_error) {
      options.progress("fitting the free run");
      refit_to_output(*result, options.progress);
    }
    compute_estimates(*result);
  }
  result->method = name_of(method);
  warn_of_scale(*result);
  const bool is_least_squares = method == Method::ls || method == Method::nls;
  if (options.intervals == Intervals::standard) {
    if (is_least_squares) count_biases(*result, dataset, model, pipeline);
    return result;
  }
  if (!is_least_squares) {
    result->warnings.push_back(
        "intervals by profile and bootstrap are those of least squares; with this method they are the standard ones");
    return result;
  }
  if (options.intervals == Intervals::profile)
    profile(*result, options.progress);
  else
    bootstrap(*result, options.replicates, options.seed, options.progress);
  return result;
}

}  // namespace flexspline::estimation
