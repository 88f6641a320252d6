// The workbench on a socket of this machine.
#pragma once

#include <functional>
#include <string>

#include "host/app/workbench/api.hpp"

namespace flexspline::workbench {

struct ServerOptions {
  int port = 0;  // zero: any that is free
  // Called once it listens, with the address to open; the token is in it.
  std::function<void(const std::string& address)> listening;
  // Called a few times a second; the server ends where it is true.
  std::function<bool()> ends;
};

// Serves on 127.0.0.1 until `ends` is true. Throws std::runtime_error where the port is not free.
void serve(Setup setup, const ServerOptions& serving);

}  // namespace flexspline::workbench
