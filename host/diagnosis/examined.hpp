// A balance and all that likelihood found on it.
#pragma once

#include <vector>

#include "host/comparison/noise_floor.hpp"
#include "host/diagnosis/rivals.hpp"
#include "host/diagnosis/trials.hpp"

namespace flexspline::diagnosis {

struct Examined {
  Search search;
  std::vector<Trial> trials;  // best first
  comparison::NoiseFloor floor;

  bool names_one() const { return !trials.empty() && passes(trials.front()); }
};

}  // namespace flexspline::diagnosis
