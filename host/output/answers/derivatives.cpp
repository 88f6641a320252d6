#include "host/output/answers/derivatives.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::output {
namespace {

using measurement::DerivativeComparison;
using measurement::DerivativeMethod;
using nlohmann::json;

std::string position_unit(data::Axis axis) {
  return axis == data::Axis::rotary ? "rad" : "m";
}

std::string scaled(const std::optional<double>& value, double by, int digits = 3) {
  return value ? number(*value * by, digits) : "-";
}

// The methods that a picture can show side by side, each with its colour.
constexpr std::array<std::pair<std::string_view, const char*>, 4> kDrawn = {{{"backward", "#c9c9c9"},
                                                                             {"h2-bilinear", "#8a5a00"},
                                                                             {"butterworth-zero-phase", "#1f4e9c"},
                                                                             {"kalman-rts", "#c43b2f"}}};
constexpr double kWidth = 820.0, kLeft = 90.0, kRight = 780.0, kHeight = 270.0, kAbove = 40.0, kBelow = 40.0;

using Signal = std::vector<double> DerivativeMethod::*;

// One panel. Its scale is that of the smooth methods: what is out of it is cut off.
class Panel {
 public:
  Panel(const DerivativeComparison& c, Signal signal, std::size_t first, std::size_t last, double top)
      : c_(c), signal_(signal), first_(first), last_(last), top_(top) {
    for (const auto& [name, colour] : kDrawn)
      if (name != "backward" && name != "h2-bilinear")
        for (std::size_t k = first; k < last; ++k) {
          low_ = std::min(low_, method(name)[k]);
          high_ = std::max(high_, method(name)[k]);
        }
    const double margin = 0.08 * (high_ - low_) + 1e-12;
    low_ -= margin;
    high_ += margin;
  }

  std::string text(const std::string& label) const {
    std::string out =
        fmt::format("<text x=\"{}\" y=\"{:.1f}\" font-weight=\"bold\">{}</text>\n", kLeft, top_ + 16.0, label);
    for (int line = 0; line <= 4; ++line) {
      const double share = line / 4.0, y = low_ + share * (high_ - low_);
      const double t = c_.time_s[first_] + share * (c_.time_s[last_ - 1] - c_.time_s[first_]);
      out += fmt::format(
          "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1f}\" "
          "text-anchor=\"end\">{:.3g}</text><text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g} s</text>\n",
          kLeft, kRight, py(y), py(y), kLeft - 6.0, py(y) + 4.0, y, kLeft + share * (kRight - kLeft), bottom() + 16.0,
          t);
    }
    for (const auto& [name, colour] : kDrawn) out += curve(name, colour);
    return out;
  }

 private:
  const std::vector<double>& method(std::string_view name) const {
    return (*std::ranges::find(c_.methods, name, &DerivativeMethod::name)).*signal_;
  }
  double bottom() const { return top_ + kHeight - kBelow; }
  double py(double y) const {
    return bottom() - (std::clamp(y, low_, high_) - low_) / (high_ - low_) * (bottom() - top_ - kAbove);
  }
  std::string curve(std::string_view name, const char* colour) const {
    const std::vector<double>& y = method(name);
    if (y.empty()) return "";
    constexpr std::size_t kMostPoints = 1500;
    const std::size_t every = std::max<std::size_t>(1, (last_ - first_) / kMostPoints);
    std::string points;
    for (std::size_t k = first_; k < last_; k += every)
      points += fmt::format(
          "{:.1f},{:.1f} ",
          kLeft + static_cast<double>(k - first_) / static_cast<double>(last_ - 1 - first_) * (kRight - kLeft),
          py(y[k]));
    return fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\" points=\"{}\"/>\n", colour, points);
  }

  const DerivativeComparison& c_;
  Signal signal_;
  std::size_t first_, last_;
  double top_, low_ = std::numeric_limits<double>::infinity(), high_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

std::string derivatives_text(const std::vector<DerivativeComparison>& found, data::Axis axis) {
  const std::string unit = position_unit(axis);
  std::string text;
  for (const DerivativeComparison& c : found) {
    text += wrapped(
        fmt::format("{}, {}: filters of {:.3g} Hz; noise of the position {:.3g} {} by likelihood{}, so the smoother's "
                    "corner is {:.3g} Hz; reference {}, {:.3g} {}/s and {:.3g} {}/s^2 rms",
                    c.experiment, c.column, c.cutoff_hz, std::sqrt(c.covariances.position_variance), unit,
                    c.step ? fmt::format(" (step {:.3g})", *c.step) : "", c.corner_hz, c.reference, c.velocity_rms,
                    unit, c.acceleration_rms, unit),
        0);
    Table table({"method", "noise " + unit + "/s", unit + "/s^2", "lag ms", "differs " + unit + "/s", unit + "/s^2"},
                "lr");
    for (const DerivativeMethod& m : c.methods)
      table.row({m.name, scaled(m.velocity_noise, 1.0), scaled(m.acceleration_noise, 1.0), scaled(m.lag_s, 1e3),
                 scaled(m.velocity_difference, 1.0), scaled(m.acceleration_difference, 1.0)});
    text += "\n" + table.text() + "\n\n";
  }
  return text +
         wrapped(
             "noise: what the position's noise leaves in velocity and acceleration, rms; - where it does not stay "
             "bounded. lag: behind the reference. differs: rms of what differs from the reference, noise and lag "
             "together.");
}

json derivatives_json(const std::vector<DerivativeComparison>& found, data::Axis axis) {
  json comparisons = json::array();
  for (const DerivativeComparison& c : found) {
    json methods = json::array();
    for (const DerivativeMethod& m : c.methods)
      methods.push_back({{"method", m.name},
                         {"explanation", std::string(m.explanation)},
                         {"velocity_noise", json_number(m.velocity_noise)},
                         {"acceleration_noise", json_number(m.acceleration_noise)},
                         {"lag_s", json_number(m.lag_s)},
                         {"velocity_difference", json_number(m.velocity_difference)},
                         {"acceleration_difference", json_number(m.acceleration_difference)}});
    comparisons.push_back({{"experiment", c.experiment},
                           {"column", std::string(c.column)},
                           {"reference", std::string(c.reference)},
                           {"cutoff_hz", json_number(c.cutoff_hz)},
                           {"step", json_number(c.step)},
                           {"position_noise", json_number(std::sqrt(c.covariances.position_variance))},
                           {"jerk_density", json_number(c.covariances.jerk_density)},
                           {"smoother_corner_hz", json_number(c.corner_hz)},
                           {"velocity_rms", json_number(c.velocity_rms)},
                           {"acceleration_rms", json_number(c.acceleration_rms)},
                           {"methods", std::move(methods)}});
  }
  const std::string unit = position_unit(axis);
  return {{"format", "flexspline-derivatives/1"},
          {"position_unit", unit},
          {"velocity_unit", unit + "/s"},
          {"acceleration_unit", unit + "/s^2"},
          {"comparisons", std::move(comparisons)}};
}

std::string derivatives_picture(const DerivativeComparison& found, data::Axis axis, double from_s, double to_s) {
  const auto at = [&](double t) {
    return static_cast<std::size_t>(std::ranges::lower_bound(found.time_s, t) - found.time_s.begin());
  };
  const std::size_t first = at(from_s), last = at(to_s);
  if (last < first + 2)
    throw std::invalid_argument(
        fmt::format("{} has no samples from {} s to {} s to draw; it begins at {} s and ends at {} s", found.experiment,
                    from_s, to_s, found.time_s.front(), found.time_s.back()));
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      kWidth, 2.0 * kHeight + 20.0);
  double x = kLeft + 250.0;
  for (const auto& [name, colour] : kDrawn) {
    svg += fmt::format("<text x=\"{}\" y=\"16\" fill=\"{}\">{}</text>\n", x, colour, name);
    x += 24.0 + 7.0 * static_cast<double>(name.size());
  }
  const std::string unit = position_unit(axis);
  svg += Panel(found, &DerivativeMethod::velocity, first, last, 0.0).text("velocity, " + unit + "/s");
  svg += Panel(found, &DerivativeMethod::acceleration, first, last, kHeight).text("acceleration, " + unit + "/s^2");
  return svg + "</svg>\n";
}

}  // namespace flexspline::output
