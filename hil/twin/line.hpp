#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "hil/twin/host_line.hpp"
#include "shared/protocol/serial_frame.hpp"

namespace flexspline::twin {

/// The drive's end of a serial line: a socket that hosts connect to, a pseudo terminal, or one that is open already.
class Line final : public HostLine {
 public:
  /// Throw std::runtime_error with the reason.
  /// A socket of this machine. Its name ends with a token, random unless one is given, which a host has to send first:
  /// a web page can reach the port, and could otherwise arm the drive with a POST.
  static Line listening(int port, const std::string& token = {});
  static Line terminal();
  static Line inherited(int fd);
  ~Line() override;
  Line(Line&& other) noexcept;
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  Line& operator=(Line&&) = delete;

  std::string name() const override { return name_; }
  bool transfer(int wait_ms) override;
  void plug(bool in) override;
  bool has_host() const override { return host_ >= 0 && plugged_; }
  /// An inherited line whose other end is closed.
  bool ended() const override { return ended_; }
  const protocol::Message* front() override { return arrived_.empty() ? nullptr : &arrived_.front(); }
  void drop() override { arrived_.pop_front(); }
  /// Data without room in the socket wait in this process.
  bool has_room() const override { return out_.size() < kMostWaiting; }
  void send(const protocol::Message& m) override;

 private:
  static constexpr std::size_t kMostWaiting = 4096;
  Line() = default;
  void accept_host();
  void read_token();
  void close_unidentified();
  void read_bytes();
  void write_bytes();
  void lose_host();

  std::string name_;
  int listener_ = -1;
  int host_ = -1;
  int unidentified_ = -1;  ///< has connected and not sent the token yet
  std::string hello_;      ///< what it has to send
  std::string received_;   ///< what it has sent
  int keeps_open_ = -1;    ///< a terminal's other end, so that it stays when a host closes it
  bool changed_ = false;
  bool ended_ = false;
  bool is_terminal_ = false;
  bool plugged_ = true;
  protocol::SerialReader reader_;
  std::deque<protocol::Message> arrived_;
  std::vector<std::uint8_t> out_;
};

}  // namespace flexspline::twin
