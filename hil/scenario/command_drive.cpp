#include "hil/scenario/command_drive.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <iterator>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "firmware/fault_texts.hpp"
#include "hil/board/processor.hpp"
#include "hil/plant/recorder.hpp"
#include "hil/plant/whole_file.hpp"
#include "hil/scenario/scenario_file.hpp"

namespace flexspline::scenario {
namespace {

using board::ScenarioPlan;
using board::ScenarioResult;
using firmware::Fault;

board::Injection chosen_injection(const std::string& name) {
  if (const auto injection = board::injection_named(name)) return *injection;
  throw std::invalid_argument(
      fmt::format("no injection '{}'; there are {}", name, fmt::join(board::injection_names(), ", ")));
}

ScenarioPlan plan_of(const DriveOptions& options) {
  const ScenarioFile file = find_scenario(options.scenario);
  ScenarioPlan plan = plan_of(file, drive_of(file, options.plant_file, options.with, options.hide));
  if (!options.block_file.empty()) plan.packed = board::load_packed_model(options.block_file, options.tick_hz);
  if (options.seconds > 0.0) {
    plan.duration_s = options.seconds;
    plan.hold_s = 0.0;
  }
  plan.seed = options.seed;
  plan.start_turns = options.wake_turns;
  plan.tick_hz = options.tick_hz;
  plan.three_phase = options.motor == "three-phase";
  if (!options.processor_image.empty() && options.tick_hz != board::SoftwareBoard::kTickHz)
    throw std::invalid_argument(fmt::format("the image of a processor ticks {} times a second; remove --tick-hz",
                                            board::SoftwareBoard::kTickHz));
  plan.keeps_trace = !options.trace_file.empty();
  if (!options.inject.empty()) {
    plan.injection = chosen_injection(options.inject);
    plan.injection_s = options.inject_at_s < 0.0 ? plan.duration_s / 2.0 : options.inject_at_s;
  }
  return plan;
}

double count_of(const ScenarioPlan& plan) {
  return 2.0 * std::numbers::pi / plan.drive.sensors.motor_counts / plan.drive.gear_ratio;
}

std::string fault_json(const firmware::FaultRecord& fault) {
  if (fault.fault == Fault::none) return "null";
  return fmt::format("\"{}\"", firmware::info_of(fault.fault).name);
}

// Characters that JSON escapes; other texts here have none.
std::string in_json(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) >= 0x20) out += c;
  }
  return out;
}

std::string json_of(const ScenarioPlan& plan, const std::vector<ScenarioResult>& runs) {
  std::string text = fmt::format("{{\"format\":\"flexspline-hil/1\",\"scenario\":\"{}\",\"what\":\"{}\",\"runs\":[",
                                 in_json(plan.scenario), in_json(plan.motion->what));
  double wall_s = 0.0;
  for (const ScenarioResult& r : runs) {
    text += fmt::format(
        "{}{{\"compensation\":{},\"rms_error_rad\":{:.9g},\"peak_error_rad\":{:.9g},\"rms_current_a\":{:.9g},"
        "\"peak_current_a\":{:.9g},\"stops\":{},\"limit_cycle\":{},\"hold_swing_rad\":{:.9g},\"hold_reversals\":{},"
        "\"hold_error_rad\":{:.9g},\"final_temperature_c\":{:.6g},\"fault\":{},\"fault_tick\":{},\"ends_in_fault\":{},"
        "\"telemetry_frames\":{},\"telemetry_hash\":\"{:016x}\"}}",
        &r == runs.data() ? "" : ",", r.compensation, r.rms_error_rad, r.peak_error_rad, r.rms_current_a,
        r.peak_current_a, r.stops, r.limit_cycle(count_of(plan)), r.hold_swing_rad, r.hold_reversals, r.hold_error_rad,
        r.final_temperature_c, fault_json(r.first_fault), r.first_fault.tick, r.end.mode != firmware::Mode::position,
        r.frames, r.telemetry_hash);
    wall_s += r.wall_s;
  }
  const double simulated_s = (plan.duration_s + plan.hold_s) * static_cast<double>(runs.size());
  return text + fmt::format(
                    "],\"seconds\":{:g},\"wake_turns\":{:.9g},\"ticks\":{},\"tick_hz\":{},"
                    "\"realtime_factor\":{:.3g}}}\n",
                    plan.duration_s, runs.front().start_turns, runs.front().ticks, plan.tick_hz, simulated_s / wall_s);
}

void print(const DriveOptions& options, const ScenarioPlan& plan, const std::vector<ScenarioResult>& runs) {
  fmt::print("{}: {}, {:g} s at {} ticks a second, {}; motor at {:.4g} turns at power-on\n", plan.scenario,
             plan.motion->what, plan.duration_s, plan.tick_hz,
             options.processor_image.empty() ? "software board" : "emulated processor", runs.front().start_turns);
  fmt::print("{:<13} {:>14} {:>14} {:>13} {:>18} {:>9}\n", "compensation", "rms error rad", "peak error",
             "rms current A", "telemetry hash", "real time");
  for (const ScenarioResult& r : runs) {
    fmt::print("{:<13} {:>14.3e} {:>14.3e} {:>13.3f} {:>18} {:>8.1f}x\n", r.compensation ? "on" : "off",
               r.rms_error_rad, r.peak_error_rad, r.rms_current_a, fmt::format("{:016x}", r.telemetry_hash),
               (plan.duration_s + plan.hold_s) / r.wall_s);
  }
  for (const ScenarioResult& r : runs) {
    if (r.limit_cycle(count_of(plan)))
      fmt::print("compensation {}: at rest the output oscillates by {:.2e} rad\n", r.compensation ? "on" : "off",
                 r.hold_swing_rad);
    if (r.first_fault.fault == Fault::none) continue;
    const firmware::FaultInfo& info = firmware::info_of(r.first_fault.fault);
    fmt::print("compensation {}: fault {} at tick {}: {}; the drive {}\n", r.compensation ? "on" : "off", info.name,
               r.first_fault.tick,
               protocol::fault_text(static_cast<std::uint8_t>(r.first_fault.fault), r.first_fault.limit).reason,
               r.end.mode == firmware::Mode::position ? "goes on afterwards"
               : r.end.mode == firmware::Mode::fault  ? "is switched off"
                                                      : "comes to rest");
  }
}

std::string csv_of(const std::vector<board::TracePoint>& trace) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "time_s,position_command_rad,output_position_rad,error_rad,velocity_command_rad_s,"
                 "motor_velocity_rad_s,torque_nm,current_a,temperature_c,load_torque_nm,armed\n");
  for (const board::TracePoint& p : trace)
    fmt::format_to(
        std::back_inserter(text), "{:.6g},{:.10g},{:.10g},{:.6g},{:.7g},{:.7g},{:.7g},{:.6g},{:.5g},{:.5g},{}\n",
        p.time_s, p.reference.position, p.output_rad, p.output_rad - p.reference.position, p.reference.velocity,
        p.motor_velocity_rad_s, p.torque_nm, p.current_a, p.temperature_c, p.load_torque_nm, is_armed(p.mode) ? 1 : 0);
  return {text.data(), text.size()};
}

}  // namespace

void run_drive(const DriveOptions& options) {
  ScenarioPlan plan = plan_of(options);
  if (plan.keeps_trace && options.compensation == "both")
    throw std::invalid_argument("--trace is for one run: add --compensation on, or off");
  std::vector<ScenarioResult> runs;
  for (const bool compensation : {false, true}) {
    if (options.compensation == (compensation ? "off" : "on")) continue;
    plan.compensation = compensation;
    std::unique_ptr<board::Controller> controller;
    if (!options.processor_image.empty()) controller = std::make_unique<board::Processor>(options.processor_image);
    runs.push_back(board::run_scenario(plan, std::move(controller)));
  }
  if (plan.keeps_trace) plant::write_whole(options.trace_file, csv_of(runs.front().trace));
  if (options.json == "-") {
    fmt::print("{}", json_of(plan, runs));
    return;
  }
  print(options, plan, runs);
  if (!options.json.empty()) plant::write_whole(options.json, json_of(plan, runs));
}

void write_data_sheet(const DataSheetOptions& options) {
  const ScenarioFile file = options.scenario.empty() ? ScenarioFile{} : find_scenario(options.scenario);
  const plant::Drive drive = drive_of(file, options.plant_file, options.with, options.hide);
  plant::make_folder(options.out);
  const std::filesystem::path folder = options.out;
  plant::write_whole(folder / "settings.toml",
                     fmt::format("format = \"flexspline-drive/1\"\n\n[motor_encoder]\ncounts = {}\n\n[output_encoder]\n"
                                 "counts = {}\n\n[limits]\ncurrent_a = {}\n\n[torque_sensor]\n",
                                 drive.sensors.motor_counts, drive.sensors.output_counts, drive.current_limit_a));
  plant::write_whole(folder / "known-model.toml", plant::model_text(drive, false));
  const plant::Effect* hidden = nullptr;
  for (const plant::Effect& effect : drive.effects)
    if (effect.hidden) hidden = &effect;
  if (hidden != nullptr && hidden->catalogue)
    plant::write_whole(folder / "whole-model.toml", plant::model_text(drive, true));
}

void list_scenarios() {
  for (const Known& one : known_scenarios()) fmt::print("{:<18} {}\n", one.name, one.what);
}

}  // namespace flexspline::scenario
