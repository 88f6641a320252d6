#include "host/app/closed_loop/page.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/output/report/assets.hpp"
#include "host/output/report/page.hpp"
#include "host/output/report/trace.hpp"
#include "host/physics/model/model.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::closed_loop {
namespace {

using nlohmann::json;
using output::json_number;

constexpr std::size_t kPoints = 2000;

json json_of(const std::optional<Prediction>& p) {
  if (!p) return nullptr;
  return {{"ratio", json_number(p->ratio)},
          {"interval", {json_number(p->low), json_number(p->high)}},
          {"rms_error_rad", json_number(p->rms_error_rad)},
          {"rms_error_without_rad", json_number(p->rms_none_rad)},
          {"draws", p->draws},
          {"stable", p->stable}};
}

std::string sentence(const Comparison& c) {
  const ComparedRun& none = c.runs.front();
  const ComparedRun& best = c.runs.back();
  if (!best.outcome.fault.empty())
    return fmt::format("With compensation the drive had the fault {}.", best.outcome.fault);
  return fmt::format("With compensation the error is {} of that without.",
                     output::number(best.outcome.rms_error_rad / none.outcome.rms_error_rad, 3));
}

json traces_of(const Trace& t) {
  const report::Thinning thinning({{0, t.time_s.size()}}, kPoints);
  const auto signal = [&](const std::vector<double>& values) { return report::packed(thinning.values(values)); };
  return {{"time", report::packed(thinning.times(t.time_s))},
          {"command", signal(t.position_command_rad)},
          {"output", signal(t.output_position_rad)},
          {"error", signal(t.error_rad)},
          {"velocity", signal(t.motor_velocity_rad_s)},
          {"current", signal(t.current_a)},
          {"temperature", signal(t.temperature_c)}};
}

}  // namespace

void Comparison::take_gains(const control::DriveSetup<double>& setup) {
  velocity_loop_hz = setup.loops.velocity_gain / setup.disturbance.inertia / kTurn;
  integrator_per_s = setup.loops.integral_gain / setup.loops.velocity_gain;
  position_loop_hz = setup.loops.position_gain / kTurn;
}

void Comparison::finish() {
  seconds = runs.front().outcome.seconds;
  tick_hz = runs.front().outcome.tick_hz;
  realtime_factor = runs.front().outcome.realtime_factor;
  for (const ComparedRun& run : runs) realtime_factor = std::min(realtime_factor, run.outcome.realtime_factor);
}

json to_json(const Comparison& c) {
  json runs = json::array();
  for (const ComparedRun& run : c.runs) {
    const Outcome& o = run.outcome;
    runs.push_back({{"compensation", run.label},
                    {"model", run.model.empty() ? json() : json(run.model)},
                    {"rms_error_rad", json_number(o.rms_error_rad)},
                    {"peak_error_rad", json_number(o.peak_error_rad)},
                    {"rms_current_a", json_number(o.rms_current_a)},
                    {"peak_current_a", json_number(o.peak_current_a)},
                    {"ratio_to_none", json_number(o.rms_error_rad / c.runs.front().outcome.rms_error_rad)},
                    {"stops", o.stops},
                    {"limit_cycle", o.limit_cycle},
                    {"hold_swing_rad", json_number(o.hold_swing_rad)},
                    {"fault", o.fault.empty() ? json() : json(o.fault)},
                    {"ends_in_fault", o.ends_in_fault},
                    {"predicted", json_of(run.predicted)}});
  }
  return {{"format", "flexspline-hil/1"},
          {"scenario", c.scenario},
          {"what", c.runs.front().outcome.what},
          {"seconds", c.seconds},
          {"gains",
           {{"velocity_loop_hz", json_number(c.velocity_loop_hz)},
            {"integrator_per_s", json_number(c.integrator_per_s)},
            {"position_loop_hz", json_number(c.position_loop_hz)}}},
          {"runs", runs},
          {"no_prediction", c.no_prediction.empty() ? json() : json(c.no_prediction)},
          {"ticks", c.runs.front().outcome.ticks},
          {"tick_hz", c.tick_hz},
          {"processor", c.processor.empty() ? json() : json(c.processor)},
          {"realtime_factor", json_number(c.realtime_factor)}};
}

json traces_json(const Comparison& c) {
  json traces = json::array();
  for (const ComparedRun& run : c.runs) traces.push_back(traces_of(run.outcome.trace));
  return traces;
}

void write_page(const std::filesystem::path& file, const Comparison& c) {
  json document = to_json(c);
  document["format"] = "flexspline-hil-report/1";
  document["title"] = fmt::format("Closed loop: {}", c.scenario);
  document["verdict"] = sentence(c);
  document["good"] =
      c.runs.back().outcome.fault.empty() && c.runs.back().outcome.rms_error_rad < c.runs.front().outcome.rms_error_rad;
  document["tool_version"] = report::kToolVersion;
  document["created"] = fmt::format("{:%Y-%m-%d %H:%M UTC}", fmt::gmtime(std::time(nullptr)));
  document["traces"] = traces_json(c);
  model::save(file, report::page(document, report::Script::closed_loop));
}

std::string picture(const Comparison& c) {
  constexpr double kLeft = 70.0, kRight = 840.0, kTop = 62.0, kHeight = 96.0, kGap = 26.0;
  constexpr std::array<const char*, 3> kColours{"#6f7a88", "#d55e00", "#0072b2"};
  const auto in_words = [](const std::string& label) {
    if (label == "none") return std::string("no compensation");
    if (label == "added") return std::string("base model and the effect that was added");
    return label == "base" ? std::string("base model") : label;
  };
  const double bottom = kTop + static_cast<double>(c.runs.size()) * (kHeight + kGap);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 860 {:.0f}\" font-family=\"sans-serif\" "
      "font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
      "<text x=\"{}\" y=\"22\" font-size=\"15\" font-weight=\"bold\" fill=\"#222\">Tracking error of the output: "
      "{}</text>\n<text x=\"{}\" y=\"41\" fill=\"#444\">error in millirad over {:g} s; the same loops in all "
      "runs (velocity {:.3g} Hz with integrator, position {:.3g} Hz)</text>\n",
      bottom + 20.0, kLeft, report::escaped(c.runs.front().outcome.what), kLeft, c.seconds, c.velocity_loop_hz,
      c.position_loop_hz);
  double top = kTop, most = 0.0;
  for (const ComparedRun& run : c.runs) most = std::max(most, run.outcome.peak_error_rad);
  for (std::size_t i = 0; i < c.runs.size(); ++i, top += kHeight + kGap) {
    const ComparedRun& run = c.runs[i];
    const Trace& t = run.outcome.trace;
    const double middle = top + kHeight / 2.0;
    svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\" fill=\"{}\" font-weight=\"bold\">{}: rms {} mrad</text>\n", kLeft,
                       top + 9.0, kColours[i % 3], report::escaped(in_words(run.label)),
                       output::number(1e3 * run.outcome.rms_error_rad, 3));
    svg += fmt::format("<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#cccccc\"/>\n", kLeft, kRight,
                       middle, middle);
    for (const double share : {-1.0, 1.0})
      svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"#444\">{}</text>\n", kLeft - 8.0,
                         middle - share * kHeight * 0.36 + 4.0, output::number(share * 0.8e3 * most, 2));
    std::vector<data::Segment> whole{{0, t.time_s.size()}};
    const report::Thinning thinning(whole, 800);
    const std::vector<double> times = thinning.times(t.time_s), errors = thinning.values(t.error_rad);
    svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\" points=\"", kColours[i % 3]);
    for (std::size_t k = 0; k < times.size(); ++k) {
      if (times[k] < 1.0 || times[k] > c.seconds) continue;
      svg += fmt::format("{:.1f},{:.1f} ", kLeft + (times[k] - 1.0) / (c.seconds - 1.0) * (kRight - kLeft),
                         middle - errors[k] / most * kHeight * 0.45);
    }
    svg += "\"/>\n";
  }
  return svg + "</svg>\n";
}

}  // namespace flexspline::closed_loop
