// The drive that the workbench speaks with: one for all tabs. Its signals are read in a thread of its own.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/drive/recorder.hpp"
#include "host/drive/scales.hpp"
#include "host/drive/session.hpp"
#include "host/model/model.hpp"

namespace flexspline::workbench {

// How a way to a drive is opened, and how often one that was lost is tried again: the pause doubles each time.
struct Reaching {
  std::function<std::unique_ptr<transport::Link>(const std::string&)> open = transport::open_link;
  std::chrono::milliseconds first{1000}, most{10000};
};

// The blocks of a preview, by their SHA-256; empty: none.
struct Shown {
  std::string before, after;
};

// A drive that is lost (cable, power, a twin that ended) is connected again when it comes back, if it is the same one.
// That alone: nothing that changes a drive is ever done a second time.
class LiveDrive {
 public:
  // `drive` as --drive names it; empty: none was given.
  explicit LiveDrive(std::string drive, Reaching reaching = {});
  ~LiveDrive();
  LiveDrive(const LiveDrive&) = delete;
  LiveDrive& operator=(const LiveDrive&) = delete;

  // Opens the drive that was given, one that was found on USB, or a twin of its own; nothing else. Throws LinkError,
  // DriveError.
  void connect(const std::string& drive);
  void disconnect();
  // {"given", "connected", "name", "serial", "board", "block": {"model", "bytes", "sha256"}, "problem", "moving",
  // "simulated", "came_back": it was lost meanwhile, "again": {"drive", "attempts", "why"} while a drive that was lost
  // is tried, else null}.
  nlohmann::json status() const;
  // Drives in reach: [{"drive", "what", "usable", "problem"}]; a twin always.
  nlohmann::json in_reach() const;

  // {"before", "after", "changes", "warnings", "restores"}: what the next two would do. Changes nothing.
  nlohmann::json preview_flash(const model::Model& model, const std::function<void(std::string_view)>& say);
  nlohmann::json preview_restore();
  // {"before", "after", "changes", "warnings", "flashed"} as `flexspline flash` says it. Throws as it does, and
  // DriveError where the blocks are not those that were shown.
  nlohmann::json flash(const model::Model& model, const std::function<void(std::string_view)>& say,
                       const std::optional<Shown>& shown = std::nullopt);
  nlohmann::json restore(const std::optional<Shown>& shown = std::nullopt);

  // What `monitor --residual-map` says, and "started": it counts only from now; {"problem"} where there is none.
  nlohmann::json residual_map();
  void reset_residual_map();
  // Moves a simulated drive to and fro with its model fed forward, so that its map fills and its signals are seen.
  // Others are moved by a person, with `flexspline record`. Throws DriveError, and what `say` throws, at rest.
  void move(const std::function<void(std::string_view)>& say);

  // {"channels": [{"name", "unit"}], "attempts": of a drive that was lost, "rate_hz", "next", "mode", "samples":
  // [[time_s, value, ...]]} from number `since` on; the first call begins to listen. Nothing is armed.
  nlohmann::json live(std::uint64_t since);

 private:
  void require() const;
  void listen();
  void read_block();
  void forget(const std::string& why);
  void lose(const std::string& why);
  void try_again();
  template <class Act>
  auto seeing_losses(const Act& act);
  void show(const drive::Recording& so_far, double after_s);
  nlohmann::json told() const;

  struct Again {
    std::string drive, serial;
    int attempts = 0;
    std::string why;  // it did not work the last time
    std::chrono::steady_clock::time_point next;
  };

  const std::string given_;
  const Reaching reaching_;
  mutable std::mutex mutex_;             // of all below
  mutable std::atomic<int> waiting_{0};  // requests that the listener lets pass first
  std::unique_ptr<drive::Session> session_;
  std::optional<drive::Scales> scales_;
  drive::Bytes active_;
  std::string problem_;
  std::string drive_;           // as it was named when it was connected
  std::optional<Again> again_;  // while a drive that was lost is tried
  std::uint64_t wishes_ = 0;    // how often a person connected or disconnected: an attempt that is on its way gives way
  bool came_back_ = false;
  std::chrono::steady_clock::time_point back_;  // when it did
  std::chrono::milliseconds pause_{0};          // before the next attempt
  std::unique_ptr<nlohmann::json> away_;        // what status() says while a motion has the session; else null
  bool simulated_ = false;
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
