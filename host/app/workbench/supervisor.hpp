// The workbench's work in a process of its own. Where that process crashes, has no memory left or does not end, another
// one takes its place and gets the reason why the one before ended.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host/app/workbench/job_table.hpp"

namespace flexspline::workbench {

// How a worker ended without a request.
struct Failure {
  std::string why;        // "it crashed (signal 11, Segmentation fault)"
  std::vector<Job> jobs;  // what ran then
  bool is_known = false;  // the first job ended it; else any of them may have
};

struct SupervisorOptions {
  // The worker, in a process that is made by fork(): nothing else may have threads then. Gets all failures so far.
  std::function<void(const std::vector<Failure>&)> work;
  // Called again and again in the parent; where it is true, the worker is ended by SIGTERM.
  std::function<bool()> ends;
  std::uint64_t memory_bytes =
      0;  // that the worker may use in addition to what it has at its start; zero: three quarters of the machine's
};

// Runs workers until `ends` is true. Throws std::runtime_error where one after the other ends at its beginning.
void supervise(JobTable& jobs, const SupervisorOptions& supervised);

}  // namespace flexspline::workbench
