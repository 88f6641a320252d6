// The figures of Taghirad and Belanger's report that can be made without its recordings: from its own models
// (hil/thesis_models), and from recordings of the twin with the parameters of its tables (hil/rhs100) in the place of
// its experiments.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hil/thesis_figures/plot.hpp"

namespace flexspline::thesis_figures {

struct Drawn {
  std::vector<Panel> panels;
  std::string ours;  ///< what the figure shows, in numbers measured on it
};

struct Figure {
  int number = 0;
  std::string title;   ///< as in the report, short
  std::string theirs;  ///< what the report says of it
  Drawn (*make)(std::uint64_t seed) = nullptr;
  std::string why_not;  ///< where nothing is made
};

/// All from 1 to 60, in order.
const std::vector<Figure>& figures();

std::vector<Figure> model_figures();       ///< 4 to 11, 19, 20: simulations of the report's blocks
std::vector<Figure> motor_figures();       ///< 22 to 27: the bare motor
std::vector<Figure> compliance_figures();  ///< 28 to 35: output locked
std::vector<Figure> friction_figures();    ///< 37 to 42: output free
std::vector<Figure> system_figures();      ///< 45 to 60: the whole drive

/// Root mean square of b - a over that of a, in percent.
double error_percent(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace flexspline::thesis_figures
