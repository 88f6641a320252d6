// Records whose signals are written down in a test.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <utility>

#include "host/input/data/dataset.hpp"

namespace flexspline::tests {

// Its effort is not held between samples. `fill(t, e)` appends the columns of the instant t, s.
template <class Fill>
data::Experiment written_experiment(std::string name, double sample_s, std::size_t samples, Fill fill) {
  data::Experiment e;
  e.name = std::move(name);
  e.sample_s = sample_s;
  e.current_hold = data::CurrentHold::none;
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = sample_s * static_cast<double>(k);
    e.time_s.push_back(t);
    fill(t, e);
  }
  e.segments = {{0, e.size()}};
  return e;
}

// One such record for each value, which is its name, too. `fill(value, t, e)`.
template <class Fill>
data::Dataset written_dataset(std::initializer_list<double> values, double sample_s, std::size_t samples, Fill fill) {
  data::Dataset dataset;
  for (const double value : values)
    dataset.experiments.push_back(written_experiment(std::to_string(value), sample_s, samples,
                                                     [&](double t, data::Experiment& e) { fill(value, t, e); }));
  return dataset;
}

}  // namespace flexspline::tests
