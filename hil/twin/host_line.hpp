#pragma once

#include <string>

#include "shared/protocol/message.hpp"

namespace flexspline::twin {

/// The drive's end of a link to its hosts, one host at a time: a serial line, or USB.
class HostLine {
 public:
  virtual ~HostLine() = default;
  /// Its address for a host, such as "tcp:127.0.0.1:4711".
  virtual std::string name() const = 0;
  /// Transfers data both ways; waits up to this time for data. Returns whether the host at the other end left, or
  /// another one connected, since the last call.
  virtual bool transfer(int wait_ms) = 0;
  virtual bool has_host() const = 0;
  /// Unplugs the link, or plugs it in again: a connected host is lost, and until then none can connect.
  virtual void plug(bool in) = 0;
  /// No host can connect any more.
  virtual bool ended() const { return false; }

  /// The oldest received message; null where there is none. It stays until drop().
  virtual const protocol::Message* front() = 0;
  virtual void drop() = 0;
  /// Whether send() has room. Without a host it always has, and sent messages are lost.
  virtual bool has_room() const = 0;
  virtual void send(const protocol::Message& m) = 0;
};

}  // namespace flexspline::twin
