// A drive without hardware, for the commands that speak with one.
#include <fmt/format.h>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/app/cli/twin_process.hpp"

namespace flexspline::cli {
namespace {

struct TwinOptions {
  std::filesystem::path plant;       // empty: the demo's drive
  std::filesystem::path flash;       // empty: what is flashed ends with the twin
  std::filesystem::path link_fault;  // file that injects faults on its link; empty: none
  std::string serial = "TWIN";
  int serve = 0;   // port; zero: any that is free
  int usbip = -1;  // port of a USB device; below zero: none
  double seconds = 0.0;
  bool fast = false;
  std::string json;
};

int run(const TwinOptions& options, Console&) {
  std::vector<std::string> words{"twin", "--serial", options.serial};
  const auto give = [&](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  give("--plant", options.plant.string());
  give("--flash", options.flash.string());
  give("--link-fault", options.link_fault.string());
  give("--json", options.json);
  if (options.usbip >= 0) give("--usbip", std::to_string(options.usbip));
  if (options.usbip < 0) give("--serve", std::to_string(options.serve));
  if (options.seconds > 0.0) give("--seconds", fmt::format("{}", options.seconds));
  if (options.fast) words.emplace_back("--fast");
  become_twin(words);
}

void declare(Parser& parser, TwinOptions& options) {
  parser.option("--plant", options.plant, "plant file (default: the demo's drive)").value("FILE");
  parser.option("--flash", options.flash, "file with its flash memory (default: none)").value("FILE");
  parser
      .option("--link-fault", options.link_fault,
              "file that connects or disconnects it: in, out, or out N (after N more messages)")
      .value("FILE");
  parser.option("--serial", options.serial, "serial number").shows_default().value("TEXT");
  parser.option("--serve", options.serve, "port on 127.0.0.1 (default: any that is free)").value("PORT");
  parser.option("--usbip", options.usbip, "a USB device at this port of USB/IP").value("PORT");
  parser.option("--seconds", options.seconds, "duration (default: until Ctrl-C)").value("S");
  parser.flag("--fast", options.fast, "while armed faster than real time, as fast as the host answers");
}

}  // namespace

Command twin_command() {
  return command<TwinOptions>(
      {"twin",
       "a virtual drive: a plant, its sensors and the firmware",
       "Runs until Ctrl-C and prints the address for --drive: a socket (tcp:127.0.0.1:PORT/TOKEN), or with --usbip a "
       "USB device, which Linux takes for a real one once it is attached: sudo modprobe vhci-hcd; sudo usbip "
       "--tcp-port PORT attach -r 127.0.0.1 -b 1-1. --drive twin starts one of its own and needs none of this. "
       "flexspline-hil twin, which this starts, has more options: hidden effects, faults, a serial line. --json "
       "writes where it is once it listens.",
       {"flexspline twin --seconds 0.5"}},
      declare, run);
}

}  // namespace flexspline::cli
