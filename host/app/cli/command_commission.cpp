// Measures the motor of a three-phase drive and sets its current loop.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/drive_link/drive/commissioning.hpp"
#include "host/drive_link/drive/motor_block.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "shared/fixed/types.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using protocol::CommissioningState;

struct CommissionOptions {
  std::string drive;
  std::optional<double> current;     // A
  std::optional<double> most_speed;  // rad/s
  std::optional<double> bus;         // V
  std::optional<double> bandwidth;   // Hz
  double turns = 40.0;
  int pole_pairs = 0;  // zero: not stated
  int repeat = 1;
  bool store = false;
  bool yes = false;
  std::filesystem::path pairing_key;  // empty: none
  std::string json;
};

// What there is to know of a drive before it begins.
struct DriveFacts {
  protocol::CommissioningStage stage;
  control::Hardware hardware;
  deployment::CommissioningSetup setup;
  drive::Bytes active;
  double gear_ratio = 0.0;          // of the active block; zero without one
  double torque_constant_nm_a = 0;  // likewise
  double bandwidth_hz = 0.0;
};
DriveFacts facts_of(drive::Session& session, const CommissionOptions& options) {
  DriveFacts b;
  b.stage = drive::stage_of(session);
  b.hardware = session.hardware();
  b.active = session.read_block(protocol::Which::active);
  if (options.store && b.active.empty())
    session.fail(
        "it has no parameter block in which the motor's data could be stored; flash one first, or leave --store out");
  std::optional<double> motor_a;
  if (const auto scales = drive::scales_of(b.active)) {
    motor_a = std::ldexp(scales->header.limits.current.raw, -fixed::kValueBits) * scales->constants.current_base;
    b.gear_ratio = scales->constants.gear_ratio;
    b.torque_constant_nm_a = scales->constants.torque_constant;
  }
  b.setup =
      drive::setup_of(session, b.stage, b.hardware,
                      {options.current, motor_a, options.most_speed, options.bus, options.turns, options.pole_pairs});
  b.bandwidth_hz = options.bandwidth.value_or(deployment::usual_bandwidth_hz(b.setup.pwm_hz));
  if (b.bandwidth_hz > 0.1 * b.setup.pwm_hz)
    throw UsageError(fmt::format("--bandwidth-hz {:g} is above a tenth of the PWM rate; give at most {:g}",
                                 b.bandwidth_hz, 0.1 * b.setup.pwm_hz));
  return b;
}

void print_plan(const DriveFacts& b, Console& console) {
  const auto& s = b.setup;
  const std::string output =
      b.gear_ratio > 0.0 ? fmt::format(" ({:.3g} of the output)", s.most_travel_turns / b.gear_ratio) : "";
  console.line(
      output::wrapped(fmt::format("The motor turns up to {:g} turns{} each way, at up to {:.3g} rad/s, with {:.3g} A "
                                  "(at most {:.3g} A a phase), for "
                                  "up to {:g} s. It has to turn freely: take the load off and release the brake.",
                                  s.most_travel_turns, output, 2.0 * std::numbers::pi * s.most_shaft_hz, s.current_a,
                                  s.most_current_a, s.most_time_s)));
}

protocol::CommissioningProgress measure(drive::Session& session, const DriveFacts& b, const CommissionOptions& options,
                                        Console& console, std::vector<control::commissioning::Result>& results) {
  const Interruptible interruptible;
  protocol::CommissioningProgress end;
  for (int run = 1; run <= options.repeat; ++run) {
    end = drive::commission(session, b.setup, [&](const protocol::CommissioningProgress& now) {
      console.progress(
          fmt::format("run {} of {}: {}", run, options.repeat, deployment::commissioning_step_text(now.step)));
      return !Interruptible::interrupted();
    });
    if (end.state != CommissioningState::done) break;
    results.push_back(drive::commissioning_result(session));
  }
  return end;
}

// Why it did not come to its end: what happened, and what to check.
struct Failure {
  std::string name, meaning, cure;
};
Failure failure_of(drive::Session& session, const protocol::CommissioningProgress& end) {
  switch (end.state) {
    case CommissioningState::fault: {
      const auto text = deployment::commissioning_fault_text(end.fault);
      return {std::string(text.name), std::string(text.meaning), std::string(text.cure)};
    }
    case CommissioningState::stopped:
      return {"stopped", "it was stopped by request", "run it again"};
    case CommissioningState::host_lost:
      return {"host_lost", "the drive received no request for half a second",
              "check the cable and whether this computer is overloaded"};
    case CommissioningState::drive_fault: {
      const auto text = protocol::fault_text(session.status().fault, session.status().fault_limit);
      return {std::string(text.name), std::string(text.reason), "find the cause; disarming does not clear a fault"};
    }
    case CommissioningState::bus_high:
      return {"bus_high", "the bus voltage rose above its limit while the motor was braked",
              "use a supply that takes energy back, a brake resistor, or a lower --max-speed-rad-s"};
    default:
      return {"none", "it did not run", "run it again"};
  }
}

json current_loop_json(const DriveFacts& b, const control::MotorSettings& m) {
  const double ohm =
      b.setup.bus_full_scale_v / b.setup.current_full_scale_a * std::ldexp(1.0, m.current.voltage_exponent - 5);
  const auto gain = [&](std::int32_t x) { return std::ldexp(static_cast<double>(x), -30) * ohm; };
  return {{"bandwidth_hz", b.bandwidth_hz},
          {"proportional_d_v_a", gain(m.current.d.proportional)},
          {"proportional_q_v_a", gain(m.current.q.proportional)},
          {"integral_d_v_a_s", gain(m.current.d.integral) * b.setup.pwm_hz},
          {"integral_q_v_a_s", gain(m.current.q.integral) * b.setup.pwm_hz}};
}

json print_results(const DriveFacts& b, const std::vector<control::commissioning::Result>& results, Console& console) {
  output::Table table({"", "value", "spread", "unit"}, "lrrl");
  json values = json::array();
  for (const drive::FoundValue& v : drive::found_values(b.setup, results)) {
    table.row({v.name, output::number(v.value), output::number(v.spread, 2), v.unit == "1" ? "" : v.unit});
    values.push_back(
        {{"name", v.name}, {"value", v.value}, {"unit", v.unit}, {"spread", output::json_number(v.spread)}});
  }
  console.line(table.text());
  return values;
}

// After the motor was measured: tables, the current loop, warnings, and the drive's memory.
void conclude(drive::Session& session, const DriveFacts& b, const CommissionOptions& options,
              const std::vector<control::commissioning::Result>& results, json& answer, Console& console) {
  answer["result"] = print_results(b, results, console);
  const control::commissioning::Result mean = drive::mean_of(results);
  const control::MotorSettings motor =
      deployment::motor_settings(b.setup, mean, drive::pulse_of(b.stage), b.stage.encoder_counts, b.bandwidth_hz);
  const json loop = current_loop_json(b, motor);
  answer["current_loop"] = loop;
  console.line(fmt::format("  current loop: {:g} Hz, proportional {:.3g} V/A in d and {:.3g} V/A in q", b.bandwidth_hz,
                           loop["proportional_d_v_a"].get<double>(), loop["proportional_q_v_a"].get<double>()));
  const auto warnings = drive::commissioning_warnings(b.setup, deployment::commissioning_findings(b.setup, mean),
                                                      b.hardware, b.torque_constant_nm_a);
  answer["warnings"] = warnings;
  for (const std::string& text : warnings) console.warn(text);
  if (!options.store) {
    console.line("  Nothing was stored: with --store the drive uses it from now on, and after a restart.");
    return;
  }
  const auto signer = pairing_signer(options.pairing_key);
  const drive::Unlocked unlocked(session, signer);
  session.write_block(drive::with_motor(b.active, motor));
  answer["stored"] = true;
  console.line(fmt::format("{} in the parameter block of the drive; flash keeps it.", console.good("Stored")));
}

// Before anything was measured.
json answer_of(const drive::Session& session, const DriveFacts& facts) {
  return {{"format", "flexspline-commission/1"},
          {"drive", {{"serial", session.serial()}, {"drive", session.name()}}},
          {"test",
           {{"current_a", facts.setup.current_a},
            {"most_current_a", facts.setup.most_current_a},
            {"bus_v", facts.setup.bus_v},
            {"most_speed_rad_s", 2.0 * std::numbers::pi * facts.setup.most_shaft_hz},
            {"most_turns", facts.setup.most_travel_turns}}},
          {"end", drive::name_of(CommissioningState::none)},
          {"step", nullptr},
          {"seconds", 0.0},
          {"runs", 0},
          {"fault", nullptr},
          {"result", nullptr},
          {"current_loop", nullptr},
          {"warnings", json::array()},
          {"stored", false}};
}

int run(const CommissionOptions& options, Console& console) {
  const auto signer = pairing_signer(options.pairing_key);
  drive::Session session = open_drive(options.drive);
  console.line(named(session));
  const DriveFacts facts = facts_of(session, options);
  drive::require_access(session, signer);
  print_plan(facts, console);
  json answer = answer_of(session, facts);
  if (!confirmed("Is the load off?", options.yes)) {
    console.line("Nothing was moved.");
    output::save_json(options.json, answer);
    return kDone;
  }
  std::vector<control::commissioning::Result> results;
  protocol::CommissioningProgress end;
  {
    const drive::Unlocked unlocked(session, signer);
    end = measure(session, facts, options, console, results);
  }
  const bool is_done = end.state == CommissioningState::done;
  answer["end"] = drive::name_of(end.state);
  answer["step"] = deployment::commissioning_step_text(end.step);
  answer["seconds"] = end.periods / facts.setup.pwm_hz;
  answer["runs"] = results.size();
  if (is_done) {
    conclude(session, facts, options, results, answer, console);
  } else {
    const Failure why = failure_of(session, end);
    const std::string phase = drive::phase_name(end.phase);
    answer["fault"] = {{"name", why.name},
                       {"phase", phase.empty() ? json() : json(phase.substr(phase.size() - 1))},
                       {"meaning", why.meaning},
                       {"cure", why.cure}};
    console.line(fmt::format("{}{}{} (while measuring: {})", console.bad(why.name), phase.empty() ? "" : ", ", phase,
                             deployment::commissioning_step_text(end.step)));
    console.line(output::wrapped(fmt::format("{}. To do: {}.", why.meaning, why.cure)));
    console.line("  All switches are open and the drive is not armed.");
  }
  output::save_json(options.json, answer);
  return is_done ? kDone : kNotMet;
}

void declare(Parser& parser, CommissionOptions& options) {
  take_drive(parser, options.drive);
  parser
      .option("--test-current-a", options.current,
              "amplitude of a phase (default: the limit of the current in the block)")
      .positive()
      .value("A");
  parser.option("--max-speed-rad-s", options.most_speed, "of the motor (default: 157)").positive().value("RAD/S");
  parser.option("--max-turns", options.turns, "of the motor to either side")
      .within(0.1, 30000.0)
      .shows_default()
      .value("TURNS");
  parser.option("--pole-pairs", options.pole_pairs, "that the motor should have: others are a fault")
      .within(1, 40)
      .value("N");
  parser.option("--bus-v", options.bus, "nominal bus voltage (default: what the drive reads now)")
      .positive()
      .value("V");
  parser
      .option("--bandwidth-hz", options.bandwidth,
              "corner of the current loop (default: a twentieth of the PWM rate, at most 1000)")
      .positive()
      .value("HZ");
  parser.option("--repeat", options.repeat, "runs: their spread is shown, their mean is used")
      .within(1, 20)
      .shows_default()
      .value("N");
  parser.flag("--store", options.store, "keep the motor in the parameter block of the drive, which uses it at once");
  take_pairing_key(parser, options.pairing_key);
  take_yes(parser, options.yes);
}

}  // namespace

Command commission_command() {
  return command<CommissionOptions>(
      {"commission",
       "measures the motor of a three-phase drive",
       "The drive measures phase resistance, inductances in d and q, flux linkage, pole pairs, direction and offset of "
       "the encoder, and zeros and gains of the current sensors, within limits of its own; from these follows its "
       "current loop. What is wrong is named: a phase open or shorted, sensors in the wrong order, an encoder that "
       "stands or slips, other pole pairs than stated. The motor turns by several turns in both directions: take the "
       "load off. Resistance and inductances are known up to what the gains of all current sensors have in common, and "
       "the resistance is that of the present temperature, with the switches. Ctrl-C, a lost link and every protection "
       "open all switches. Exit code 1: a fault was found, or it was stopped.",
       {"flexspline commission --drive twin:three-phase --yes"}},
      declare, run);
}

}  // namespace flexspline::cli
