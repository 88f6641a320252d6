// What one tab of the browser works on: the history of its model, the work that runs for it. A reload finds it again.
#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/app/workbench/history.hpp"
#include "host/app/workbench/job_table.hpp"
#include "host/app/workbench/result_view.hpp"
#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::workbench {

// A model with its data. Constant, except for results that are found later.
struct Step {
  std::string id;               // of its own
  std::filesystem::path files;  // folder of the files that came with it; empty: none
  // The folder with a dataset.toml of a first step, where the workbench started without a model.
  std::filesystem::path project;
  std::string data_name, dataset_text;
  std::vector<std::string> tolerated;  // findings in `files` or `project` that the user accepts
  std::string action;                  // "open", "identify", "add", "remove", "data"
  std::string what;                    // "stribeck_gaussian", "two more files"
  std::shared_ptr<const data::Dataset> dataset;
  model::Model model;      // with values
  std::string model_text;  // of its file, comments of the user's file in it
  std::vector<estimation::Estimate> estimates;
  std::vector<std::string> warnings;
  estimation::PipelineOptions pipeline;          // with the records of `dataset`
  std::unique_ptr<const nlohmann::json> errors;  // ResultView::errors()

  Step();
  ~Step();
  // A result view takes much memory: it is computed again where it was discarded.
  std::shared_ptr<ResultView> view() const;
  void discard_view() const;
  // Null while it is not known.
  std::shared_ptr<const selection::Diagnosis> diagnosed() const;
  // Found once for all tabs that have this step: a second caller waits for the result of the first, and searches itself
  // where the first was cancelled. `wait` is called repeatedly meanwhile; an exception from it ends the waiting.
  void diagnose(const std::function<selection::Diagnosis()>& search, const std::function<void()>& wait);

 private:
  mutable std::mutex mutex_;
  std::condition_variable searched_;
  bool searching_ = false;
  mutable std::shared_ptr<ResultView> view_;
  std::shared_ptr<const selection::Diagnosis> diagnosis_;
};

// Thrown out of work that was cancelled; it is not reported.
struct Cancelled {};

// Progress of work; every call may throw Cancelled.
using Progress = std::function<void(std::string_view)>;

// A request while other work runs.
class BusyError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Session {
 public:
  // `jobs`: where its work is registered; null: it is not registered.
  // `first` is null while there is no model yet.
  Session(std::string id, std::shared_ptr<Step> first, JobTable* jobs = nullptr, JobLimits limits = {});
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const std::string& id() const { return id_; }

  // As it was in a worker process that ended, with all its changes and more.
  void restore(History<std::shared_ptr<Step>> history, std::uint64_t changes);

  // Whether there is a model with data; without one its history holds a null alone.
  bool has_model() const;
  // Of the history; those who wait are notified of `change`.
  History<std::shared_ptr<Step>> history() const;
  void change(const std::function<void(History<std::shared_ptr<Step>>&)>& change);

  // Runs `work` in a thread of its own. An exception from it becomes the session's problem. Throws BusyError while
  // other work runs. The problem before is forgotten, unless the work begins by itself: then nobody may have read it
  // yet. `key` is equal for two pieces of work that compute the same.
  void start(const std::string& what, std::function<void(const Progress&)> work, bool by_itself = false,
             const std::string& key = {});
  // Work ends at its next call of Progress, fits at their next set of columns; the result is discarded.
  void cancel();
  bool works() const;
  // Waits until all work that was started has ended, also what was cancelled.
  void join();

  // A part of the answer that changes with work: "pack", "flash", "saved", "closed_loop". Null takes it away.
  void set(const std::string& part, nlohmann::json value);
  // A part that is too large to be sent with each change: the page requests it. Null where there is none.
  void store(const std::string& part, nlohmann::json value);
  std::shared_ptr<const nlohmann::json> stored(const std::string& part) const;
  void set_problem(const std::string& during, const std::exception_ptr& error);
  void set_problem(const std::string& during, const std::string& what);

  // Number of changes so far. Waits until there are more than `seen`, at most so long.
  std::uint64_t wait(std::uint64_t seen, std::chrono::milliseconds limit) const;
  // All that the page shows except curves and maps.
  nlohmann::json state() const;

 private:
  struct Work {
    std::string what, stage;
    std::atomic<bool> cancelled{false};
    std::chrono::steady_clock::time_point began;
    std::thread thread;
    std::atomic<bool> done{false};
    JobTable::Entry* entry = nullptr;  // while it runs
  };
  void changed();

  const std::string id_;
  JobTable* const jobs_;
  const JobLimits limits_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::uint64_t changes_ = 1;
  std::uint64_t works_started_ = 0;
  History<std::shared_ptr<Step>> history_;
  std::shared_ptr<Work> work_;                // running; else null
  std::vector<std::shared_ptr<Work>> ended_;  // with threads still to be joined
  std::unique_ptr<nlohmann::json> parts_;
  std::map<std::string, std::shared_ptr<const nlohmann::json>> stored_;
};

// {"what", "findings": [{"file", "line", "column", "what", "remedy"}]} of an error.
nlohmann::json problem_json(const std::string& during, const std::exception_ptr& error);

}  // namespace flexspline::workbench
