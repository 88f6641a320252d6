// Connects the service with a serial line (shared/protocol/serial_frame.hpp): whole messages both ways.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/protocol/serial_frame.hpp"

namespace flexspline::firmware {

// `Line` has receive(byte), which is false where none is available, send(byte), and room() for bytes to the host.
template <class Service, class Line>
class SerialLink {
 public:
  SerialLink(Service& service, Line& line) : service_(service), line_(line) {}

  // Called repeatedly from background work. A serial line does not show that its host has gone: a telemetry
  // subscription stays until the next one, and other links are never kept out. Bytes of one message are taken at a
  // time; what does not fit into a full line waits in the service.
  bool poll() {
    std::uint8_t byte = 0;
    while (!waits_ && line_.receive(byte)) waits_ = reader_.take(byte, request_);
    if (waits_) waits_ = !service_.take(request_);
    protocol::Message m;
    while (line_.room() >= protocol::kMostSerial && service_.next(m)) {
      const protocol::SerialFrame frame = protocol::serial_frame(m);
      for (const std::uint8_t b : frame.content()) line_.send(b);
    }
    return false;
  }

 private:
  Service& service_;
  Line& line_;
  protocol::SerialReader reader_{};
  protocol::Message request_{};
  bool waits_ = false;
};

}  // namespace flexspline::firmware
