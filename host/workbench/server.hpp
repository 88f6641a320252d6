// The workbench on a socket of this machine.
#pragma once

#include <functional>
#include <string>

#include "host/workbench/api.hpp"

namespace flexspline::workbench {

struct Serving {
  int port = 0;  // nought: any that is free
  // Called once it listens, with the address to open; the token is in it.
  std::function<void(const std::string& address)> listening;
  // Asked a few times a second; serving ends where it is true.
  std::function<bool()> ends;
};

// Serves on 127.0.0.1 until told to end. Throws std::runtime_error where the port cannot be had.
void serve(Setup setup, const Serving& serving);

}  // namespace flexspline::workbench
