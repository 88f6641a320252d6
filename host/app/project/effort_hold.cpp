#include "host/app/project/effort_hold.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/engine/estimation/effort_timing.hpp"
#include "host/engine/estimation/identify.hpp"

namespace flexspline::project {
namespace {

// Of the effort as it is assumed now, s; nothing where the data do not show it.
std::optional<double> certain_lag_s(const data::Dataset& dataset, const model::Model& model) {
  try {
    const auto found = estimation::identify(dataset, model, {});
    const std::optional<estimation::EffortLag> lag = estimation::effort_lag(*found);
    if (lag && lag->is_certain()) return lag->lag_s;
  } catch (const data::DataError&) {
    // These data cannot be fitted yet; `identify` will say why.
  }
  return std::nullopt;
}

}  // namespace

void take_hold_of_values(const model::Model& model, Draft& draft, data::Dataset& dataset) {
  const auto is_stated = [](const data::Experiment& e) { return e.current_hold_stated; };
  if (dataset.experiments.empty() || std::ranges::any_of(dataset.experiments, is_stated)) return;
  double sample_s = 0.0;
  for (const data::Experiment& e : dataset.experiments) sample_s = std::max(sample_s, e.sample_s);
  const std::optional<double> lag_s = certain_lag_s(dataset, model);
  if (!lag_s || *lag_s < 0.25 * sample_s) return;
  draft.toml.defaults["current_hold"] = text_value("none");
  for (data::Experiment& e : dataset.experiments) e.current_hold = data::CurrentHold::none;
  draft.notes.push_back(fmt::format(
      "the effort is taken as it is at the sample (current_hold = \"none\"): as a command that the drive holds from "
      "sample to sample it would be {:.2g} ms later than the motion",
      1e3 * *lag_s));
}

}  // namespace flexspline::project
