#include "host/app/closed_loop/runs.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

namespace flexspline::closed_loop {

Outcome outcome_of(const nlohmann::json& answer) {
  try {
    if (answer.at("format") != "flexspline-hil/1") throw std::runtime_error("the twin's answer has another format");
    const nlohmann::json& run = answer.at("runs").at(0);
    Outcome out;
    out.what = answer.at("what");
    out.seconds = answer.at("seconds");
    out.rms_error_rad = run.at("rms_error_rad");
    out.peak_error_rad = run.at("peak_error_rad");
    out.rms_current_a = run.at("rms_current_a");
    out.peak_current_a = run.at("peak_current_a");
    out.stops = run.at("stops");
    out.limit_cycle = run.at("limit_cycle");
    out.hold_swing_rad = run.at("hold_swing_rad");
    out.fault = run.at("fault").is_null() ? "" : run.at("fault").get<std::string>();
    out.ends_in_fault = run.at("ends_in_fault");
    out.ticks = answer.at("ticks");
    out.tick_hz = answer.at("tick_hz");
    out.realtime_factor = answer.at("realtime_factor");
    return out;
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(std::string("the twin's answer cannot be read: ") + error.what());
  }
}

Trace trace_of(const std::string& csv) {
  Trace trace;
  // In the order of the file; of the columns without a place nothing is kept.
  const std::array<std::vector<double>*, 9> places{&trace.time_s,
                                                   &trace.position_command_rad,
                                                   &trace.output_position_rad,
                                                   &trace.error_rad,
                                                   nullptr,
                                                   &trace.motor_velocity_rad_s,
                                                   nullptr,
                                                   &trace.current_a,
                                                   &trace.temperature_c};
  constexpr std::string_view kHead =
      "time_s,position_command_rad,output_position_rad,error_rad,velocity_command_rad_s,motor_velocity_rad_s,"
      "torque_nm,current_a,temperature_c,";
  if (!csv.starts_with(kHead)) throw std::runtime_error("the twin's trace has other columns");
  std::istringstream in(csv);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string cell;
    for (std::vector<double>* place : places) {
      if (!std::getline(cells, cell, ',')) throw std::runtime_error("the twin's trace ends within a line");
      if (place != nullptr) place->push_back(std::stod(cell));
    }
  }
  return trace;
}

}  // namespace flexspline::closed_loop
