#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace flexspline::twin {

/// The twin's cable, which a file pulls out and puts in again. The file's words: `in`; `out`; `out N`, which pulls it
/// once N more messages came from the host, in the middle of whatever it does. What holds now is said in FILE.state:
/// `in`, `out`, `in N` while N is counted, so that whoever writes can wait for it. A file that is not there changes
/// nothing.
class Cable {
 public:
  explicit Cable(std::string file) : file_(std::move(file)) {}

  bool plugged() const { return plugged_; }
  /// Looks into the file, now and then.
  void look();
  /// A message came from the host.
  void count();

 private:
  void say();

  std::string file_;
  std::string seen_;
  bool plugged_ = true;
  std::optional<std::uint64_t> left_;  ///< messages until it is pulled
  std::chrono::steady_clock::time_point looked_at_{};
};

}  // namespace flexspline::twin
