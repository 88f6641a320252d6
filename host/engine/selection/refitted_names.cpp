#include "host/engine/selection/refitted_names.hpp"

#include <algorithm>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/standard_intervals.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/wald_test.hpp"

namespace flexspline::selection {
namespace {

using estimation::Estimate;

bool is_linear(const NamedEffect& name) {
  return catalogue::get(name.effect).count(effects::Kind::nonlinear) == 0;
}

bool is_judged(const Diagnosis& result, const NamedEffect& name) {
  return is_linear(name) && !is_confirmed_by_held_out(result, name);
}

bool holds_zero(const estimation::Identification& fitted, const NamedEffect& name) {
  bool any = false;
  for (const Estimate& e : fitted.estimates) {
    if (e.effect != name.effect || e.fixed || !e.low || !e.high) continue;
    if (name.order && fitted.terms[e.ref.term].label() != label_of(name)) continue;
    any = true;
    if (*e.low > 0.0 || *e.high < 0.0) return false;
  }
  return any;
}

}  // namespace

void take_back_where_refit_holds_zero(const data::Dataset& dataset, const model::Model& model,
                                      const estimation::PipelineOptions& pipeline, Diagnosis& result) {
  if (result.verdict != Verdict::missing_effect ||
      std::ranges::none_of(result.named, [&](const NamedEffect& name) { return is_judged(result, name); }))
    return;
  model::Model extended = model;
  for (const NamedEffect& name : result.named) extended = with_effect(extended, parse_effect(label_of(name)));
  estimation::PipelineOptions options = pipeline;
  options.ready = nullptr;
  const auto fitted = estimation::identify(dataset, extended, options);
  estimation::count_biases(*fitted, dataset, extended, options);
  std::erase_if(result.named, [&](const NamedEffect& name) {
    if (!is_judged(result, name) || !holds_zero(*fitted, name)) return false;
    note_taken_back(result, name,
                    "with the biases of filters and noise, as `add` counts them, its values do not differ from zero");
    return true;
  });
}

}  // namespace flexspline::selection
