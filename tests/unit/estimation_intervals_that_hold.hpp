// How often an interval holds the truth, before and after biases are counted.
#pragma once

#include <memory>

#include "host/engine/estimation/standard_intervals.hpp"

namespace flexspline::estimation {

struct IntervalsThatHold {
  int before = 0, after = 0;
};

// Of the model's first parameter, over data with seeds 1 to 10. `dataset_of(seed)` makes them; `look(identification)`
// sees each fit once its biases are counted.
template <class DatasetOf, class Look>
IntervalsThatHold intervals_that_hold(const DatasetOf& dataset_of, const model::Model& model,
                                      const PipelineOptions& options, double truth, const Look& look) {
  IntervalsThatHold held;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const data::Dataset dataset = dataset_of(seed);
    const std::unique_ptr<Identification> found = identify(dataset, model, options);
    const auto holds = [&] {
      return *found->estimates.front().low <= truth && truth <= *found->estimates.front().high;
    };
    held.before += holds();
    count_biases(*found, dataset, model, options);
    held.after += holds();
    look(*found);
  }
  return held;
}

}  // namespace flexspline::estimation
