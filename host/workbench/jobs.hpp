// What the worker process of the workbench is at, in memory that its parent sees too: where the worker ends, the
// parent knows what it was doing.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/estimation/cancellation.hpp"

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

class JobBoard {
 public:
  JobBoard();
  ~JobBoard();
  JobBoard(const JobBoard&) = delete;
  JobBoard& operator=(const JobBoard&) = delete;

  // A job on the board for as long as it lives; it may take `limit`. `asking` is what its threads ask (giving_up.hpp):
  // by it a thread is known to work for this job. A board that is full leaves the job out.
  class Entry {
   public:
    Entry(JobBoard* board, const Job& job, std::chrono::milliseconds limit,
          const estimation::CancellationCheck* asking);
    ~Entry();
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    // It has to end within so long from now on.
    void hurry(std::chrono::milliseconds limit);

   private:
    struct JobSlot* slot_ = nullptr;
  };

  // In the worker: from now on a signal that ends it, and a job that takes too long, are written on the board before
  // the process ends.
  void watch();
  // In the parent: all jobs that were on the board, that which ended the worker first where it is known, or where it is
  // the only work.
  struct Left {
    std::vector<Job> jobs;
    bool culprit_is_known = false;
    bool is_overtime = false;  // it did not end in time
    std::int64_t seconds = 0;  // that it took
  };
  Left take();

 private:
  struct JobSlot* slots_ = nullptr;
};

// Exit code of a worker with a job that did not end in time.
inline constexpr int kOvertimeExit = 86;

}  // namespace flexspline::workbench
