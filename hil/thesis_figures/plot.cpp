#include "hil/thesis_figures/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <utility>

namespace flexspline::thesis_figures {
namespace {

constexpr double kWidth = 720.0, kPanelHeight = 260.0, kTop = 34.0;
constexpr double kLeft = 86.0, kRight = 16.0, kAbove = 26.0, kBelow = 46.0;
constexpr std::size_t kMostPoints = 1500;  // of a curve; more are not seen
constexpr std::array<const char*, 5> kColours{"#1f4e9c", "#c43b2f", "#2b8a3e", "#8a5a00", "#6b3fa0"};

const char* dashes(Stroke stroke) {
  switch (stroke) {
    case Stroke::solid:
      return "";
    case Stroke::dashed:
      return " stroke-dasharray=\"7 4\"";
    case Stroke::dotted:
      return " stroke-dasharray=\"2 3\"";
    case Stroke::dash_dotted:
      return " stroke-dasharray=\"8 3 2 3\"";
  }
  return "";
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void widen() {
    const double span = high - low;
    const double by = span > 0.0 ? 0.04 * span : std::max(1e-12, 0.1 * std::abs(high));
    low -= by;
    high += by;
  }
  // 1, 2 or 5 times a power of ten, four to nine of them.
  double step() const {
    const double rough = (high - low) / 6.0, power = std::pow(10.0, std::floor(std::log10(rough)));
    const double share = rough / power;
    return power * (share < 1.5 ? 1.0 : share < 3.5 ? 2.0 : share < 7.5 ? 5.0 : 10.0);
  }
};

struct Point {
  double x = 0.0, y = 0.0;
};

// Distance from a line through two points, or from the first where they are one.
double distance(const Point& p, const Point& a, const Point& b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length = std::hypot(dx, dy);
  if (length < 1e-9) return std::hypot(p.x - a.x, p.y - a.y);
  return std::abs(dx * (p.y - a.y) - dy * (p.x - a.x)) / length;
}

// Without the points that a line between their neighbours passes within `tolerance` (Douglas and Peucker 1973).
std::vector<Point> simplified(const std::vector<Point>& points, double tolerance) {
  if (points.size() < 3) return points;
  std::vector<bool> kept(points.size(), false);
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, points.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    std::size_t farthest = first;
    double most = tolerance;
    for (std::size_t k = first + 1; k < last; ++k)
      if (const double d = distance(points[k], points[first], points[last]); d > most) {
        most = d;
        farthest = k;
      }
    if (farthest == first) continue;
    kept[farthest] = true;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
  std::vector<Point> left;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (kept[k]) left.push_back(points[k]);
  return left;
}

class PanelWriter {
 public:
  PanelWriter(const Panel& panel, double top) : panel_(panel), top_(top) {
    for (const Curve& c : panel.curves)
      for (std::size_t k = 0; k < c.x.size(); ++k) {
        if (!std::isfinite(c.y[k])) continue;
        x_.add(c.x[k]);
        y_.add(c.y[k]);
      }
    if (!(x_.high >= x_.low)) throw std::invalid_argument(panel.title + ": there is no point to draw");
    x_.widen();
    y_.widen();
  }

  std::string text() const {
    std::string out = fmt::format("<text x=\"{}\" y=\"{}\" font-weight=\"bold\">{}</text>\n", kLeft, top_ + 17.0,
                                  escaped(panel_.title));
    out += grid();
    for (std::size_t k = 0; k < panel_.curves.size(); ++k) out += curve(k);
    return out + legend();
  }

 private:
  double right() const { return kWidth - kRight; }
  double bottom() const { return top_ + kPanelHeight - kBelow; }
  double px(double x) const { return kLeft + (x - x_.low) / (x_.high - x_.low) * (right() - kLeft); }
  double py(double y) const { return bottom() - (y - y_.low) / (y_.high - y_.low) * (bottom() - top_ - kAbove); }

  std::string grid() const {
    std::string out = fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#888\"/>\n", kLeft,
        top_ + kAbove, right() - kLeft, bottom() - top_ - kAbove);
    for (double v = std::ceil(x_.low / x_.step()) * x_.step(); v <= x_.high; v += x_.step())
      out += fmt::format(
          "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/>"
          "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4:.4g}</text>\n",
          px(v), top_ + kAbove, bottom(), bottom() + 15.0, std::abs(v) < 1e-9 * x_.step() ? 0.0 : v);
    for (double v = std::ceil(y_.low / y_.step()) * y_.step(); v <= y_.high; v += y_.step())
      out += fmt::format(
          "<line x1=\"{1:.1f}\" x2=\"{2:.1f}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#ddd\"/>"
          "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
          py(v), kLeft, right(), kLeft - 6.0, py(v) + 4.0, std::abs(v) < 1e-9 * y_.step() ? 0.0 : v);
    return out +
           fmt::format(
               "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
               "<text x=\"14\" y=\"{:.1f}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {:.1f})\">{}</text>\n",
               0.5 * (kLeft + right()), bottom() + 33.0, escaped(panel_.x_label), 0.5 * (top_ + kAbove + bottom()),
               0.5 * (top_ + kAbove + bottom()), escaped(panel_.y_label));
  }

  std::string curve(std::size_t at) const {
    const Curve& c = panel_.curves[at];
    const std::size_t every = std::max<std::size_t>(1, c.x.size() / kMostPoints);
    std::vector<Point> all;
    for (std::size_t k = 0; k < c.x.size(); k += every)
      if (std::isfinite(c.y[k])) all.push_back({px(c.x[k]), py(c.y[k])});
    constexpr double kUnseen = 0.3;  // of a pixel
    std::string points;
    for (const Point& p : simplified(all, kUnseen)) points += fmt::format("{:.4g},{:.4g} ", p.x, p.y);
    return fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\"{} points=\"{}\"/>\n",
                       kColours[at % kColours.size()], dashes(c.stroke), points);
  }

  std::string legend() const {
    std::string out;
    double at = right();
    for (std::size_t k = panel_.curves.size(); k-- > 0;) {
      const Curve& c = panel_.curves[k];
      if (c.label.empty()) continue;
      at -= 34.0 + 6.2 * static_cast<double>(c.label.size());
      out += fmt::format(
          "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"1.3\"{}/>"
          "<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
          at, at + 22.0, top_ + 13.0, top_ + 13.0, kColours[k % kColours.size()], dashes(c.stroke), at + 26.0,
          top_ + 17.0, escaped(c.label));
    }
    return out;
  }

  const Panel& panel_;
  double top_;
  Range x_, y_;
};

}  // namespace

std::string svg(const std::string& title, const std::vector<Panel>& panels) {
  const double height = kTop + kPanelHeight * static_cast<double>(panels.size());
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"20\" font-size=\"14\">{3}</text>\n",
      kWidth, height, kLeft, escaped(title));
  for (std::size_t k = 0; k < panels.size(); ++k)
    out += PanelWriter(panels[k], kTop + kPanelHeight * static_cast<double>(k)).text();
  return out + "</svg>\n";
}

std::string csv(const std::vector<Panel>& panels) {
  std::string out = "panel,curve,x,y\n";
  for (const Panel& panel : panels)
    for (const Curve& c : panel.curves)
      for (std::size_t k = 0; k < c.x.size(); ++k)
        out += fmt::format("\"{}\",\"{}\",{:.9g},{:.9g}\n", panel.title, c.label, c.x[k], c.y[k]);
  return out;
}

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace flexspline::thesis_figures
