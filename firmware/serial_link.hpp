// Between the service and a line of bytes (shared/protocol/serial_frame.hpp): whole messages both ways.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/protocol/serial_frame.hpp"

namespace flexspline::firmware {

// `Line` has receive(byte), which is false where none came, send(byte), and room() for bytes to the host.
template <class Service, class Line>
class SerialLink {
 public:
  SerialLink(Service& service, Line& line) : service_(service), line_(line) {}

  // From background work, again and again. Nobody tells when the host of a line goes: a telemetry subscription stays
  // until the next one. Bytes come for one message at a time; what a full line would not hold waits with the service.
  void turn() {
    std::uint8_t byte = 0;
    while (!waits_ && line_.receive(byte)) waits_ = reader_.take(byte, request_);
    if (waits_) waits_ = !service_.take(request_);
    protocol::Message m;
    while (line_.room() >= protocol::kMostSerial && service_.next(m)) {
      const protocol::SerialFrame frame = protocol::serial_frame(m);
      for (const std::uint8_t b : frame.content()) line_.send(b);
    }
  }

 private:
  Service& service_;
  Line& line_;
  protocol::SerialReader reader_{};
  protocol::Message request_{};
  bool waits_ = false;
};

}  // namespace flexspline::firmware
