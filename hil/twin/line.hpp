#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "shared/protocol/serial_frame.hpp"

namespace flexspline::twin {

/// The drive's end of a line of bytes: a socket that hosts connect to, a pseudo terminal, or one that is open already.
class Line {
 public:
  /// Throw std::runtime_error with the reason.
  static Line listening(int port);
  static Line terminal();
  static Line inherited(int fd);
  ~Line();
  Line(Line&& other) noexcept;
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  Line& operator=(Line&&) = delete;

  /// How a host names it, as "tcp:127.0.0.1:4711".
  const std::string& name() const { return name_; }
  /// Moves bytes both ways; waits up to so long for something to come. Returns whether the host at the other end went,
  /// or another came, since the last call.
  bool turn(int wait_ms);
  bool has_host() const { return host_ >= 0; }
  /// An inherited line whose other end is gone.
  bool ended() const { return ended_; }

  std::deque<protocol::Message>& arrived() { return arrived_; }
  /// Whether send() has room; what is sent without waits in this process.
  bool has_room() const { return out_.size() < kMostWaiting; }
  void send(const protocol::Message& m);

 private:
  static constexpr std::size_t kMostWaiting = 4096;
  Line() = default;
  void accept_host();
  void read_bytes();
  void write_bytes();
  void lose_host();

  std::string name_;
  int listener_ = -1;
  int host_ = -1;
  int keeps_open_ = -1;  ///< a terminal's other end, so that it stays when a host closes it
  bool changed_ = false;
  bool ended_ = false;
  bool is_terminal_ = false;
  protocol::SerialReader reader_;
  std::deque<protocol::Message> arrived_;
  std::vector<std::uint8_t> out_;
};

}  // namespace flexspline::twin
