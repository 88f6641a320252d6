// The workbench's work in a process of its own. Where that process crashes, has no memory left or does not end, another
// one takes its place and is told why the one before ended.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host/workbench/jobs.hpp"

namespace flexspline::workbench {

// How a worker ended that was not told to.
struct Failure {
  std::string why;        // "it crashed (signal 11, Segmentation fault)"
  std::vector<Job> jobs;  // what ran then
  bool is_known = false;  // the first of them is what ended it; else it may have been any
};

struct Supervised {
  // The worker, in a process that is made by fork(): nothing else may have threads then. Gets all failures so far.
  std::function<void(const std::vector<Failure>&)> work;
  // Asked again and again in the parent; where it is true, the worker is told to end by SIGTERM.
  std::function<bool()> ends;
  std::uint64_t memory_bytes =
      0;  // that the worker may take beside what is there; zero: three quarters of the machine's
};

// Runs workers until told to end. Throws std::runtime_error where one after the other ends at its beginning.
void supervise(JobBoard& board, const Supervised& supervised);

}  // namespace flexspline::workbench
