#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "host/output/answers/effect_curve.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::output {
namespace {

// Dots of a Braille pattern, by column and row of its cell (Unicode 2800 and on).
constexpr unsigned kBrailleDots[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void hold(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double share(double value) const { return (value - low) / (high - low); }
};

// A picture of dots, (0, 0) at the upper left.
class Dots {
 public:
  Dots(std::size_t columns, std::size_t rows) : columns_(columns), rows_(rows), set_(columns * rows, false) {}

  void set(double column, double row) {
    const auto c = std::clamp<long>(std::lround(column), 0, static_cast<long>(columns_) - 1);
    const auto r = std::clamp<long>(std::lround(row), 0, static_cast<long>(rows_) - 1);
    set_[static_cast<std::size_t>(r) * columns_ + static_cast<std::size_t>(c)] = true;
  }
  void line(double c0, double r0, double c1, double r1) {
    const int steps = static_cast<int>(std::ceil(std::max({std::abs(c1 - c0), std::abs(r1 - r0), 1.0})));
    for (int k = 0; k <= steps; ++k) {
      const double share = static_cast<double>(k) / steps;
      set(c0 + share * (c1 - c0), r0 + share * (r1 - r0));
    }
  }
  bool at(std::size_t column, std::size_t row) const { return set_[row * columns_ + column]; }

 private:
  std::size_t columns_, rows_;
  std::vector<bool> set_;
};

std::string braille_cell(const Dots& dots, std::size_t column, std::size_t row) {
  unsigned code = 0x2800;
  for (std::size_t c = 0; c < 2; ++c)
    for (std::size_t r = 0; r < 4; ++r)
      if (dots.at(2 * column + c, 4 * row + r)) code |= kBrailleDots[c][r];
  if (code == 0x2800) return " ";
  // Three bytes of UTF-8.
  return {static_cast<char>(0xE0U | (code >> 12U)), static_cast<char>(0x80U | ((code >> 6U) & 0x3FU)),
          static_cast<char>(0x80U | (code & 0x3FU))};
}

// Of two rows of dots to a character the lower, upper or both.
std::string ascii_cell(const Dots& dots, std::size_t column, std::size_t row) {
  const bool upper = dots.at(column, 2 * row), lower = dots.at(column, 2 * row + 1);
  return upper && lower ? ":" : upper ? "'" : lower ? "." : " ";
}

std::string padded_left(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

}  // namespace

bool takes_braille() {
  const char* terminal = std::getenv("TERM");
  if (terminal != nullptr && std::strcmp(terminal, "dumb") == 0) return false;
  // As the C library chooses the character set.
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    std::string locale(value);
    std::transform(locale.begin(), locale.end(), locale.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return locale.find("utf-8") != std::string::npos || locale.find("utf8") != std::string::npos;
  }
  return false;
}

std::string curve_text(const EffectCurve& curve, bool braille, std::size_t width, std::size_t height) {
  Range x, y;
  for (std::size_t k = 0; k < curve.y.size(); ++k) {
    x.hold(curve.x[k]);
    y.hold(curve.y[k]);
  }
  if (!(x.high > x.low) || !(y.high >= y.low)) return {};
  // Zero belongs into the picture of a torque: what is constant would have no size without it.
  y.hold(0.0);
  if (!(y.high > y.low)) y.hold(1.0);
  const std::size_t columns = width * (braille ? 2 : 1), rows = height * (braille ? 4 : 2);
  Dots dots(columns, rows);
  const auto column = [&](double value) { return x.share(value) * static_cast<double>(columns - 1); };
  const auto row = [&](double value) { return (1.0 - y.share(value)) * static_cast<double>(rows - 1); };
  for (std::size_t k = 0; k < curve.y.size(); ++k) {
    if (!std::isfinite(curve.y[k])) continue;
    const bool joined = k > 0 && std::isfinite(curve.y[k - 1]);
    const std::size_t from = joined ? k - 1 : k;
    dots.line(column(curve.x[from]), row(curve.y[from]), column(curve.x[k]), row(curve.y[k]));
  }

  const std::size_t zero = static_cast<std::size_t>(std::lround(row(0.0))) / (braille ? 4 : 2);
  std::vector<std::string> marks(height);
  marks.front() = number(y.high, 3);
  marks.back() = number(y.low, 3);
  marks[std::min(zero, height - 1)] = "0";
  std::size_t margin = 0;
  for (const std::string& mark : marks) margin = std::max(margin, mark.size());
  const char* wall = braille ? "\u2502" : "|";
  const char* floor = braille ? "\u2500" : "-";
  const char* corner = braille ? "\u2514" : "+";

  std::string text = fmt::format("  {}{}\n", curve.y_label, curve.caption.empty() ? "" : ": " + curve.caption);
  for (std::size_t r = 0; r < height; ++r) {
    std::string line = "  " + padded_left(marks[r], margin) + " " + wall;
    for (std::size_t c = 0; c < width; ++c) line += braille ? braille_cell(dots, c, r) : ascii_cell(dots, c, r);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  text += "  " + std::string(margin, ' ') + " " + corner;
  for (std::size_t c = 0; c < width; ++c) text += floor;
  const std::string low = number(x.low, 3), high = number(x.high, 3);
  const std::size_t between = width - std::min(width, low.size() + high.size() + curve.x_label.size());
  text += "\n  " + std::string(margin + 2, ' ') + low + std::string(between / 2, ' ') + curve.x_label +
          std::string(between - between / 2, ' ') + high;
  return text;
}

}  // namespace flexspline::output
