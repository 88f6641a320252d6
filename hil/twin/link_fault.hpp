#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace flexspline::twin {

/// Injects faults on the twin's link: a file unplugs it and plugs it in again. The file's words: `in`; `out`;
/// `out N`, which unplugs it after N more messages from the host, in the middle of any operation. FILE.state has the
/// present state: `in`, `out`, `in N` while N is counted, so that the writer can wait for it. Without the file nothing
/// changes.
class LinkFault {
 public:
  explicit LinkFault(std::string file) : file_(std::move(file)) {}

  bool plugged() const { return plugged_; }
  /// Reads the file, from time to time.
  void read_file();
  /// A message arrived from the host.
  void count();

 private:
  void write_state();

  std::string file_;
  std::string seen_;
  bool plugged_ = true;
  std::optional<std::uint64_t> left_;  ///< messages until it is unplugged
  std::chrono::steady_clock::time_point looked_at_{};
};

}  // namespace flexspline::twin
