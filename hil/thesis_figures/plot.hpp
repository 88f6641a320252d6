// Curves as SVG and CSV: no more than the figures of the report need.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace flexspline::thesis_figures {

enum class Stroke { solid, dashed, dotted, dash_dotted };

struct Curve {
  std::string label;
  std::vector<double> x, y;  ///< of equal length
  Stroke stroke = Stroke::solid;
};

struct Panel {
  std::string title;
  std::string x_label, y_label;
  std::vector<Curve> curves;
};

/// The panels below each other. Throws std::invalid_argument where a panel has no finite point.
std::string svg(const std::string& title, const std::vector<Panel>& panels);

/// One line a point: panel, curve, x, y.
std::string csv(const std::vector<Panel>& panels);

/// Throws std::runtime_error naming the file that cannot be written.
void write(const std::filesystem::path& file, const std::string& text);

}  // namespace flexspline::thesis_figures
