#include "host/app/workbench/job_table.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <new>
#include <stdexcept>
#include <thread>

namespace flexspline::workbench {

enum class SlotState : int { free, filling, running, crashed, overtime };

struct JobSlot {
  std::atomic<SlotState> state{SlotState::free};
  std::atomic<std::int64_t> deadline_ms{0};
  std::int64_t began_ms = 0;
  const estimation::CancellationCheck* cancellation = nullptr;
  bool is_work = false;
  std::array<char, 64> tab{};
  std::array<char, 160> what{};
  std::array<char, 512> key{};
};

namespace {

constexpr std::size_t kSlots = 256;
JobSlot* watched = nullptr;  // of this process

std::int64_t now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

template <std::size_t N>
void put(std::array<char, N>& to, std::string_view text) {
  to.fill('\0');
  std::copy_n(text.begin(), std::min(text.size(), N - 1), to.begin());
}

// Runs on the thread that crashed, possibly inside an allocation: it only stores to existing memory.
void note_crash(int signal) {
  if (const estimation::CancellationCheck* cancellation = estimation::current_cancellation();
      cancellation != nullptr && watched != nullptr)
    for (std::size_t k = 0; k < kSlots; ++k)
      if (watched[k].state.load() == SlotState::running && watched[k].cancellation == cancellation)
        watched[k].state.store(SlotState::crashed);
  std::signal(signal, SIG_DFL);
  raise(signal);
}

}  // namespace

JobTable::JobTable() {
  void* memory = mmap(nullptr, kSlots * sizeof(JobSlot), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::runtime_error("there is no memory for the workbench");
  slots_ = static_cast<JobSlot*>(memory);
  for (std::size_t k = 0; k < kSlots; ++k) new (slots_ + k) JobSlot;
}
JobTable::~JobTable() {
  if (watched == slots_) watched = nullptr;
  munmap(slots_, kSlots * sizeof(JobSlot));
}

JobTable::Entry::Entry(JobTable* jobs, const Job& job, std::chrono::milliseconds limit,
                       const estimation::CancellationCheck* cancellation) {
  if (jobs == nullptr) return;
  for (std::size_t k = 0; k < kSlots && slot_ == nullptr; ++k) {
    SlotState expected = SlotState::free;
    if (jobs->slots_[k].state.compare_exchange_strong(expected, SlotState::filling)) slot_ = jobs->slots_ + k;
  }
  if (slot_ == nullptr) return;
  slot_->began_ms = now_ms();
  slot_->deadline_ms = slot_->began_ms + limit.count();
  slot_->cancellation = cancellation;
  slot_->is_work = job.is_work;
  put(slot_->tab, job.tab);
  put(slot_->what, job.what);
  put(slot_->key, job.key);
  slot_->state = SlotState::running;
}
JobTable::Entry::~Entry() {
  if (slot_ != nullptr) slot_->state = SlotState::free;
}
void JobTable::Entry::hurry(std::chrono::milliseconds limit) {
  if (slot_ != nullptr) slot_->deadline_ms = std::min(slot_->deadline_ms.load(), now_ms() + limit.count());
}

void JobTable::watch() {
  watched = slots_;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) std::signal(signal, note_crash);
  std::thread([slots = slots_] {
    for (;; std::this_thread::sleep_for(std::chrono::milliseconds(100)))
      for (std::size_t k = 0; k < kSlots; ++k) {
        SlotState expected = SlotState::running;
        if (slots[k].state == SlotState::running && now_ms() > slots[k].deadline_ms &&
            slots[k].state.compare_exchange_strong(expected, SlotState::overtime))
          _exit(kOvertimeExit);
      }
  }).detach();
}

JobTable::UnfinishedJobs JobTable::take() {
  UnfinishedJobs left;
  for (std::size_t k = 0; k < kSlots; ++k) {
    JobSlot& slot = slots_[k];
    const SlotState state = slot.state;
    if (state != SlotState::free && state != SlotState::filling) {
      const bool is_culprit = state != SlotState::running;
      Job job{slot.tab.data(), slot.what.data(), slot.key.data(), slot.is_work};
      left.jobs.insert(is_culprit ? left.jobs.begin() : left.jobs.end(), std::move(job));
      if (is_culprit) {
        left.cause_is_known = true;
        left.is_overtime = state == SlotState::overtime;
        left.seconds = (now_ms() - slot.began_ms) / 1000;
      }
    }
    slot.state = SlotState::free;
  }
  // Where the worker was ended from outside, work is a more likely reason than a request of the page.
  const auto is_work = [](const Job& job) { return job.is_work; };
  if (!left.cause_is_known && std::count_if(left.jobs.begin(), left.jobs.end(), is_work) == 1) {
    std::stable_partition(left.jobs.begin(), left.jobs.end(), is_work);
    left.cause_is_known = true;
  }
  return left;
}

}  // namespace flexspline::workbench
