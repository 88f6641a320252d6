#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hil/thesis_figures/figures.hpp"
#include "hil/thesis_figures/twin_runs.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"

namespace flexspline::thesis_figures {
namespace {

namespace published = report::published;

constexpr double kFromS = 4.0, kToS = 6.0;

// A locked run as the report's regression sees it: torsion by the motor's position, its rate, and the torque, all
// through the same zero-phase filter.
struct LockedRun {
  plant::Record record;
  std::vector<double> torsion, rate, torque;

  LockedRun(const rhs100::Set& set, const char* name, std::uint64_t seed) : LockedRun(twin_record(set, name, seed)) {}
  explicit LockedRun(plant::Record made) : record(std::move(made)) {
    torsion = zero_phase(record.motor_position_rad, kCutoffHz, kHz);
    for (double& x : torsion) x /= published::kGearRatio;
    rate.assign(torsion.size(), 0.0);
    for (std::size_t k = 1; k + 1 < torsion.size(); ++k) rate[k] = 0.5 * kHz * (torsion[k + 1] - torsion[k - 1]);
    torque = zero_phase(record.torque_nm, kCutoffHz, kHz);
  }

  std::vector<double> model(double k1, double k3, double damping, double alpha) const {
    std::vector<double> out;
    for (std::size_t k = 0; k < torsion.size(); ++k)
      out.push_back((k1 + k3 * torsion[k] * torsion[k]) * torsion[k] +
                    damping * std::copysign(std::pow(std::abs(rate[k]), alpha), rate[k]));
    return out;
  }
  // Linear regression of eq. 75 with K1 and T_st: two normal equations.
  std::array<double, 2> regress(double alpha) const {
    double xx = 0.0, xd = 0.0, dd = 0.0, xy = 0.0, dy = 0.0;
    for (std::size_t k = 0; k < torsion.size(); ++k) {
      const double x = torsion[k], d = std::copysign(std::pow(std::abs(rate[k]), alpha), rate[k]), y = torque[k];
      xx += x * x;
      xd += x * d;
      dd += d * d;
      xy += x * y;
      dy += d * y;
    }
    const double det = xx * dd - xd * xd;
    return {(xy * dd - dy * xd) / det, (dy * xx - xy * xd) / det};
  }
  Curve loop(std::string label, const std::vector<double>& y, Stroke stroke) const {
    Curve c{std::move(label), {}, {}, stroke};
    for (std::size_t k = 0; k < y.size(); ++k)
      if (record.time_s[k] >= kFromS && record.time_s[k] <= kToS) {
        c.x.push_back(1e3 * torsion[k]);
        c.y.push_back(y[k]);
      }
    return c;
  }
  Panel panel(const char* name) const {
    return {name, "torsion, mrad", "torque, N m", {loop("measured (twin)", torque, Stroke::solid)}};
  }
};

Drawn hysteresis(std::uint64_t seed) {
  const LockedRun run(rhs100::table_4(), "100-8", seed);
  const auto panel = run.panel("100-8");
  double loss = 0.0;
  const Curve& c = panel.curves.front();
  for (std::size_t k = 1; k < c.x.size(); ++k) loss += 0.5e-3 * (c.y[k] + c.y[k - 1]) * (c.x[k] - c.x[k - 1]);
  return {{panel}, fmt::format("{:.3g} J are lost in a cycle", loss)};
}

double area(const Curve& loop) {
  double sum = 0.0;
  for (std::size_t k = 1; k < loop.x.size(); ++k)
    sum += 0.5 * (loop.y[k] + loop.y[k - 1]) * (loop.x[k] - loop.x[k - 1]);
  return sum;
}

// Eq. 66 along a torsion, over its limit Tc: with u = 1 - s(v) T/Tc the law is u' = -rate |v| u^2, so that u becomes
// u / (1 + rate |step| u), whatever the step.
std::vector<double> modified_dahl(const std::vector<double>& torsion, double rate) {
  std::vector<double> share(torsion.size(), 0.0);
  for (std::size_t k = 1; k < torsion.size(); ++k) {
    const double step = torsion[k] - torsion[k - 1], sign = step < 0.0 ? -1.0 : 1.0;
    const double u = 1.0 - sign * share[k - 1];
    share[k] = sign * (1.0 - u / (1.0 + rate * std::abs(step) * u));
  }
  return share;
}

// Best K1, K3 and Tc of eq. 69 for given shares: normal equations of columns of one size, by elimination.
std::vector<double> best_dynamic(const LockedRun& run, const std::vector<double>& share, double largest) {
  constexpr std::size_t kColumns = 3;
  std::array<std::array<double, kColumns + 1>, kColumns> a{};
  const auto columns = [&](std::size_t k) {
    const double x = run.torsion[k] / largest;
    return std::array{x, x * x * x, share[k]};
  };
  for (std::size_t k = 0; k < share.size(); ++k) {
    const auto c = columns(k);
    for (std::size_t i = 0; i < kColumns; ++i) {
      for (std::size_t j = 0; j < kColumns; ++j) a[i][j] += c[i] * c[j];
      a[i][kColumns] += c[i] * run.torque[k];
    }
  }
  for (std::size_t i = 0; i < kColumns; ++i)
    for (std::size_t r = 0; r < kColumns; ++r) {
      if (r == i) continue;
      const double factor = a[r][i] / a[i][i];
      for (std::size_t j = i; j <= kColumns; ++j) a[r][j] -= factor * a[i][j];
    }
  std::vector<double> torque(share.size(), 0.0);
  for (std::size_t k = 0; k < share.size(); ++k) {
    const auto c = columns(k);
    for (std::size_t i = 0; i < kColumns; ++i) torque[k] += c[i] * a[i][kColumns] / a[i][i];
  }
  return torque;
}

// The dynamic damping of eq. 69 that fits best: beta Tc by a scan of its whole range, which no local optimum hides.
std::vector<double> dynamic_model(const LockedRun& run) {
  double largest = 0.0;
  for (const double x : run.torsion) largest = std::max(largest, std::abs(x));
  constexpr int kTried = 60;
  std::vector<double> best;
  for (int k = 0; k < kTried; ++k) {
    const double rate = 0.1 / largest * std::pow(1e4, static_cast<double>(k) / (kTried - 1));
    std::vector<double> tried = best_dynamic(run, modified_dahl(run.torsion, rate), largest);
    if (best.empty() || error_percent(run.torque, tried) < error_percent(run.torque, best)) best = std::move(tried);
  }
  return best;
}

// Run 100-8 with the damping of eq. 68 in the twin, which is circular, and with the law of eq. 66 in its place.
Drawn static_and_dynamic(std::uint64_t seed) {
  rhs100::Set set = rhs100::table_4();
  rhs100::Set other = set;
  plant::Drive& drive = other.experiments.front().drive;
  plant::without(drive, "structural_damping");
  drive.effects.push_back({"modified_dahl_hysteresis",
                           true,
                           false,
                           true,
                           {{"torque", "N*m", 4.0, true}, {"stiffness", "N*m/rad", 8e3, true}}});
  const std::pair<const char*, LockedRun> runs[] = {{"eq. 68", LockedRun(set, "100-8", seed)},
                                                    {"eq. 66", LockedRun(other, "100-8", seed)}};
  Drawn drawn;
  for (const auto& [truth, run] : runs) {
    const auto [k1, damping] = run.regress(0.5);
    const auto of_rate = run.model(k1, 0.0, damping, 0.5), of_state = dynamic_model(run);
    Panel panel = run.panel("100-8");
    panel.title = fmt::format("100-8, the twin with the damping of {}", truth);
    panel.curves.push_back(run.loop("static", of_rate, Stroke::dashed));
    panel.curves.push_back(run.loop("dynamic", of_state, Stroke::dotted));
    const double measured = area(panel.curves[0]);
    drawn.ours +=
        fmt::format("{}twin with {}: torque, static {:.2g} %, dynamic {:.2g} %; dynamic loop {:.0f} % of the area",
                    drawn.ours.empty() ? "" : "; ", truth, error_percent(run.torque, of_rate),
                    error_percent(run.torque, of_state), 100.0 * area(panel.curves[2]) / measured);
    drawn.panels.push_back(std::move(panel));
  }
  return drawn;
}

Drawn exponents(std::uint64_t seed) {
  const LockedRun run(rhs100::table_4(), "100-8", seed);
  Drawn drawn{{run.panel("100-8")}, "torque:"};
  const std::pair<double, Stroke> kinds[] = {{1.0, Stroke::dashed}, {0.5, Stroke::dash_dotted}, {0.1, Stroke::dotted}};
  for (const auto& [alpha, stroke] : kinds) {
    const auto [k1, damping] = run.regress(alpha);
    const auto y = run.model(k1, 0.0, damping, alpha);
    drawn.panels[0].curves.push_back(run.loop(fmt::format("alpha {:g}", alpha), y, stroke));
    drawn.ours += fmt::format(" alpha {:g} {:.2g} %;", alpha, error_percent(run.torque, y));
  }
  drawn.ours += " circular: the twin has 1/2";
  return drawn;
}

Drawn half_and_third(std::uint64_t seed) {
  const LockedRun run(rhs100::table_4(), "100-8", seed);
  const auto third =
      run.model(published::kTable4Third[0].stiffness, 0.0, published::kTable4Third[0].damping, 1.0 / 3.0);
  const auto half = run.model(published::kTable4[0].stiffness, 0.0, published::kTable4[0].damping, 0.5);
  Panel panel = run.panel("100-8, the values of table 4");
  panel.curves.push_back(run.loop("alpha 1/2", half, Stroke::dashed));
  panel.curves.push_back(run.loop("alpha 1/3", third, Stroke::dotted));
  return {{panel},
          fmt::format("torque: alpha 1/2 {:.2g} %, 1/3 {:.2g} %; circular: the twin has 1/2",
                      error_percent(run.torque, half), error_percent(run.torque, third))};
}

Drawn optimal(std::uint64_t seed) {
  Drawn drawn{{}, "torque, optimal / one half, by tables 5 and 4:"};
  struct Row {
    const char* name;
    double k1, damping, alpha;
    std::size_t nominal;
  };
  // Table 5.
  for (const Row& row : {Row{"50-8", 6.9867e3, 63.68, 0.5224, 1}, Row{"50-1", 6.0737e3, 58.71, 0.4928, 2}}) {
    const LockedRun run(rhs100::table_4(), row.name, seed);
    const auto best = run.model(row.k1, 0.0, row.damping, row.alpha);
    const auto& nominal = published::kTable4[row.nominal];
    const auto half = run.model(nominal.stiffness, 0.0, nominal.damping, 0.5);
    Panel panel = run.panel(row.name);
    panel.curves.push_back(run.loop("optimal alpha", best, Stroke::dashed));
    panel.curves.push_back(run.loop("alpha 1/2", half, Stroke::dotted));
    drawn.panels.push_back(std::move(panel));
    drawn.ours += fmt::format(" {} {:.2g} % / {:.2g} %;", row.name, error_percent(run.torque, best),
                              error_percent(run.torque, half));
  }
  return drawn;
}

Drawn cubic(std::uint64_t seed) {
  const LockedRun run(rhs100::table_6(), "100-8", seed);
  const auto linear = run.model(published::kStiffness, 0.0, published::kDampingTorque, 0.5);
  const auto third = run.model(5.66e3, 1.10e9, 57.0, 0.5);  // table 6, averages
  Panel panel = run.panel("100-8, averages of tables 4 and 6");
  panel.curves.push_back(run.loop("linear", linear, Stroke::dashed));
  panel.curves.push_back(run.loop("cubic", third, Stroke::dash_dotted));
  double measured = 0.0, predicted = 0.0, straight = 0.0;
  for (std::size_t k = 0; k < run.torque.size(); ++k)
    if (std::abs(run.torque[k]) > measured) {
      measured = std::abs(run.torque[k]);
      predicted = std::abs(third[k]);
      straight = std::abs(linear[k]);
    }
  return {{panel},
          fmt::format("at the largest torque: cubic {:.2f} times the measured one, linear {:.2f} times",
                      predicted / measured, straight / measured)};
}

Drawn nominal(bool over_time, std::uint64_t seed) {
  Drawn drawn{{}, "torque, averages of eq. 79:"};
  for (const char* name : {"100-8", "50-8", "50-1", "50-7"}) {
    const LockedRun run(rhs100::table_4(), name, seed);
    const auto y = run.model(published::kStiffness, 0.0, published::kDampingTorque, 0.5);
    Panel panel = run.panel(name);
    if (over_time) {
      panel.x_label = "time, s";
      panel.curves = {part("measured (twin)", run.record, run.torque, kFromS, kToS, Stroke::solid),
                      part("model", run.record, y, kFromS, kToS, Stroke::dashed)};
    } else {
      panel.curves.push_back(run.loop("model", y, Stroke::dashed));
    }
    drawn.panels.push_back(std::move(panel));
    drawn.ours += fmt::format(" {} {:.2g} %;", name, error_percent(run.torque, y));
  }
  return drawn;
}
Drawn nominal_loops(std::uint64_t seed) {
  return nominal(false, seed);
}
Drawn nominal_torques(std::uint64_t seed) {
  return nominal(true, seed);
}

}  // namespace

std::vector<Figure> compliance_figures() {
  return {{28, "torsion in locked load: hysteresis", "a loop", hysteresis, ""},
          {29, "static and modified Dahl (dynamic) damping", "the dynamic model gives only a narrow loop",
           static_and_dynamic, ""},
          {30, "structural damping with alpha 1, 1/2, 0.1", "1/2 best: oscillations with 1, too narrow with 0.1",
           exponents, ""},
          {31, "alpha 1/2 and 1/3", "both good", half_and_third, ""},
          {32, "optimal alpha and 1/2", "a small difference", optimal, ""},
          {33, "linear and cubic stiffness", "the cubic model gives much higher torques", cubic, ""},
          {34, "nominal model, hysteresis", "acceptable match", nominal_loops, ""},
          {35, "nominal model, torque over time", "acceptable match", nominal_torques, ""}};
}

}  // namespace flexspline::thesis_figures
