#include "hil/board/command_drive.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <stdexcept>

#include "firmware/fault_texts.hpp"
#include "hil/board/processor.hpp"
#include "hil/board/scenario.hpp"
#include "hil/plant/whole_file.hpp"

namespace flexspline::board {
namespace {

Injection chosen_injection(const std::string& name) {
  if (const auto injection = injection_named(name)) return *injection;
  std::string known;
  for (const std::string_view one : injection_names()) known += (known.empty() ? "" : ", ") + std::string(one);
  throw std::invalid_argument("no injection '" + name + "'; there are " + known);
}

ScenarioPlan plan_of(const DriveOptions& options) {
  ScenarioPlan plan;
  plan.drive = options.plant_file.empty() ? plant::demo_plant().drive : plant::load_plant(options.plant_file).drive;
  for (const std::string& effect : options.with) plant::with(plan.drive, effect);
  if (!options.hide.empty()) plant::hide(plan.drive, options.hide);
  if (!options.block_file.empty()) plan.packed = load_packed_model(options.block_file);
  plan.scenario = options.scenario;
  plan.duration_s = options.seconds;
  plan.seed = options.seed;
  if (!options.inject.empty()) {
    plan.injection = chosen_injection(options.inject);
    plan.injection_s = options.inject_at_s < 0.0 ? options.seconds / 2.0 : options.inject_at_s;
  }
  return plan;
}

// Nothing but ASCII letters and dashes stands in these texts.
std::string json_of(const DriveOptions& options, const std::vector<ScenarioResult>& runs) {
  std::string text = fmt::format("{{\"format\":\"flexspline-hil/1\",\"scenario\":\"{}\",\"runs\":[", options.scenario);
  double wall_s = 0.0;
  for (const ScenarioResult& r : runs) {
    const firmware::FaultInfo& fault = firmware::info_of(r.end.fault.fault);
    text += fmt::format(
        "{}{{\"compensation\":{},\"rms_error_rad\":{:.9g},\"peak_error_rad\":{:.9g},\"rms_current_a\":{:.9g},"
        "\"fault\":{},\"fault_tick\":{},\"telemetry_frames\":{},\"telemetry_hash\":\"{:016x}\"}}",
        &r == runs.data() ? "" : ",", r.compensation, r.rms_error_rad, r.peak_error_rad, r.rms_current_a,
        r.end.fault.fault == firmware::Fault::none ? "null" : fmt::format("\"{}\"", fault.name), r.end.fault.tick,
        r.frames, r.telemetry_hash);
    wall_s += r.wall_s;
  }
  const double simulated_s = options.seconds * static_cast<double>(runs.size());
  return text + fmt::format("],\"ticks\":{},\"realtime_factor\":{:.3g}}}\n", runs.front().ticks, simulated_s / wall_s);
}

void print(const DriveOptions& options, const std::vector<ScenarioResult>& runs) {
  fmt::print("{}: {}, {:g} s at {} ticks a second, {}\n", options.scenario, scenario(options.scenario).what,
             options.seconds, SoftwareBoard::kTickHz,
             options.processor_image.empty() ? "software board" : "emulated processor");
  fmt::print("{:<13} {:>14} {:>14} {:>13} {:>18} {:>9}\n", "compensation", "rms error rad", "peak error",
             "rms current A", "telemetry hash", "real time");
  for (const ScenarioResult& r : runs) {
    fmt::print("{:<13} {:>14.3e} {:>14.3e} {:>13.3f} {:>18} {:>8.1f}x\n", r.compensation ? "on" : "off",
               r.rms_error_rad, r.peak_error_rad, r.rms_current_a, fmt::format("{:016x}", r.telemetry_hash),
               options.seconds / r.wall_s);
  }
  for (const ScenarioResult& r : runs) {
    if (r.end.fault.fault == firmware::Fault::none) continue;
    const firmware::FaultInfo& info = firmware::info_of(r.end.fault.fault);
    fmt::print("compensation {}: fault {} at tick {}: {}; the drive {}\n", r.compensation ? "on" : "off", info.name,
               r.end.fault.tick, info.reason,
               r.end.mode == firmware::Mode::fault ? "is switched off" : "comes to rest");
  }
}

}  // namespace

void run_drive(const DriveOptions& options) {
  ScenarioPlan plan = plan_of(options);
  std::vector<ScenarioResult> runs;
  for (const bool compensation : {false, true}) {
    if (options.compensation == (compensation ? "off" : "on")) continue;
    plan.compensation = compensation;
    std::unique_ptr<Brain> brain;
    if (!options.processor_image.empty()) brain = std::make_unique<Processor>(options.processor_image);
    runs.push_back(run_scenario(plan, std::move(brain)));
  }
  if (options.json == "-") {
    fmt::print("{}", json_of(options, runs));
    return;
  }
  print(options, runs);
  if (!options.json.empty()) plant::write_whole(options.json, json_of(options, runs));
}

}  // namespace flexspline::board
