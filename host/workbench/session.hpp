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

#include "host/selection/diagnosis.hpp"
#include "host/workbench/history.hpp"
#include "host/workbench/jobs.hpp"
#include "host/workbench/look.hpp"

namespace flexspline::workbench {

// A model with its data. All but what is found later is fixed once it is made.
struct Step {
  std::string id;               // of its own
  std::filesystem::path files;  // folder of the files that came with it; empty: none
  // What a first step was made of where the workbench began without a model: a folder with a dataset.toml.
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
  std::unique_ptr<const nlohmann::json> errors;  // Look::errors()

  Step();
  ~Step();
  // A look takes much memory: it is made again where it was forgotten.
  std::shared_ptr<Look> look() const;
  void forget_look() const;
  // Null while it is not known.
  std::shared_ptr<const selection::Diagnosis> diagnosed() const;
  // Found once for all tabs that have this step: who comes while another one searches waits for what that finds, and
  // searches itself where that one gave up. `wait` is called again and again meanwhile; what it throws ends the
  // waiting.
  void diagnose(const std::function<selection::Diagnosis()>& search, const std::function<void()>& wait);

 private:
  mutable std::mutex mutex_;
  std::condition_variable searched_;
  bool searching_ = false;
  mutable std::shared_ptr<Look> look_;
  std::shared_ptr<const selection::Diagnosis> diagnosis_;
};

// Thrown out of work that was cancelled; nobody is told.
struct Cancelled {};

// What work says of itself; every call may throw Cancelled.
using Progress = std::function<void(std::string_view)>;

// Asked for while something else runs.
class BusyError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Session {
 public:
  // `board`: where its work is written down; null: nowhere.
  // `first` is null while there is no model yet.
  Session(std::string id, std::shared_ptr<Step> first, JobBoard* board = nullptr, JobLimits limits = {});
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const std::string& id() const { return id_; }

  // As it was in a worker process that ended, with all its changes and more.
  void restore(History<std::shared_ptr<Step>> history, std::uint64_t changes);

  // Whether there is a model with data; without one its history holds a null alone.
  bool has_model() const;
  // Of the history; `change` is told to those who wait.
  History<std::shared_ptr<Step>> history() const;
  void change(const std::function<void(History<std::shared_ptr<Step>>&)>& change);

  // Runs `work` beside the server. What it throws becomes the session's problem. Throws BusyError while other work
  // runs. The problem before is forgotten, unless the work begins by itself: then nobody may have read it yet. `key`
  // is equal for two pieces of work that compute the same.
  void start(const std::string& what, std::function<void(const Progress&)> work, bool by_itself = false,
             const std::string& key = {});
  // Work ends at its next word to Progress, fits at their next set of columns; what it makes is thrown away.
  void cancel();
  bool works() const;
  // Waits until all work that was started has ended, also what was cancelled.
  void join();

  // A part of the answer that changes with work: "pack", "flash", "saved", "closed_loop". Null takes it away.
  void set(const std::string& part, nlohmann::json value);
  // What is too large to be told with each change: the page asks for it. Null where there is none.
  void keep(const std::string& part, nlohmann::json value);
  std::shared_ptr<const nlohmann::json> kept(const std::string& part) const;
  void set_problem(const std::string& during, const std::exception_ptr& error);
  void set_problem(const std::string& during, const std::string& what);

  // Number of changes so far. Waits until there are more than `seen`, at most so long.
  std::uint64_t wait(std::uint64_t seen, std::chrono::milliseconds limit) const;
  // All that the page shows beside curves and maps; README.md says what is in it.
  nlohmann::json state() const;

 private:
  struct Work {
    std::string what, stage;
    std::atomic<bool> cancelled{false};
    std::chrono::steady_clock::time_point began;
    std::thread thread;
    std::atomic<bool> done{false};
    JobBoard::Entry* entry = nullptr;  // while it runs
  };
  void changed();

  const std::string id_;
  JobBoard* const board_;
  const JobLimits limits_;
  mutable std::mutex mutex_;
  mutable std::condition_variable told_;
  std::uint64_t changes_ = 1;
  std::uint64_t works_started_ = 0;
  History<std::shared_ptr<Step>> history_;
  std::shared_ptr<Work> work_;                // running; else null
  std::vector<std::shared_ptr<Work>> ended_;  // with threads still to be joined
  std::unique_ptr<nlohmann::json> parts_;
  std::map<std::string, std::shared_ptr<const nlohmann::json>> kept_;
};

// {"what", "findings": [{"file", "line", "column", "what", "remedy"}]} of an error.
nlohmann::json problem_json(const std::string& during, const std::exception_ptr& error);

}  // namespace flexspline::workbench
