#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace flexspline::twin {

struct TwinOptions {
  std::string plant_file;  ///< empty: the demo's drive
  std::vector<std::string> with;
  std::string hide;
  std::string flash_file;
  std::string serial = "TWIN";
  std::string motor = "current";  ///< what the amplifier takes: a current, or "three-phase"
  std::uint64_t motor_seed = 0;   ///< of a three-phase motor that it was not commissioned with; zero: it was
  std::string wiring_fault;       ///< of that motor, such as phase-open-b
  std::string motor_ripple;       ///< of that motor: board::motor_ripple_names()
  double motor_ripple_size = 1.0;
  std::string json_file;        ///< receives its address, once it listens; - is standard output
  std::string link_fault_file;  ///< unplugs its link (link_fault.hpp); empty: none
  std::string inject;
  double inject_at_s = 1.0;  ///< after the drive was first armed
  std::uint64_t seed = 1;
  int port = -1;          ///< on 127.0.0.1; zero: any that is free
  std::string token;      ///< that a host has to send; empty: random
  int usbip = -1;         ///< on 127.0.0.1, a USB device there; zero: any port that is free
  double seconds = 0.0;   ///< zero: until it is stopped
  bool pty = false;       ///< a serial line
  bool inherits = false;  ///< a line that the caller left as standard input
  bool empty = false;
  bool locked = false;
  bool fast = false;
  bool lossy = false;
};

/// Runs a drive for hosts, one at a time, over a serial line or over USB. In real time; with `fast` an armed drive runs
/// as fast as it can, but not further ahead than its host follows. Returns where the line that it inherited ends, at
/// SIGINT and SIGTERM, and after `seconds`. Throws std::runtime_error with what cannot be opened.
void run_twin(const TwinOptions& options);

}  // namespace flexspline::twin
