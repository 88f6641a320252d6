// A USB host for tests, packet by packet, written from the text of the USB 2.0 specification (chapters 8 and 9): a wire
// that keeps to the contract of shared/usb/port.hpp and notes whoever breaks it, and the host's half of each transfer.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shared/usb/port.hpp"

namespace flexspline::tests {

using Octets = std::vector<std::uint8_t>;

// The device's port, with what waits on each endpoint. Numbers of endpoints carry 0x80 for IN.
template <bool kBefore = false>
struct TestPort {
  static constexpr bool kAddressBeforeStatus = kBefore;
  struct Pipe {
    bool open = false;
    bool stalled = false;
    bool armed = false;  // OUT
    std::optional<Octets> waiting;
    int began = 0;  // how often its toggle was put to DATA0
  };

  struct Pipes {
    std::array<Pipe, 32> all;
    Pipe& operator[](std::uint8_t a) { return all[static_cast<std::size_t>((a & 0x0f) | ((a & 0x80) >> 3))]; }
  };

  Pipes pipes;
  std::uint8_t address = 0;
  std::vector<std::string> broken;  // rules of the contract

  TestPort() { bus_reset(); }
  void bus_reset() {
    pipes = {};
    address = 0;
    pipes[0x00].open = pipes[0x80].open = true;
  }
  void setup_came() {
    for (const std::uint8_t a : {0x00, 0x80})
      pipes[a] = {.open = true, .stalled = false, .armed = false, .waiting = {}};
  }

  void set_address(std::uint8_t a) { address = a; }
  void open(const usb::EndpointSetup& e) {
    if (e.packet_bytes > 64) broken.push_back("a packet size that full speed has not");
    pipes[e.address] = {
        .open = true, .stalled = false, .armed = false, .waiting = {}, .began = pipes[e.address].began + 1};
  }
  void close(std::uint8_t a) { pipes[a].open = false; }
  void send(std::uint8_t number, std::span<const std::uint8_t> packet) {
    Pipe& pipe = usable(static_cast<std::uint8_t>(number | 0x80), "send");
    if (pipe.waiting) broken.push_back("a second packet while one waits");
    if (packet.size() > 64) broken.push_back("a packet of more than 64 bytes");
    pipe.waiting = Octets(packet.begin(), packet.end());
  }
  void receive(std::uint8_t number) { usable(number, "receive").armed = true; }
  void stall(std::uint8_t a) {
    pipes[a].stalled = true;
    pipes[a].waiting.reset();
    pipes[a].armed = false;
  }
  void unstall(std::uint8_t a) {
    pipes[a] = {.open = pipes[a].open, .stalled = false, .armed = false, .waiting = {}, .began = pipes[a].began + 1};
  }

 private:
  Pipe& usable(std::uint8_t a, const char* what) {
    Pipe& pipe = pipes[a];
    if (!pipe.open) broken.push_back(std::string(what) + " on a closed endpoint " + std::to_string(a));
    if (pipe.stalled) broken.push_back(std::string(what) + " on a stalled endpoint " + std::to_string(a));
    return pipe;
  }
};

enum class Hand { ack, nak, stall, silence };

struct Request {
  std::uint8_t type = 0, request = 0;
  std::uint16_t value = 0, index = 0, length = 0;
};

struct Done {
  bool stalled = false;
  bool hung = false;  // NAK where there has to be an answer
  Octets data;
  std::vector<std::size_t> packets;  // lengths of those of the data stage
};

template <class Device, class Wire>
class TestHost {
 public:
  TestHost(Device& device, Wire& wire) : device_(device), wire_(wire) {}

  void bus_reset() {
    wire_.bus_reset();
    device_.reset();
  }

  // Transactions.

  void setup(const Request& r) {
    const auto low = [](std::uint16_t w) { return static_cast<std::uint8_t>(w & 0xff); };
    const auto high = [](std::uint16_t w) { return static_cast<std::uint8_t>(w >> 8); };
    const std::array<std::uint8_t, 8> bytes{r.type,       r.request,     low(r.value),  high(r.value),
                                            low(r.index), high(r.index), low(r.length), high(r.length)};
    wire_.setup_came();
    device_.setup(bytes);
  }
  Hand in(std::uint8_t number, Octets& packet) {
    auto& pipe = wire_.pipes[static_cast<std::uint8_t>(number | 0x80)];
    if (!pipe.open) return Hand::silence;
    if (pipe.stalled) return Hand::stall;
    if (!pipe.waiting) return Hand::nak;
    packet = *pipe.waiting;
    pipe.waiting.reset();
    device_.sent(number);
    return Hand::ack;
  }
  Hand out(std::uint8_t number, const Octets& packet) {
    auto& pipe = wire_.pipes[number];
    if (!pipe.open) return Hand::silence;
    if (pipe.stalled) return Hand::stall;
    if (!pipe.armed) return Hand::nak;
    pipe.armed = false;
    device_.received(number, packet);
    return Hand::ack;
  }

  // Control transfers (8.5.3): data until wLength or a packet shorter than 64, then the status stage the other way.

  Done get(const Request& r) {
    Done done;
    setup(r);
    if (r.length == 0) return status_in(done);
    for (bool more = true; more;) {
      Octets packet;
      if (!went(in(0, packet), done)) return done;
      done.packets.push_back(packet.size());
      done.data.insert(done.data.end(), packet.begin(), packet.end());
      more = packet.size() == 64 && done.data.size() < r.length;
    }
    // After all that was asked for there is no packet, not even an empty one.
    const bool extra = wire_.pipes[0x80].waiting.has_value();
    went(out(0, {}), done);
    done.hung = done.hung || extra;
    return done;
  }
  Done set(Request r, const Octets& data = {}) {
    r.length = static_cast<std::uint16_t>(data.size());
    return put(r, data);
  }
  // With a wLength of its own, for hosts that do not keep to it.
  Done put(const Request& r, const Octets& data) {
    Done done;
    setup(r);
    for (std::size_t at = 0; at < data.size();) {
      const std::size_t n = std::min<std::size_t>(64, data.size() - at);
      if (!went(out(0, Octets(data.begin() + static_cast<long>(at), data.begin() + static_cast<long>(at + n))), done))
        return done;
      done.packets.push_back(n);
      at += n;
    }
    return status_in(done);
  }

  // Requests of chapter 9.

  Done descriptor(std::uint8_t type, std::uint8_t index, std::uint16_t length, std::uint16_t language = 0) {
    return get({0x80, 6, static_cast<std::uint16_t>(type << 8 | index), language, length});
  }
  Done set_address(std::uint8_t a) { return set({0x00, 5, a, 0, 0}); }
  Done set_configuration(std::uint16_t value) { return set({0x00, 9, value, 0, 0}); }
  // From the reset to the configured state, as hosts do it.
  bool enumerate() {
    bus_reset();
    const bool first = descriptor(1, 0, 64).data.size() == 18;
    bus_reset();
    return first && !set_address(5).stalled && !set_configuration(1).stalled;
  }
  std::string text(std::uint8_t index) {
    const Done done = descriptor(3, index, 255, 0x0409);
    std::string text;
    if (done.data.size() < 2 || done.data[0] != done.data.size() || done.data[1] != 3) return "?";
    for (std::size_t i = 2; i + 1 < done.data.size(); i += 2)
      text += done.data[i + 1] == 0 ? static_cast<char>(done.data[i]) : '#';
    return text;
  }

 private:
  static bool went(Hand hand, Done& done) {
    done.stalled = hand == Hand::stall;
    done.hung = hand == Hand::nak || hand == Hand::silence;
    return hand == Hand::ack;
  }
  Done status_in(Done& done) {
    Octets packet;
    if (went(in(0, packet), done) && !packet.empty()) done.hung = true;
    return done;
  }

  Device& device_;
  Wire& wire_;
};

// A configuration as its bytes say, read once more from chapter 9.6.
struct ReadEndpoint {
  std::uint8_t address = 0, attributes = 0, interval = 0;
  std::uint16_t packet = 0;
};
struct ReadInterface {
  std::uint8_t number = 0, alternate = 0, promised = 0, code = 0, subclass = 0, protocol = 0, string = 0;
  std::vector<ReadEndpoint> endpoints;
  std::vector<Octets> others;  // class descriptors
};
struct ReadConfiguration {
  std::uint16_t total = 0;
  std::uint8_t interfaces = 0, value = 0, attributes = 0, power = 0;
  std::vector<ReadInterface> list;
};
inline std::optional<ReadConfiguration> read_configuration(const Octets& bytes) {
  std::deque<std::uint8_t> left(bytes.begin(), bytes.end());
  ReadConfiguration all;
  bool first = true;
  while (!left.empty()) {
    const std::size_t n = left.front();
    if (n < 2 || n > left.size()) return std::nullopt;
    const Octets d(left.begin(), left.begin() + static_cast<long>(n));
    left.erase(left.begin(), left.begin() + static_cast<long>(n));
    if (first != (d[1] == 2)) return std::nullopt;
    first = false;
    if (d[1] == 2) {
      if (n != 9) return std::nullopt;
      all.total = static_cast<std::uint16_t>(d[2] + 256 * d[3]);
      all.interfaces = d[4];
      all.value = d[5];
      all.attributes = d[7];
      all.power = d[8];
    } else if (d[1] == 4) {
      if (n != 9) return std::nullopt;
      all.list.push_back({d[2], d[3], d[4], d[5], d[6], d[7], d[8], {}, {}});
    } else if (all.list.empty()) {
      return std::nullopt;
    } else if (d[1] == 5) {
      if (n != 7) return std::nullopt;
      all.list.back().endpoints.push_back({d[2], d[3], d[6], static_cast<std::uint16_t>(d[4] + 256 * d[5])});
    } else {
      all.list.back().others.push_back(d);
    }
  }
  return all;
}

}  // namespace flexspline::tests
