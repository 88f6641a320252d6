#pragma once

#include <string>

#include "shared/protocol/message.hpp"

namespace flexspline::twin {

/// The drive's end of a way to its hosts, one host at a time: a line of bytes, or USB.
class HostLine {
 public:
  virtual ~HostLine() = default;
  /// How a host names it, as "tcp:127.0.0.1:4711".
  virtual std::string name() const = 0;
  /// Moves what is ready both ways; waits up to so long for something to come. Returns whether the host at the other
  /// end went, or another came, since the last call.
  virtual bool turn(int wait_ms) = 0;
  virtual bool has_host() const = 0;
  /// Pulls the plug, or puts it in again: whoever is there is gone, and until then nobody can come.
  virtual void plug(bool in) = 0;
  /// No host can come any more.
  virtual bool ended() const { return false; }

  /// The oldest message that came; null where there is none. It stays until drop().
  virtual const protocol::Message* front() = 0;
  virtual void drop() = 0;
  /// Whether send() has room. Without a host there always is, and what is sent is gone.
  virtual bool has_room() const = 0;
  virtual void send(const protocol::Message& m) = 0;
};

}  // namespace flexspline::twin
