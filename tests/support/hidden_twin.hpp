// A drive of the twin that hides one effect, as the host sees it: for campaigns that ask what is named and added.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::tests {

struct HiddenTwin {
  plant::PlantFile file = plant::demo_plant();
  data::Dataset dataset;
  model::Model base;  // without what is hidden

  HiddenTwin(const std::string& hidden, double scale, std::uint64_t seed, double friction_variation) {
    plant::hide(file.drive, hidden, scale);
    file.drive.friction_variation = friction_variation;
    dataset = dataset_of(file.drive, plant::record_all(file.drive, file.experiments, seed));
    base = model_of(file.drive, false, false);
  }
  const plant::Effect& truth() const {
    return *std::find_if(file.drive.effects.begin(), file.drive.effects.end(),
                         [](const plant::Effect& e) { return e.hidden; });
  }
  selection::Diagnosis diagnose() const { return selection::diagnose(dataset, base, {}); }
};

// "kinematic_error:2+torsion_zero"; empty where nothing is named.
inline std::string names(const selection::Diagnosis& found) {
  std::string list;
  for (const selection::NamedEffect& n : found.named)
    list += (list.empty() ? "" : "+") + n.effect + (n.order ? fmt::format(":{:g}", *n.order) : "");
  return list;
}

}  // namespace flexspline::tests
