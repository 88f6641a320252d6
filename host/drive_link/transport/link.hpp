// A way to a drive: messages of at most 64 bytes, there and back. What they mean is none of its business.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "shared/protocol/message.hpp"

namespace flexspline::transport {

// What cannot be reached, or is gone: where, what, and what to do.
class LinkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using Milliseconds = std::chrono::milliseconds;

class Link {
 public:
  virtual ~Link() = default;
  // Throws LinkError where the drive is gone or does not take the message within a second.
  virtual void send(const protocol::Message& m) = 0;
  // The next message, or none where none came within so long. Throws LinkError where the drive is gone.
  virtual std::optional<protocol::Message> receive(Milliseconds limit) = 0;
  // As --drive names it, for messages to a person.
  virtual std::string name() const = 0;
};

// What --drive may be, for help and errors.
inline constexpr const char* kDriveHelp =
    "serial number of a drive on USB, hid:SERIAL, serial:PORT, tcp:HOST:PORT/TOKEN of a twin, or twin (one of its own)";

// Opens what --drive names; empty: the only drive on USB. Throws LinkError.
std::unique_ptr<Link> open_link(const std::string& drive);

// A drive in reach without opening it.
struct Found {
  std::string drive;  // as --drive names it
  std::string what;
  bool usable = true;
  std::string problem;  // why not, and what to do
};
// Drives on USB. Serial ports and sockets do not show which device is behind them.
std::vector<Found> find_drives();

// The parts of open_link(), one file each.
std::unique_ptr<Link> open_hid(const std::string& serial);
std::vector<Found> find_hid();
std::unique_ptr<Link> open_serial(const std::string& port);
std::unique_ptr<Link> open_tcp(const std::string& address);
inline constexpr const char* kThreePhaseTwin = "twin:three-phase";
// Starts `flexspline-hil twin` as a process of its own, which ends with the link.
std::unique_ptr<Link> open_twin(bool three_phase);
// Over a file descriptor that is open, with the serial framing; it is closed with the link.
std::unique_ptr<Link> stream_link(int fd, std::string name);

}  // namespace flexspline::transport
