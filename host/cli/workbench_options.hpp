// The options of flexspline workbench. A template over CLI11's command: app.cpp alone has its header, and includes it
// before this one.
#pragma once

#include <fmt/format.h>

#include "host/cli/workbench_command.hpp"
#include "host/transport/link.hpp"

namespace flexspline::cli {

// Its options other than DATA, the model and those of the filters.
template <class Parser>
void take_workbench(Parser& command, WorkbenchOptions& options) {
  command.add_option("--drive", options.drive, fmt::format("{} (default: choose on the page)", transport::kDriveHelp))
      ->type_name("DRIVE");
  command
      .add_option(
          "--plant", options.plant,
          "plant file of the drive that closed loops are run on (default: the twin that recorded the data, else one "
          "of which the model is true)")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  command.add_option("--port", options.port, "of 127.0.0.1 (default: any that is free)")
      ->check(CLI::Range(1, 65535))
      ->type_name("PORT");
  command.add_option("--seconds", options.seconds, "ends after so long (default: at Ctrl-C)")
      ->check(CLI::PositiveNumber)
      ->type_name("S");
  command.add_flag("--no-open", options.no_open, "open no browser; the address is printed");
}

}  // namespace flexspline::cli
