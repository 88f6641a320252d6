// host/app/workbench: a worker process that crashes, takes too much memory or does not end. Real signals, real limits.
#include "host/app/workbench/supervisor.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <new>
#include <sstream>
#include <thread>

#include "host/engine/estimation/cancellation.hpp"

namespace flexspline::workbench::workbench_supervisor_test {
namespace {

using namespace std::chrono_literals;

// What the workers of a test tell the test, in memory that all of them see.
struct SharedCounts {
  std::atomic<int> workers{0};
  std::atomic<int> done{0};
};
class Supervisor : public ::testing::Test {
 protected:
  Supervisor() {
    void* memory = mmap(nullptr, sizeof(SharedCounts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    told = new (memory) SharedCounts;
  }
  ~Supervisor() override { munmap(told, sizeof(SharedCounts)); }

  // The first worker does `first`; the second one is asked what it was told of the first, and all ends.
  std::vector<Failure> failures_after(const std::function<void(JobTable&)>& first, std::uint64_t memory_bytes = 0) {
    int pipe_ends[2];
    EXPECT_EQ(pipe(pipe_ends), 0);
    JobTable jobs;
    supervise(jobs, {.work =
                         [&](const std::vector<Failure>& failures) {
                           ++told->workers;
                           if (failures.empty()) {
                             first(jobs);
                             return;
                           }
                           std::string text;
                           for (const Failure& f : failures) {
                             text += f.why + '\n' + (f.is_known ? "known" : "unknown") + '\n';
                             for (const Job& j : f.jobs) text += j.tab + '|' + j.what + '|' + j.key + '\n';
                           }
                           EXPECT_EQ(write(pipe_ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
                           ++told->done;
                           std::this_thread::sleep_for(60s);  // SIGTERM ends it
                         },
                     .ends = [&] { return told->done > 0; },
                     .memory_bytes = memory_bytes});
    close(pipe_ends[1]);
    std::string text(4096, '\0');
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read(pipe_ends[0], text.data(), text.size()))));
    close(pipe_ends[0]);
    std::vector<Failure> failures(1);
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, failures[0].why);
    std::getline(lines, line);
    failures[0].is_known = line == "known";
    while (std::getline(lines, line)) failures[0].jobs.push_back({line, {}, {}, false});
    return failures;
  }

  SharedCounts* told = nullptr;
};

TEST_F(Supervisor, AnotherWorkerTakesThePlaceOfOneThatCrashesAndIsToldWhichJobCrashed) {
  const auto failures = failures_after([](JobTable& jobs) {
    const estimation::CancellationCheck idle, mine;
    const JobTable::Entry other(&jobs, {"tab 1", "Showing curves", "a", false}, 1h, &idle);
    std::thread([&] {
      const estimation::CancellationScope known_by(&mine);
      const JobTable::Entry entry(&jobs, {"tab 2", "Adding coulomb_friction", "b", true}, 1h, &mine);
      raise(SIGSEGV);
    }).join();
  });
  EXPECT_EQ(told->workers, 2);
  EXPECT_EQ(failures[0].why.find("it crashed (signal 11, "), 0U) << failures[0].why;
  EXPECT_TRUE(failures[0].is_known);
  ASSERT_EQ(failures[0].jobs.size(), 2U);
  EXPECT_EQ(failures[0].jobs[0].tab, "tab 2|Adding coulomb_friction|b");
}

TEST_F(Supervisor, AWorkerThatIsKilledFromOutsideIsReplaced) {
  const auto failures = failures_after([](JobTable&) { kill(getpid(), SIGKILL); });
  EXPECT_EQ(told->workers, 2);
  EXPECT_NE(failures[0].why.find("signal 9"), std::string::npos) << failures[0].why;
  EXPECT_FALSE(failures[0].is_known);
}

TEST_F(Supervisor, AJobThatDoesNotEndIsEndedAtItsLimit) {
  const auto begin = std::chrono::steady_clock::now();
  const auto failures = failures_after([](JobTable& jobs) {
    const estimation::CancellationCheck mine;
    const JobTable::Entry entry(&jobs, {"tab", "Identifying", "c", true}, 200ms, &mine);
    for (;;) std::this_thread::sleep_for(1s);
  });
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 60s);
  EXPECT_EQ(failures[0].why.find("it did not end within "), 0U) << failures[0].why;
  ASSERT_EQ(failures[0].jobs.size(), 1U);
  EXPECT_EQ(failures[0].jobs[0].tab, "tab|Identifying|c");
}

TEST_F(Supervisor, AJobThatIsCancelledHasLessTimeThanOneThatIsNot) {
  const auto failures = failures_after([](JobTable& jobs) {
    const estimation::CancellationCheck mine;
    JobTable::Entry entry(&jobs, {"tab", "Identifying", "c", true}, 1h, &mine);
    entry.hurry(100ms);
    for (;;) std::this_thread::sleep_for(1s);
  });
  EXPECT_EQ(failures[0].why.find("it did not end within "), 0U) << failures[0].why;
}

TEST_F(Supervisor, AWorkerGetsNoMoreMemoryThanItsLimit) {
  const auto failures = failures_after(
      [](JobTable&) {
        constexpr std::size_t kSmall = 8U << 20, kLarge = 1U << 30;
        const auto take = [](std::size_t bytes) {
          return mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED;
        };
        _exit((take(kSmall) ? 40 : 0) + (take(kLarge) ? 1 : 2));
      },
      256U << 20);
  EXPECT_EQ(failures[0].why, "it ended by itself (exit code 42)");
}

TEST_F(Supervisor, WorkersThatAllEndAtTheirBeginningAreGivenUp) {
  JobTable jobs;
  EXPECT_THROW(
      supervise(jobs, {.work = [&](const std::vector<Failure>&) { ++told->workers; }, .ends = [] { return false; }}),
      std::runtime_error);
  EXPECT_EQ(told->workers, 5);
}

}  // namespace
}  // namespace flexspline::workbench::workbench_supervisor_test
