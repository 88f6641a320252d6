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

#include "host/app/workbench/block_comparison.hpp"
#include "host/drive_link/drive/pairing.hpp"
#include "host/drive_link/drive/recorder.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/drive_link/drive/session.hpp"
#include "host/drive_link/drive/silence.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::workbench {

// How a link to a drive is opened, and how often a lost one is tried again: the pause doubles each time.
struct ConnectionOptions {
  std::function<std::unique_ptr<transport::Link>(const std::string&)> open = transport::open_link;
  std::chrono::milliseconds first{1000}, most{10000};
  std::optional<drive::PairingSigner> signer{};  // of a drive that is paired
};

// The blocks of a preview, by their SHA-256; empty: none.
struct PreviewedBlocks {
  std::string before, after;
};

// A drive that is lost (cable, power, a twin that ended) is connected again when it comes back, if it is the same one.
// Nothing that changes a drive is repeated.
class LiveDrive {
 public:
  // `drive` as --drive names it; empty: none was given.
  explicit LiveDrive(std::string drive, ConnectionOptions reaching = {});
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

  // {"before", "after", "changes", "warnings", "restores"}: the effect of the next two functions. Changes nothing.
  nlohmann::json preview_flash(const model::Model& model, const std::function<void(std::string_view)>& progress,
                               ComparedBlocks* compared = nullptr);
  nlohmann::json preview_restore();
  // {"before", "after", "changes", "warnings", "flashed"} as `flexspline flash` reports it. Throws as it does, and
  // DriveError where the blocks are not those that were shown.
  nlohmann::json flash(const model::Model& model, const std::function<void(std::string_view)>& progress,
                       const std::optional<PreviewedBlocks>& shown = std::nullopt);
  nlohmann::json restore(const std::optional<PreviewedBlocks>& shown = std::nullopt);

  // The answer of `monitor --residual-map`, and "started": it counts only from now; {"problem"} where there is none.
  nlohmann::json residual_map();
  void reset_residual_map();
  // Moves a simulated drive back and forth with feedforward of its model, so that its map fills and its signals are
  // visible. Others are moved by a person, with `flexspline record`. Throws DriveError, and what `progress` throws, at
  // rest.
  void move(const std::function<void(std::string_view)>& progress);

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
  auto noticing_losses(const Act& act);
  void show(const drive::Recording& so_far, double after_s);
  nlohmann::json drive_status() const;

  struct Reconnection {
    std::string drive, serial;
    int attempts = 0;
    std::string why;  // reason of the last failure
    std::chrono::steady_clock::time_point next;
  };

  const std::string given_;
  const ConnectionOptions connection_;
  mutable std::mutex mutex_;             // of all below
  mutable std::atomic<int> waiting_{0};  // waiting requests, which have priority over the listener
  std::unique_ptr<drive::Session> session_;
  std::optional<drive::Scales> scales_;
  drive::Bytes active_;
  std::string problem_;
  std::string drive_;                         // as it was named when it was connected
  std::optional<Reconnection> reconnection_;  // while a drive that was lost is tried
  std::uint64_t wishes_ =
      0;  // number of connections and disconnections by the user: a pending attempt is dropped where it changed
  bool came_back_ = false;
  std::chrono::steady_clock::time_point back_;  // when it was connected again
  std::chrono::milliseconds pause_{0};          // before the next attempt
  std::unique_ptr<nlohmann::json> away_;        // the answer of status() while a motion has the session; else null
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
  std::optional<drive::Silence> silence_;  // from a subscription on
  std::chrono::steady_clock::time_point asked_;
  std::atomic<bool> ends_{false};
  std::thread listener_;
};

}  // namespace flexspline::workbench
