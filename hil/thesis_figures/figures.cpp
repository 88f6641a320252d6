#include "hil/thesis_figures/figures.hpp"

#include <algorithm>
#include <cmath>

namespace flexspline::thesis_figures {
namespace {

std::vector<Figure> not_made() {
  return {{1, "harmonic drive components", "a drawing", nullptr, "a drawing of parts: no quantity in it"},
          {2, "set-up, free load", "a photograph", nullptr, "a photograph of the report's machine"},
          {3, "set-up, locked load", "a photograph", nullptr, "a photograph of the report's machine"},
          {13, "harmonic drive as a black box", "a drawing", nullptr, "a drawing; its signals are in figure 12"},
          {16, "harmonic drive model simulated", "a block diagram", nullptr,
           "a block diagram: LossyDrive; its answer is in figures 15 and 45"},
          {17, "whole drive simulated, free", "a block diagram", nullptr,
           "a block diagram: DriveSystem; its answer is in figures 45 and 55 to 60"},
          {18, "whole drive simulated, locked", "a block diagram", nullptr,
           "a block diagram: DriveSystem; its answer is in figures 45 and 48 to 54"},
          {21, "motor simulated, to test identification", "a block diagram", nullptr,
           "a block diagram: the sets table-1 of rhs-100; its result is table 1"},
          {36, "transmission model with friction", "a drawing", nullptr, "a drawing: eq. 80 to 82; see figure 15"},
          {43, "locked simulation", "a block diagram", nullptr, "a block diagram; see figures 48 to 54"},
          {44, "free simulation", "a block diagram", nullptr, "a block diagram; see figures 55 to 60"}};
}

}  // namespace

const std::vector<Figure>& figures() {
  static const std::vector<Figure> all = [] {
    std::vector<Figure> list = not_made();
    for (const auto& part :
         {model_figures(), motor_figures(), compliance_figures(), friction_figures(), system_figures()})
      list.insert(list.end(), part.begin(), part.end());
    std::sort(list.begin(), list.end(), [](const Figure& a, const Figure& b) { return a.number < b.number; });
    return list;
  }();
  return all;
}

double error_percent(const std::vector<double>& a, const std::vector<double>& b) {
  double error = 0.0, size = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    error += (b[k] - a[k]) * (b[k] - a[k]);
    size += a[k] * a[k];
  }
  return 100.0 * std::sqrt(error / size);
}

}  // namespace flexspline::thesis_figures
