// The twin as a program of its own: the tool sees of it what it would see of a drive, files and no more.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace flexspline::cli {

// Runs `flexspline-hil ARGUMENTS`, which is in the same folder as this program, and waits for it. Its output goes to
// standard error. Throws std::runtime_error with path and reason where it cannot be started or does not succeed.
void run_twin(const std::vector<std::string>& arguments);
// Becomes `flexspline-hil ARGUMENTS`: terminal, signals and exit code are the twin's from here on. Throws
// std::runtime_error with path and reason where it cannot be started.
[[noreturn]] void become_twin(const std::vector<std::string>& arguments);

}  // namespace flexspline::cli
