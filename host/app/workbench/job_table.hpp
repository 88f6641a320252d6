// The jobs of the worker process, in memory shared with its parent: where the worker crashes, the parent knows what it
// was doing.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/cancellation.hpp"

namespace flexspline::workbench {

// One request or one piece of work of a tab.
struct Job {
  std::string tab;   // empty: of no tab
  std::string what;  // for people: "Adding stribeck_gaussian"
  std::string key;   // equal for two jobs that compute the same
  bool is_work = false;
};

// How long they may take.
struct JobLimits {
  std::chrono::milliseconds request{300'000};
  std::chrono::milliseconds work{3'600'000};
  std::chrono::milliseconds cancelled{60'000};  // work that is to end
};

class JobTable {
 public:
  JobTable();
  ~JobTable();
  JobTable(const JobTable&) = delete;
  JobTable& operator=(const JobTable&) = delete;

  // A job in the table for as long as the entry exists; it may take `limit`. `cancellation` is the check of its threads
  // (cancellation.hpp): it identifies the threads that work for this job. A full table leaves the job out.
  class Entry {
   public:
    Entry(JobTable* jobs, const Job& job, std::chrono::milliseconds limit,
          const estimation::CancellationCheck* cancellation);
    ~Entry();
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    // Shortens its deadline to so long from now.
    void hurry(std::chrono::milliseconds limit);

   private:
    struct JobSlot* slot_ = nullptr;
  };

  // In the worker: from now on a signal that ends it, and a job that takes too long, are written into the table before
  // the process ends.
  void watch();
  // In the parent: all jobs in the table; the one that ended the worker first, where it is known, or where it is
  // the only work.
  struct UnfinishedJobs {
    std::vector<Job> jobs;
    bool cause_is_known = false;
    bool is_overtime = false;  // it did not end in time
    std::int64_t seconds = 0;  // that it took
  };
  UnfinishedJobs take();

 private:
  struct JobSlot* slots_ = nullptr;
};

// Exit code of a worker with a job that did not end in time.
inline constexpr int kOvertimeExit = 86;

}  // namespace flexspline::workbench
