// The options of the commands that work with a drive. Templates over CLI11's command: app.cpp alone has its header, and
// includes it before this one.
#pragma once

#include <fmt/format.h>

#include <string>

#include "host/cli/drive_commands.hpp"
#include "host/planning/report_plans.hpp"
#include "host/transport/link.hpp"

namespace flexspline::cli {

template <class Parser>
void take_drive(Parser* sub, std::string& drive) {
  sub->add_option("--drive", drive, fmt::format("{} (default: the only one on USB)", transport::kDriveHelp))
      ->type_name("DRIVE");
}
template <class Parser>
void take_yes(Parser* sub, bool& yes) {
  sub->add_flag("--yes", yes, "do not ask for confirmation");
}

template <class Parser>
void take_restore(Parser* sub, RestoreOptions& options) {
  sub->add_flag("--factory-reset", options.factory_reset,
                "erase both blocks permanently: after a restart the drive is as delivered by its manufacturer");
  take_yes(sub, options.yes);
}
template <class Parser>
void take_prediction(Parser* sub, FlashOptions& options) {
  sub->add_option("--draws", options.draws, "simulated drives of the prediction; 0: none")
      ->check(CLI::IsMember({0, 3, 4, 5, 6, 8, 12, 20}))
      ->capture_default_str();
  sub->add_flag("--measured", options.measured, "as in pack --measured");
}
template <class Parser>
void take_home(Parser* sub, HomeOptions& options) {
  sub->add_option("--position-rad", options.position,
                  "the present position of the motor, m on a linear axis (default: only prints what the drive knows)")
      ->type_name("RAD");
}

template <class Parser>
void take_monitor(Parser* sub, MonitorOptions& options) {
  take_drive(sub, options.drive);
  sub->add_option("--seconds", options.seconds, "duration (default: until Ctrl-C; with --residual-map: 0)")
      ->check(CLI::PositiveNumber)
      ->type_name("S");
  auto* rate = sub->add_option("--rate-hz", options.rate_hz, "lines per second")
                   ->check(CLI::Range(0.5, 100.0))
                   ->capture_default_str()
                   ->type_name("HZ");
  auto* channels = sub->add_option("--channels", options.channels, "which signals, at most 12 (default: the main ones)")
                       ->delimiter(',')
                       ->type_name("NAME")
                       ->allow_extra_args(false);
  auto* map = sub->add_flag("--residual-map", options.residual_map,
                            "where the model fails: the map of the drive over velocity and motor angle")
                  ->excludes(rate)
                  ->excludes(channels);
  sub->add_flag("--reset", options.reset, "clears the residual map after showing it")->needs(map);
  sub->add_option("--limit-nm", options.limit_nm,
                  "smaller residuals are ignored (default: a hundredth of the motor's torque limit)")
      ->check(CLI::PositiveNumber)
      ->type_name("NM")
      ->needs(map);
}

template <class Parser>
void take_record(Parser* sub, RecordOptions& options) {
  std::string names;
  for (const planning::ReportPlan& plan : planning::report_plans())
    names += (names.empty() ? "" : ", ") + std::string(plan.name);
  take_drive(sub, options.drive);
  sub->add_option("--plan", options.plan, "motions: of flexspline plan, by hand, or the report's by name: " + names)
      ->required()
      ->type_name("PLAN");
  sub->add_option("--out", options.out, "folder for the measurements")->required()->type_name("DIR");
  sub->add_flag("--force", options.force, "write into a folder that is not empty");
  sub->add_option("--runs", options.runs, "only these runs of the plan, by name (default: all)")
      ->delimiter(',')
      ->type_name("NAME")
      ->allow_extra_args(false);
  sub->add_flag("--compensate", options.compensate, "runs of mode position with feedforward of the model on the drive");
  sub->add_option("--full-velocity-rad-s", options.full_velocity_rad_s,
                  "motor velocity that is 100 % in the report's plans (default: nine tenths of the drive's limit)")
      ->check(CLI::PositiveNumber)
      ->type_name("RAD/S");
  sub->add_option("--full-current-a", options.full_current_a,
                  "motor current that is 100 % in the report's plans (default: nine tenths of the drive's limit)")
      ->check(CLI::PositiveNumber)
      ->type_name("A");
  sub->add_flag("--clear-fault", options.clear_fault, "clear the present fault first; its cause must be gone");
  take_yes(sub, options.yes);
}

template <class Parser>
void take_twin(Parser* sub, TwinOptions& options) {
  sub->add_option("--plant", options.plant, "plant file (default: the demo's drive)")->type_name("FILE");
  sub->add_option("--flash", options.flash, "file with its flash memory (default: none)")->type_name("FILE");
  sub->add_option("--cable", options.cable,
                  "file that connects or disconnects it: in, out, or out N (after N more messages)")
      ->type_name("FILE");
  sub->add_option("--serial", options.serial, "serial number")->capture_default_str()->type_name("TEXT");
  sub->add_option("--serve", options.serve, "port on 127.0.0.1 (default: any that is free)")->type_name("PORT");
  sub->add_option("--usbip", options.usbip, "a USB device at this port of USB/IP")->type_name("PORT");
  sub->add_option("--seconds", options.seconds, "duration (default: until Ctrl-C)")->type_name("S");
  sub->add_flag("--fast", options.fast, "while armed faster than real time, as fast as the host answers");
}

}  // namespace flexspline::cli
