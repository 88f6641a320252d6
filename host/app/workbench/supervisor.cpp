#include "host/app/workbench/supervisor.hpp"

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace flexspline::workbench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPause = std::chrono::milliseconds(50);
// To end drives, twins and files in order.
constexpr auto kTimeToEnd = std::chrono::seconds(10);
// A worker that ends sooner counts as failed at its start.
constexpr auto kBeginning = std::chrono::seconds(2);
constexpr int kMostAtBeginning = 5;

std::uint64_t data_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (std::uint64_t kilobytes = 0; word == "VmData:" && status >> kilobytes) return kilobytes * 1024;
  return 0;
}

// The limit is on written memory, not on addresses: threads reserve many addresses that they never use.
void limit_memory(std::uint64_t bytes) {
  const auto machine =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
  const rlim_t wanted = data_bytes() + (bytes > 0 ? bytes : machine / 4 * 3);
  limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? wanted : std::min(wanted, limit.rlim_max);
  setrlimit(RLIMIT_DATA, &limit);
}

[[noreturn]] void be_worker(JobTable& jobs, const SupervisorOptions& supervised, const std::vector<Failure>& failures,
                            pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(0);  // it ended before
  limit_memory(supervised.memory_bytes);
  int code = 0;
  try {
    jobs.watch();
    supervised.work(failures);
  } catch (const std::exception& error) {
    fmt::print(stderr, "flexspline: {}\n", error.what());
    code = 1;
  }
  std::fflush(nullptr);
  _exit(code);
}

std::string why_of(int status, const JobTable::UnfinishedJobs& left) {
  if (left.is_overtime) return fmt::format("it did not end within {} s", left.seconds);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    return "it was ended from outside (signal 9), as systems do where memory runs out";
  if (WIFSIGNALED(status))
    return fmt::format("it crashed (signal {}, {})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  return fmt::format("it ended by itself (exit code {})", WEXITSTATUS(status));
}

void end(pid_t worker) {
  kill(worker, SIGTERM);
  for (const auto begin = Clock::now(); Clock::now() - begin < kTimeToEnd; std::this_thread::sleep_for(kPause))
    if (waitpid(worker, nullptr, WNOHANG) == worker) return;
  kill(worker, SIGKILL);
  waitpid(worker, nullptr, 0);
}

}  // namespace

void supervise(JobTable& jobs, const SupervisorOptions& supervised) {
  std::vector<Failure> failures;
  for (int at_beginning = 0;;) {
    const auto began = Clock::now();
    std::fflush(nullptr);  // else both processes write the buffered output
    const pid_t parent = getpid();
    const pid_t worker = fork();
    if (worker < 0) throw std::runtime_error("no process could be started for the workbench's work");
    if (worker == 0) be_worker(jobs, supervised, failures, parent);
    int status = 0;
    for (; waitpid(worker, &status, WNOHANG) != worker; std::this_thread::sleep_for(kPause))
      if (supervised.ends()) return end(worker);
    if (supervised.ends()) return;
    JobTable::UnfinishedJobs left = jobs.take();
    failures.push_back({why_of(status, left), std::move(left.jobs), left.cause_is_known});
    at_beginning = Clock::now() - began < kBeginning && failures.back().jobs.empty() ? at_beginning + 1 : 0;
    if (at_beginning == kMostAtBeginning)
      throw std::runtime_error(
          fmt::format("the workbench's work cannot begin: {}; report this with the data", failures.back().why));
  }
}

}  // namespace flexspline::workbench
