// The drive that the workbench speaks with: one for all tabs. Its signals are read in a thread of its own.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <thread>
#include <vector>

#include "host/drive/scales.hpp"
#include "host/drive/session.hpp"
#include "host/model/model.hpp"

namespace flexspline::workbench {

class LiveDrive {
 public:
  // `drive` as --drive names it; empty: none was given.
  explicit LiveDrive(std::string drive);
  ~LiveDrive();
  LiveDrive(const LiveDrive&) = delete;
  LiveDrive& operator=(const LiveDrive&) = delete;

  // Opens the drive that was given, one that was found on USB, or a twin of its own; nothing else. Throws LinkError,
  // DriveError.
  void connect(const std::string& drive);
  void disconnect();
  // {"given", "connected", "name", "serial", "board", "block": {"model", "bytes", "sha256"}, "problem"}.
  nlohmann::json status() const;
  // Drives in reach: [{"drive", "what", "usable", "problem"}]; a twin always.
  nlohmann::json in_reach() const;

  // {"before", "after", "changes", "warnings", "flashed"} as `flexspline flash` says it. Throws as it does.
  nlohmann::json flash(const model::Model& model, const std::function<void(std::string_view)>& say);
  nlohmann::json restore();

  // {"channels": [{"name", "unit"}], "rate_hz", "next", "mode", "samples": [[time_s, value, ...]]} from number `since`
  // on; the first call begins to listen. Nothing is armed.
  nlohmann::json live(std::uint64_t since);

 private:
  void require() const;
  void listen();
  void read_block();
  void lose(const std::string& why);

  const std::string given_;
  mutable std::mutex mutex_;             // of all below
  mutable std::atomic<int> waiting_{0};  // requests that the listener lets pass first
  std::unique_ptr<drive::Session> session_;
  std::optional<drive::Scales> scales_;
  drive::Bytes active_;
  std::string problem_;
  struct Sample {
    double time_s = 0.0;
    std::vector<double> values;
  };
  std::deque<Sample> samples_;
  std::uint64_t count_ = 0;  // of samples so far
  std::uint32_t first_tick_ = 0;
  bool subscribed_ = false;
  std::string mode_;
  std::chrono::steady_clock::time_point heard_, asked_;
  std::atomic<bool> ends_{false};
  std::thread listener_;
};

}  // namespace flexspline::workbench
